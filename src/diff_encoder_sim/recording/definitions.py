"""Of messages: fields of types that rosbags' store lacks, and what nodes and bags share."""
from __future__ import annotations

# Of height, roll and pitch wheels tell nothing; the value is what gazebo_ros_diff_drive writes.
UNKNOWN_VARIANCE = 1e12

# Of gazebo_msgs/ModelStates; Debian's ROS lacks the package, too.
MODEL_STATES = '''\
string[] name
geometry_msgs/Pose[] pose
geometry_msgs/Twist[] twist'''

# Of msg/EncoderPulse.msg, which is not at hand where only the Python package is.
ENCODER_PULSE = '''\
Header header
string[] name
int64[] pulses'''

# By the type's name as rosbags spells it.
DEFINITIONS = {
    'gazebo_msgs/msg/ModelStates': MODEL_STATES,
    'diff_encoder_sim/msg/EncoderPulse': ENCODER_PULSE,
    'tf2_msgs/msg/TFMessage': 'geometry_msgs/TransformStamped[] transforms',
    'move_base_msgs/msg/MoveBaseGoal': 'geometry_msgs/PoseStamped target_pose',
    'move_base_msgs/msg/MoveBaseResult': '',
    'move_base_msgs/msg/MoveBaseActionGoal': '''\
Header header
actionlib_msgs/GoalID goal_id
MoveBaseGoal goal''',
    'move_base_msgs/msg/MoveBaseActionResult': '''\
Header header
actionlib_msgs/GoalStatus status
MoveBaseResult result''',
}
