"""The topics of a trial's bag, with their types and the nodes that publish them."""

from __future__ import annotations

import enum
from typing import Dict, Literal, NamedTuple, Tuple

# Names of message types, as rosbags spells them.
STRING_TYPE = 'std_msgs/msg/String'
JOINT_STATE_TYPE = 'sensor_msgs/msg/JointState'
LASER_SCAN_TYPE = 'sensor_msgs/msg/LaserScan'
IMU_TYPE = 'sensor_msgs/msg/Imu'
MODEL_STATES_TYPE = 'gazebo_msgs/msg/ModelStates'
ENCODER_PULSE_TYPE = 'diff_encoder_sim/msg/EncoderPulse'
ODOMETRY_TYPE = 'nav_msgs/msg/Odometry'
TWIST_TYPE = 'geometry_msgs/msg/Twist'
POSE_STAMPED_TYPE = 'geometry_msgs/msg/PoseStamped'
POSE_WITH_COVARIANCE_TYPE = 'geometry_msgs/msg/PoseWithCovarianceStamped'
TRANSFORM_STAMPED_TYPE = 'geometry_msgs/msg/TransformStamped'
TRANSFORMS_TYPE = 'tf2_msgs/msg/TFMessage'

ARROW = '->'  # between two frames of /tf, as users write them: map->base_link


class PoseSource(enum.Enum):
    """A source of poses, in the order of trials.csv; the value is the prefix of its columns there."""

    ODOM = 'odom'  # only odometry, of wheels or fused, from the start pose on
    AMCL = 'amcl'  # the last localization update
    GLOBAL = 'global'  # the pose estimate: localization's map -> odom, and odometry since
    WORLD = 'world'  # ground truth

    # Members are compared by identity; Enum's own is a call in Python for each of millions of look-ups.
    __hash__ = object.__hash__


BagFormat = Literal['ros1', 'mcap']  # of ROS 1, or an MCAP file of ROS 2
BAG_FORMATS = ('ros1', 'mcap')

# Latched JSON texts: the trial, and how it ended. A bag without a result is torn.
TRIAL = '/trial'
TRIAL_RESULT = '/trial_result'

CLOCK = '/clock'
JOINT_STATES = '/joint_states'
MODEL_STATES = '/gazebo/model_states'
SCAN = '/scan'
IMU = '/imu/data'
CMD_VEL = '/cmd_vel'
ENCODER_PULSE = '/encoder_pulse'
ENCODER_VELOCITY = '/encoder_velocity'
ODOM = '/odom'
FILTERED = '/odometry/filtered'
AMCL_POSE = '/amcl_pose'
INITIAL_POSE = '/initialpose'
GLOBAL_POSE = '/global_pose'
WORLD_POSE = '/world_pose'
TF = '/tf'
TF_STATIC = '/tf_static'
DIAGNOSTICS = '/diagnostics'
MAP = '/map'
MAP_METADATA = '/map_metadata'
GOAL = '/move_base/goal'
RESULT = '/move_base/result'

TOPIC_OF_SOURCE = dict(zip(PoseSource, (ODOM, AMCL_POSE, GLOBAL_POSE, WORLD_POSE)))

# The nodes of trial.launch and mapping.launch that publish them.
SIMULATOR_NODE = '/simulator_node'
STATE_PUBLISHER_NODE = '/robot_state_publisher'
ENCODER_NODE = '/gz_diff_encoder_node'
ODOM_NODE = '/gz_diff_odom_node'
IDEAL_ODOM_NODE = '/ideal_odom_node'
FUSION_NODE = '/odometry_fusion_node'
WORLD_POSE_NODE = '/world_pose_node'
GLOBAL_POSE_NODE = '/global_pose_node'
MAP_NODE = '/map_server'
SLAM_NODE = '/slam_gmapping'
AMCL_NODE = '/amcl'
MOVE_BASE_NODE = '/move_base'
NAVIGATION_TRIAL_NODE = '/navigation_trial_node'
SCRIPTED_DRIVE_NODE = '/scripted_drive_node'

_TRIAL_NODES = (NAVIGATION_TRIAL_NODE, SCRIPTED_DRIVE_NODE)

RecordMode = Literal['full', 'minimal', 'none']


class RecordedTopic(NamedTuple):
    """One topic of a trial."""

    name: str
    message_type: str  # as rosbags spells it
    nodes: Tuple[str, ...]  # that publish it, by the callerid of their connections
    is_latched: bool = False
    is_bulk: bool = False  # not needed by analysis; left out of a minimal recording


