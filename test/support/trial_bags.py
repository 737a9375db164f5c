"""Bags of trials whose every number is known, and the trials that they are of."""

import json

from rosbags.rosbag1 import Writer

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.trial_definition import Trial
from places import ROOT
from reencoding_drives import ROS1

PERIOD_NS = 50_000_000
STAMPED = 'geometry_msgs/msg/PoseStamped'
ODOMETRY, WITH_COVARIANCE = 'nav_msgs/msg/Odometry', 'geometry_msgs/msg/PoseWithCovarianceStamped'

# x [m], y [m], yaw [rad], a period apart: SL from (-10, 0), whose goal is (10, 0).
TRUTH = [(-10.0, 0.0, 0.0), (0.0, 0.0, 0.0), (10.0, 0.1, 0.02)]
ODOM = [(0.0, 0.0, 0.0), (10.0, 0.3, 0.01), (19.9, 0.5, 0.05)]


def trial(test='SL', number=1, **changes):
    definition = load_test(test, ROOT / 'config')
    return Trial.from_mapping({'test': definition, 'ppr': 40, 'number': number, **changes}, 'test')


def write_bag(path, about, odom=ODOM, truth=TRUTH, amcl=(), estimated=(), result='succeeded', more=()):
    """A bag of poses a period apart.

    `about` is a Trial, the text of /trial, or None; `more` are further (topic, kind, node, rows).
    """
    texts = [
        ('/trial', about if isinstance(about, str) or about is None else about.model_dump_json()),
        ('/trial_result', result and json.dumps({'outcome': result, 'reason': ''})),
    ]
    series = [
        ('/odom', ODOMETRY, None, odom),
        ('/world_pose', STAMPED, None, truth),
        ('/amcl_pose', WITH_COVARIANCE, None, amcl),
        ('/global_pose', STAMPED, None, estimated),
        *more,
    ]
    with Writer(path) as bag:
        for topic, text in texts:
            if text is not None:
                connection = bag.add_connection(topic, 'std_msgs/msg/String', typestore=ROS1.store)
                bag.write(connection, 1, ROS1.raw(ROS1.text(text)))
        for topic, kind, node, rows in series:
            connection = bag.add_connection(topic, kind, typestore=ROS1.store, callerid=node)
            for index, row in enumerate(rows, start=1):
                bag.write(connection, index * PERIOD_NS, ROS1.raw(ROS1.pose(kind, index * PERIOD_NS, Pose2D(*row))))
    return path
