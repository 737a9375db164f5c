"""A message of each recorded topic, encoded."""

import numpy as np

import message_values as values
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives import message_encoders as encoders
from diff_encoder_sim.drives import topics
from diff_encoder_sim.navigation.navigator_inputs import GoalStatus

SCAN = Scan(0, -3.0, 0.01, 0.15, 6.0, np.linspace(0.2, 5.0, 600))
GRID = values.grid(np.random.default_rng(0))
ODOM_POSE = encoders.encode_tf(encoders.encode_transform(Pose2D(1.0, 2.0, 0.5), 7, 'odom', 'base_link'))
MAP_POSE = encoders.encode_tf(encoders.encode_transform(Pose2D(3.0, 2.0, 0.1), 7, 'map', 'odom'))


def pose(stamp_ns=0):
    return encoders.encode_pose_stamped(Pose2D(1.0, 2.0, 0.5), stamp_ns, 'map')


def one_of_each():
    """(topic, node, message) of all that nodes publish."""
    rng = np.random.default_rng(1)
    stamped, sent = values.pose(rng), encoders.SentGoal(topics.NAVIGATION_TRIAL_NODE, 1, 5)
    made = {
        topics.CLOCK: encoders.encode_clock(7),
        topics.JOINT_STATES: encoders.encode_joint_state(values.joints(rng)),
        topics.MODEL_STATES: encoders.ModelStatesEncoder(values.world(rng), 'alto').encode(values.body(rng)),
        topics.CMD_VEL: encoders.encode_command(0.4, 0.1),
        topics.ENCODER_PULSE: encoders.encode_encoder_pulse(values.encoder_sample(rng), values.JOINTS),
        topics.ENCODER_VELOCITY: encoders.encode_wheel_speeds(7, (1.0, -2.0), values.JOINTS),
        topics.ODOM: encoders.encode_odometry(values.estimate(rng), 'odom', 'base_link'),
        topics.GLOBAL_POSE: pose(),
        topics.WORLD_POSE: pose(),
        topics.TF: ODOM_POSE,
        topics.TF_STATIC: MAP_POSE,
        topics.SCAN: encoders.encode_scan(SCAN, 'laser', 0.1),
        topics.AMCL_POSE: encoders.encode_pose_with_covariance(stamped, values.covariance(rng, 3), 7, 'map'),
        topics.MAP: encoders.encode_map(GRID, 7, 'map'),
        topics.MAP_METADATA: encoders.encode_map_metadata(GRID, 7),
        topics.GOAL: encoders.encode_goal(sent, stamped, 5, 'map'),
        topics.RESULT: encoders.encode_result(sent, GoalStatus.SUCCEEDED, 'goal reached', 7),
        topics.TRIAL: encoders.encode_string('{}'),
        topics.TRIAL_RESULT: encoders.encode_string('{}'),
    }
    return [(topic, node, made[topic.name]) for topic in topics.TOPICS for node in topic.nodes]