# One row for each topic of a trial's bag. trials/publications.py publishes its messages; their encoders are in
# message_encoders.py. Topics of the last lines are published with navigation only, /initialpose by
# people, /encoder_velocity if the motor controller measures speeds, /imu/data if there is an IMU, and
# /odometry/filtered if odometry is fused with it.
TOPICS = (
    RecordedTopic(TRIAL, STRING_TYPE, _TRIAL_NODES, is_latched=True),
    RecordedTopic(TRIAL_RESULT, STRING_TYPE, _TRIAL_NODES, is_latched=True),
    RecordedTopic(CLOCK, 'rosgraph_msgs/msg/Clock', (SIMULATOR_NODE,), is_bulk=True),
    RecordedTopic(JOINT_STATES, JOINT_STATE_TYPE, (SIMULATOR_NODE,), is_bulk=True),
    RecordedTopic(MODEL_STATES, MODEL_STATES_TYPE, (SIMULATOR_NODE,), is_bulk=True),
    RecordedTopic(CMD_VEL, TWIST_TYPE, (*_TRIAL_NODES, MOVE_BASE_NODE)),
    RecordedTopic(ENCODER_PULSE, ENCODER_PULSE_TYPE, (ENCODER_NODE,)),
    RecordedTopic(ENCODER_VELOCITY, JOINT_STATE_TYPE, (ENCODER_NODE,)),
    RecordedTopic(ODOM, ODOMETRY_TYPE, (ODOM_NODE, IDEAL_ODOM_NODE)),
    RecordedTopic(GLOBAL_POSE, POSE_STAMPED_TYPE, (GLOBAL_POSE_NODE,)),
    RecordedTopic(WORLD_POSE, POSE_STAMPED_TYPE, (WORLD_POSE_NODE,)),
    RecordedTopic(FILTERED, ODOMETRY_TYPE, (FUSION_NODE,)),
    RecordedTopic(
        TF, TRANSFORMS_TYPE, (STATE_PUBLISHER_NODE, ODOM_NODE, IDEAL_ODOM_NODE, FUSION_NODE, AMCL_NODE), is_bulk=True
    ),
    RecordedTopic(
        TF_STATIC,
        TRANSFORMS_TYPE,
        (STATE_PUBLISHER_NODE, SCRIPTED_DRIVE_NODE, SIMULATOR_NODE),
        is_latched=True,
        is_bulk=True,
    ),
    RecordedTopic(SCAN, LASER_SCAN_TYPE, (SIMULATOR_NODE,), is_bulk=True),
    RecordedTopic(IMU, IMU_TYPE, (SIMULATOR_NODE,), is_bulk=True),
    RecordedTopic(AMCL_POSE, POSE_WITH_COVARIANCE_TYPE, (AMCL_NODE,), is_latched=True),
    RecordedTopic(INITIAL_POSE, POSE_WITH_COVARIANCE_TYPE, ()),
    RecordedTopic(MAP, 'nav_msgs/msg/OccupancyGrid', (MAP_NODE, SLAM_NODE), is_latched=True, is_bulk=True),
    RecordedTopic(MAP_METADATA, 'nav_msgs/msg/MapMetaData', (MAP_NODE, SLAM_NODE), is_latched=True, is_bulk=True),
    RecordedTopic(GOAL, 'move_base_msgs/msg/MoveBaseActionGoal', (NAVIGATION_TRIAL_NODE,)),
    RecordedTopic(RESULT, 'move_base_msgs/msg/MoveBaseActionResult', (MOVE_BASE_NODE,)),
)
RECORDED = tuple(topic.name for topic in TOPICS)

# Only live nodes publish diagnostics: what they contain also depends on the time at which commands arrive.
_DIAGNOSED = (ENCODER_NODE, ODOM_NODE, AMCL_NODE)
LIVE_TOPICS = (*TOPICS, RecordedTopic(DIAGNOSTICS, 'diagnostic_msgs/msg/DiagnosticArray', _DIAGNOSED, is_bulk=True))
RECORDED_LIVE = tuple(topic.name for topic in LIVE_TOPICS)


def recorded_topics(mode: RecordMode) -> Dict[str, RecordedTopic]:
    """Return the topics that a mode records, by name."""
    return {each.name: each for each in TOPICS if mode == 'full' or (mode == 'minimal' and not each.is_bulk)}
