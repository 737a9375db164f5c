"""Bags of trials whose every number is known, and the trials that they are of."""

import json

import numpy as np
from rosbags.rosbag1 import Writer

from diff_encoder_sim.base.se2 import quat_xyzw_from_yaw
from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.drives.typestore import noetic_store
from places import ROOT

PERIOD_NS = 50_000_000

TEXT, STAMPED = 'std_msgs/msg/String', 'geometry_msgs/msg/PoseStamped'
ODOMETRY, WITH_COVARIANCE = 'nav_msgs/msg/Odometry', 'geometry_msgs/msg/PoseWithCovarianceStamped'

# x [m], y [m], yaw [rad], a period apart: SL from (-10, 0), whose goal is (10, 0).
TRUTH = [(-10.0, 0.0, 0.0), (0.0, 0.0, 0.0), (10.0, 0.1, 0.02)]
ODOM = [(0.0, 0.0, 0.0), (10.0, 0.3, 0.01), (19.9, 0.5, 0.05)]


def trial(test='SL', number=1, **changes):
    return Trial.from_mapping(
        {'test': load_test(test, ROOT / 'config'), 'ppr': 40, 'number': number, **changes}, 'test'
    )


def message(kind, row, stamp_ns, frame='map'):
    """A stamped pose of a kind, serialised."""
    types = noetic_store().types
    header = types['std_msgs/msg/Header'](0, types['builtin_interfaces/msg/Time'](*divmod(stamp_ns, 10**9)), frame)
    pose = types['geometry_msgs/msg/Pose'](
        types['geometry_msgs/msg/Point'](row[0], row[1], 0.0),
        types['geometry_msgs/msg/Quaternion'](*quat_xyzw_from_yaw(row[2])),
    )
    with_covariance = types['geometry_msgs/msg/PoseWithCovariance'](pose, np.zeros(36))
    zero = types['geometry_msgs/msg/Vector3'](0.0, 0.0, 0.0)
    twist = types['geometry_msgs/msg/TwistWithCovariance'](types['geometry_msgs/msg/Twist'](zero, zero), np.zeros(36))
    made = {
        STAMPED: lambda: types[STAMPED](header, pose),
        WITH_COVARIANCE: lambda: types[WITH_COVARIANCE](header, with_covariance),
        ODOMETRY: lambda: types[ODOMETRY](header, 'base_link', with_covariance, twist),
    }[kind]()
    return bytes(noetic_store().serialize_ros1(made, kind))


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
                bag.write(
                    bag.add_connection(topic, TEXT, typestore=noetic_store()),
                    1,
                    bytes(noetic_store().serialize_ros1(noetic_store().types[TEXT](text), TEXT)),
                )
        for topic, kind, node, rows in series:
            connection = bag.add_connection(topic, kind, typestore=noetic_store(), callerid=node)
            for index, row in enumerate(rows, start=1):
                bag.write(connection, index * PERIOD_NS, message(kind, row, index * PERIOD_NS))
    return path
