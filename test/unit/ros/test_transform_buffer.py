"""A buffer of transforms outlives what would abort tf2; each case runs in a process of its own."""

import subprocess
import sys

import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

SCRIPT = """
import rosgraph.masterapi, rospy, sys, tf2_ros, types
from geometry_msgs.msg import TransformStamped
from diff_encoder_sim.ros import transform_buffer

warned = []
transform_buffer.log.warning = lambda *args: warned.append(args[0] % args[1:])
transform_buffer.tf2_ros.TransformListener = lambda *_, **__: None
rosgraph.masterapi.Master = lambda _: types.SimpleNamespace(lookupService=lambda _: None)
rospy.rostime.set_rostime_initialized(True)
rospy.rostime._set_rostime(rospy.Time(100))
buffer = tf2_ros.Buffer() if sys.argv[1] == 'plain' else transform_buffer.TransformBuffer()
for stamp_s in eval(sys.argv[2]):
    transform = TransformStamped(child_frame_id='base_link')
    transform.header.frame_id, transform.header.stamp = 'odom', rospy.Time(stamp_s)
    transform.transform.rotation.w = 1.0
    buffer.set_transform(transform, '/foreign')
if 'static' in sys.argv:
    transform.header.stamp = rospy.Time(2**32 - 1)
    buffer.set_transform_static(transform, '/foreign')
    print(buffer.get_latest_common_time('odom', 'base_link').secs)
for stamp_s in (0, 99):
    print(buffer.lookup_transform('odom', 'base_link', rospy.Time(stamp_s)).header.stamp.secs)
print(*warned, sep='\\n')
"""


def run(kind, stamps_s, *options):
    process = subprocess.run(
        [sys.executable, '-c', SCRIPT, kind, repr(stamps_s), *options], capture_output=True, text=True, timeout=60
    )
    return process.returncode, process.stdout.splitlines(), process.stderr


# Of a sum with the time that tf2 keeps transforms, and of differences in a lookup.
FATAL = [[98, 100, 2**32 - 1], [98, 100, 2**31 + 200, 2**31 + 201]]


@pytest.mark.parametrize('stamps_s', FATAL)
def test_tf2_itself_takes_its_process_down(stamps_s):
    """Or the buffer has become needless."""
    code, _, errors = run('plain', stamps_s)
    assert code < 0, errors  # ended by a signal


@pytest.mark.parametrize('stamps_s', FATAL)
def test_transforms_that_tf2_cannot_hold_are_dropped_and_named(stamps_s):
    code, lines, errors = run('ours', stamps_s)
    assert code == 0, errors
    assert lines[:2] == ['100', '99']
    assert lines[2].startswith("/tf: transform 'odom' -> 'base_link' of /foreign: stamp ")
    assert lines[2].endswith('; dropped')


def test_a_transform_far_ahead_does_not_push_out_the_true_ones():
    code, lines, errors = run('ours', [98, 100, 160])
    assert code == 0, errors
    assert lines[:2] == ['100', '99']
    assert 'ahead of the clock' in lines[2]


def test_a_static_transform_of_a_frame_that_moves_has_no_time():
    """Its stamp means nothing, but tf2 would take it for the newest of the frame, and abort."""
    assert run('plain', [98, 100], 'static')[0] < 0  # or setting its stamp has become needless
    code, lines, errors = run('ours', [98, 100], 'static')
    assert code == 0, errors
    assert lines[:3] == ['100', '100', '99']
