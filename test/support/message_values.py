"""Values of a trial, drawn at random, for the tests of messages."""

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.simulation.state import BodyState, JointStates
from diff_encoder_sim.simulation.world import Model, World
from diff_encoder_sim.wheels.covariance import PlanarCovariance
from diff_encoder_sim.wheels.odometry import OdometryEstimate, TwistCovariance
from diff_encoder_sim.wheels.report_link import EncoderSample

JOINTS = ('left_wheel_joint', 'right_wheel_joint')


def stamp_ns(rng):
    return int(rng.integers(0, 2**31)) * 10**9 + int(rng.integers(0, 10**9))


def floats(rng, count):
    return tuple((rng.normal(size=count) * 10.0 ** rng.integers(-9, 9)).tolist())


def pose(rng):
    return Pose2D(*floats(rng, 3))


def quat_xyzw(rng):
    quat = rng.normal(size=4)
    return tuple((quat / np.linalg.norm(quat)).tolist())


def covariance(rng, size):
    root = rng.normal(size=(size, size))
    return root @ root.T


def joints(rng):
    return JointStates(stamp_ns(rng), JOINTS, floats(rng, 2), floats(rng, 2))


def scan(rng):
    ranges_m = rng.uniform(0.0, 7.0, rng.integers(1, 2000))
    ranges_m[ranges_m > 6.0] = np.inf
    return Scan(stamp_ns(rng), -np.pi, 2.0 * np.pi / len(ranges_m), 0.15, 6.0, ranges_m)


def encoder_sample(rng):
    return EncoderSample(stamp_ns(rng), *rng.integers(-(2**62), 2**62, 2).tolist())


def estimate(rng):
    return OdometryEstimate(
        stamp_ns(rng), pose(rng), *floats(rng, 2), PlanarCovariance(*floats(rng, 6)), TwistCovariance(*floats(rng, 3))
    )


def grid(rng):
    cells = rng.integers(-1, 101, rng.integers(1, 60, 2), dtype=np.int8)
    return OccupancyGrid(cells, 0.05, pose(rng))


def body(rng):
    return BodyState(floats(rng, 3), quat_xyzw(rng), floats(rng, 3), floats(rng, 3))


def world(rng):
    return World('room', [Model(name, _upright_pose(rng), []) for name in ('floor', 'walls', 'pillars')])


def _upright_pose(rng):
    yaw_rad = rng.uniform(-np.pi, np.pi)
    full = np.eye(4)
    full[:2, :2] = [[np.cos(yaw_rad), -np.sin(yaw_rad)], [np.sin(yaw_rad), np.cos(yaw_rad)]]
    full[:3, 3] = rng.normal(size=3)
    return full
