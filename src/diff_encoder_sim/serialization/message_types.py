"""Message types by their names, the fields of those that rosbags' store lacks, and what nodes and
bags share.
"""

from __future__ import annotations

# Types by their names as rosbags spells them.
STRING = 'std_msgs/msg/String'
CLOCK = 'rosgraph_msgs/msg/Clock'
JOINT_STATE = 'sensor_msgs/msg/JointState'
LASER_SCAN = 'sensor_msgs/msg/LaserScan'
MODEL_STATES = 'gazebo_msgs/msg/ModelStates'
ENCODER_PULSE = 'diff_encoder_sim/msg/EncoderPulse'
ODOMETRY = 'nav_msgs/msg/Odometry'
TWIST = 'geometry_msgs/msg/Twist'
POSE_STAMPED = 'geometry_msgs/msg/PoseStamped'
POSE_WITH_COVARIANCE = 'geometry_msgs/msg/PoseWithCovarianceStamped'
TRANSFORM_STAMPED = 'geometry_msgs/msg/TransformStamped'
TRANSFORMS = 'tf2_msgs/msg/TFMessage'
OCCUPANCY_GRID = 'nav_msgs/msg/OccupancyGrid'
MAP_METADATA = 'nav_msgs/msg/MapMetaData'
MOVE_BASE_GOAL = 'move_base_msgs/msg/MoveBaseGoal'
MOVE_BASE_RESULT = 'move_base_msgs/msg/MoveBaseResult'
MOVE_BASE_ACTION_GOAL = 'move_base_msgs/msg/MoveBaseActionGoal'
MOVE_BASE_ACTION_RESULT = 'move_base_msgs/msg/MoveBaseActionResult'

# Of height, roll and pitch wheels tell nothing; the value is what gazebo_ros_diff_drive writes.
UNKNOWN_VARIANCE = 1e12

# Of gazebo_msgs/ModelStates; Debian's ROS lacks the package, too.
MODEL_STATES_FIELDS = """\
string[] name
geometry_msgs/Pose[] pose
geometry_msgs/Twist[] twist"""

# Of msg/EncoderPulse.msg, which is not at hand where only the Python package is.
ENCODER_PULSE_FIELDS = """\
Header header
string[] name
int64[] pulses"""

# Fields by type.
DEFINITIONS = {
    MODEL_STATES: MODEL_STATES_FIELDS,
    ENCODER_PULSE: ENCODER_PULSE_FIELDS,
    TRANSFORMS: 'geometry_msgs/TransformStamped[] transforms',
    MOVE_BASE_GOAL: 'geometry_msgs/PoseStamped target_pose',
    MOVE_BASE_RESULT: '',
    MOVE_BASE_ACTION_GOAL: """\
Header header
actionlib_msgs/GoalID goal_id
MoveBaseGoal goal""",
    MOVE_BASE_ACTION_RESULT: """\
Header header
actionlib_msgs/GoalStatus status
MoveBaseResult result""",
}
