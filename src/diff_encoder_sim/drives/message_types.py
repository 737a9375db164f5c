"""The names of message types, as rosbags spells them."""

from __future__ import annotations

STRING = 'std_msgs/msg/String'
CLOCK = 'rosgraph_msgs/msg/Clock'
JOINT_STATE = 'sensor_msgs/msg/JointState'
LASER_SCAN = 'sensor_msgs/msg/LaserScan'
MODEL_STATES = 'gazebo_msgs/msg/ModelStates'
ENCODER_PULSE = 'diff_encoder_sim/msg/EncoderPulse'
ODOMETRY = 'nav_msgs/msg/Odometry'
TWIST_TYPE = 'geometry_msgs/msg/Twist'
POSE_STAMPED = 'geometry_msgs/msg/PoseStamped'
POSE_WITH_COVARIANCE = 'geometry_msgs/msg/PoseWithCovarianceStamped'
TRANSFORM_STAMPED = 'geometry_msgs/msg/TransformStamped'
TRANSFORMS = 'tf2_msgs/msg/TFMessage'
OCCUPANCY_GRID = 'nav_msgs/msg/OccupancyGrid'
DIAGNOSTICS = 'diagnostic_msgs/msg/DiagnosticArray'
MAP_METADATA = 'nav_msgs/msg/MapMetaData'
MOVE_BASE_GOAL = 'move_base_msgs/msg/MoveBaseGoal'
MOVE_BASE_RESULT = 'move_base_msgs/msg/MoveBaseResult'
MOVE_BASE_ACTION_GOAL = 'move_base_msgs/msg/MoveBaseActionGoal'
MOVE_BASE_ACTION_RESULT = 'move_base_msgs/msg/MoveBaseActionResult'
