"""A buffer of transforms outlives what would abort tf2; each case runs in a process of its own."""

import subprocess
import sys

import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

SCRIPT = """
import io, rosgraph.masterapi, rospy, sys, tf2_ros, types
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage
from diff_encoder_sim.ros import transforms as transform_buffer

warned = []
transform_buffer.log.warning = lambda *args: warned.append(args[0] % args[1:])
transform_buffer.subscriber = lambda *_: None
rosgraph.masterapi.Master = lambda _: types.SimpleNamespace(lookupService=lambda _: None)
rospy.rostime.set_rostime_initialized(True)
rospy.rostime._set_rostime(rospy.Time(100))
buffer = tf2_ros.Buffer() if sys.argv[1] == 'plain' else transform_buffer.TransformBuffer()

def give(transform):
    if sys.argv[1] == 'plain':
        return buffer.set_transform(transform, '/foreign')
    content = io.BytesIO()
    TFMessage([transform]).serialize(content)
    message = types.SimpleNamespace(content=content.getvalue(), _connection_header={'callerid': '/foreign'})
    buffer._on_transforms(message)

for stamp_s in eval(sys.argv[2]):
    transform = TransformStamped(child_frame_id='base_link')
    transform.header.frame_id, transform.header.stamp = 'odom', rospy.Time(stamp_s)
    transform.transform.rotation.w = 1.0
    give(transform)
if 'held' in sys.argv:
    print(len(buffer._held['base_link']))
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


LAZY = """
import rosgraph.masterapi, rospy, types
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.ros import transforms as transform_buffer
from diff_encoder_sim.drives.pose_messages import encode_tf, encode_transform

transform_buffer.subscriber = lambda *_: None
rosgraph.masterapi.Master = lambda _: types.SimpleNamespace(lookupService=lambda _: None)
rospy.rostime.set_rostime_initialized(True)
rospy.rostime._set_rostime(rospy.Time(100))
buffer, changes = transform_buffer.TransformBuffer(), []

def give(parent, child, stamp_s, x_m=0.0):
    content = encode_tf(encode_transform(Pose2D(x_m, 0.0, 0.0), round(stamp_s * 10**9), parent, child))
    buffer._on_transforms(types.SimpleNamespace(content=content, _connection_header={}))

def x_m(parent, child, stamp_s=0.0):
    return buffer.lookup_transform(parent, child, rospy.Time(stamp_s)).transform.translation.x

"""


def run_lazy(script):
    process = subprocess.run([sys.executable, '-c', LAZY + script], capture_output=True, text=True, timeout=60)
    assert process.returncode == 0, process.stderr
    return process.stdout.split()


def test_tf2_gets_only_frames_that_a_lookup_passes_and_then_with_their_past():
    words = run_lazy("""
for stamp_s in (98, 99):
    give('odom', 'base_link', stamp_s, stamp_s)
    give('base_link', 'wheel', stamp_s, 1000 * stamp_s)
    give('/map', '/odom', stamp_s)
print(x_m('map', 'base_link'), x_m('map', 'base_link', 98.5), 'wheel' in buffer.all_frames_as_string())
print(x_m('base_link', 'wheel', 98.0), buffer.get_latest_common_time('wheel', 'base_link').secs)
""")
    assert words == ['99.0', '98.5', 'False', '98000.0', '99']


def test_who_listens_hears_of_transforms_that_lookups_passed_and_of_what_would_complete_them():
    words = run_lazy("""
buffer.listen(lambda: changes.append(1))
give('base_link', 'wheel', 99)
print(len(changes))  # at the beginning, and before any lookup
try:
    x_m('map', 'base_link')
except Exception:
    pass
for frames in (('base_link', 'wheel'), ('odom', 'base_link'), ('map', 'odom')):
    give(*frames, 99.5)
    print(len(changes))
    if len(frames[0]) == 4:
        try:
            x_m('map', 'base_link')
        except Exception:
            print('not yet')
x_m('map', 'base_link')
""")
    assert words == ['2', '2', '3', 'not', 'yet', '4']


def test_frames_no_longer_than_the_cache_and_none_of_before_a_reset():
    words = run_lazy("""
for stamp_s in (80, 99):
    give('odom', 'base_link', stamp_s)
print(len(buffer._held['base_link']))
rospy.rostime._set_rostime(rospy.Time(5))
give('odom', 'base_link', 4)
print(buffer.get_latest_common_time('odom', 'base_link').secs)
""")
    assert words == ['1', '4']


def test_a_stamp_that_stands_still_is_held_once():
    code, lines, errors = run('ours', [98] * 50 + [99, 100], 'held')
    assert code == 0, errors
    assert lines[0] == '3'


ODD_NAMES = """
lookups = [
    lambda frame: buffer.lookup_transform('odom', frame, rospy.Time(0)),
    lambda frame: buffer.get_latest_common_time('odom', frame),
]
for lookup in lookups:
    for name in ('a\\0b', 'a\\ud800', 'n' * 100_000, '/a', ''):
        try:
            lookup(name)
            print('found')
        except tf2_ros.TransformException as error:
            print('refused')
"""


def test_a_name_that_no_frame_can_have_is_refused_as_tf2_refuses_a_frame():
    process = subprocess.run(
        [sys.executable, '-c', SCRIPT + ODD_NAMES, 'ours', '[98, 100]'], capture_output=True, text=True, timeout=60
    )
    assert process.returncode == 0, process.stderr
    assert process.stdout.count('refused') >= 9
