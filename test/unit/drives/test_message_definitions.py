"""The definitions in bags are those of ROS's packages, to the letter."""

import pytest

from diff_encoder_sim.drives.message_types import ENCODER_PULSE, MODEL_STATES
from diff_encoder_sim.drives.topics import TOPICS
from diff_encoder_sim.drives.typestore import defined_types, fields_text, full_text
from places import ROOT

RECORDED = sorted({topic.message_type for topic in TOPICS})


def test_the_encoders_definition_is_that_of_its_msg_file():
    assert fields_text(ENCODER_PULSE) == (ROOT / 'msg' / 'EncoderPulse.msg').read_text()


def test_a_type_is_followed_by_its_parts_each_once_in_the_order_of_the_fields():
    parts = [
        line[len('MSG: ') :] for line in full_text('nav_msgs/msg/Odometry').splitlines() if line.startswith('MSG: ')
    ]
    assert parts == [
        'std_msgs/Header',
        'geometry_msgs/PoseWithCovariance',
        'geometry_msgs/Pose',
        'geometry_msgs/Point',
        'geometry_msgs/Quaternion',
        'geometry_msgs/TwistWithCovariance',
        'geometry_msgs/Twist',
        'geometry_msgs/Vector3',
    ]


def test_no_definition_is_left_that_no_recorded_type_needs():
    texts = ''.join(f'MSG: {kind.replace("/msg/", "/")}\n{full_text(kind)}\n' for kind in RECORDED)
    needed = {line[len('MSG: ') :].replace('/', '/msg/') for line in texts.splitlines() if line.startswith('MSG: ')}
    assert needed == set(defined_types())


@pytest.mark.parametrize('message_type', RECORDED)
def test_a_full_text_is_that_of_the_installed_package(message_type):
    """Byte for byte; gazebo_msgs, which Debian lacks, has comments that are left out here."""
    message = pytest.importorskip('genpy.message')
    installed = message.get_message_class(message_type.replace('/msg/', '/'))
    if installed is None or message_type == MODEL_STATES:
        pytest.skip('not installed, or without its comments here')
    assert full_text(message_type) == installed._full_text
