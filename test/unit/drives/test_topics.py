"""The topics of a trial's bag, and the types of their messages."""

import re

from diff_encoder_sim.drives.topics import ENCODER_PULSE_TYPE, TOPICS
from diff_encoder_sim.drives.typestore import definition, fields_text
from places import ROOT


def test_the_topics_nodes_are_those_of_the_launch_files():
    launched = set()
    for path in (ROOT / 'launch').glob('*.launch'):
        launched.update(re.findall(r'<node name="(\w+)"', path.read_text()))
    assert {node.lstrip('/') for topic in TOPICS for node in topic.nodes} <= launched


# Of upstream's packages and of msg/EncoderPulse.msg, as `rosmsg md5` gives them.
MD5SUMS = {
    'std_msgs/msg/String': '992ce8a1687cec8c8bd883ec73ca41d1',
    'rosgraph_msgs/msg/Clock': 'a9c97c1d230cfc112e270351a944ee47',
    'sensor_msgs/msg/JointState': '3066dcd76a6cfaef579bd0f34173e9fd',
    'gazebo_msgs/msg/ModelStates': '48c080191eb15c41858319b4d8a609c2',
    'geometry_msgs/msg/Twist': '9f195f881246fdfa2798d1d3eebca84a',
    'diff_encoder_sim/msg/EncoderPulse': '923c04331b3211ae663e32d722d8aff0',
    'nav_msgs/msg/Odometry': 'cd5e73d190d741a2f92e81eda573aca7',
    'geometry_msgs/msg/PoseStamped': 'd3812c3cbc69362b77dc0b19b345f8f5',
    'tf2_msgs/msg/TFMessage': '94810edda583a504dfda3829e70d7eec',
    'sensor_msgs/msg/Imu': '6a62c6daae103f4ff57a132d6f95cec2',
    'sensor_msgs/msg/LaserScan': '90c7ef2dc6895d81024acba2ac42f369',
    'geometry_msgs/msg/PoseWithCovarianceStamped': '953b798c0f514ff060a53a3498ce6246',
    'nav_msgs/msg/OccupancyGrid': '3381f2d731d4076ec5c71b0759edbe4e',
    'nav_msgs/msg/MapMetaData': '10cfc8a2818024d3248802c00c95f11b',
    'move_base_msgs/msg/MoveBaseActionGoal': '660d6895a1b9a16dce51fbdd9a64a56b',
    'move_base_msgs/msg/MoveBaseActionResult': '1eb06eeff08fa7ea874431638cb52332',
}


def test_every_recorded_type_is_upstreams():
    assert {topic.message_type: definition(topic.message_type).md5sum for topic in TOPICS} == MD5SUMS


def test_the_encoders_definition_is_that_of_its_msg_file():
    assert fields_text(ENCODER_PULSE_TYPE) == (ROOT / 'msg' / 'EncoderPulse.msg').read_text()
