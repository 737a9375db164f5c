"""Wheel angles from poses by inverse kinematics."""

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D, move_along_arc
from diff_encoder_sim.drives.drive_stream import Message
from diff_encoder_sim.drives.odometry_wheels import OdometryWheels
from diff_encoder_sim.drives.recorded_poses import PoseTopic
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from reencoding_drives import JOINTS, MAKERS, ROS1, WHEEL_DIAMETER_M, WHEEL_SEPARATION_M

# Ahead, about a wheel, on the spot, back in a bend; a step is both wheels' angles [rad].
STEPS_RAD = [(0.2, 0.2)] * 5 + [(0.0, 0.3)] * 5 + [(-0.4, 0.4)] * 9 + [(-0.3, -0.1)] * 20 + [(0.0, 0.0)] * 2


def poses(axle_x_m=0.0):
    """The base's, which is behind the axle."""
    axle, to_base = Pose2D(3.0, -2.0, 1.0), Pose2D(-axle_x_m, 0.0, 0.0)
    yield axle.compose(to_base)
    for left_rad, right_rad in STEPS_RAD:
        left_m, right_m = 0.5 * WHEEL_DIAMETER_M * left_rad, 0.5 * WHEEL_DIAMETER_M * right_rad
        axle = move_along_arc(axle, 0.5 * (left_m + right_m), (right_m - left_m) / WHEEL_SEPARATION_M)
        yield axle.compose(to_base)


def read(maker, all_poses, **params):
    odometry = PoseTopic('/odom', 'nav_msgs/msg/Odometry', maker.is_ros2)
    wheels = OdometryWheels(odometry, JOINTS, OdometryParams(**params))
    for tick, pose in enumerate(all_poses):
        wheels.add(Message('/odom', 0, maker.raw(maker.pose('nav_msgs/msg/Odometry', tick * 10**7, pose))))
    [(drive, _)] = wheels.drives()
    return drive.wheel_angles_rad, wheels


@MAKERS
@pytest.mark.parametrize('axle_x_m', [0.0, 0.15])
def test_wheels_turn_as_they_did(maker, axle_x_m):
    found, wheels = read(maker, poses(axle_x_m), axle_x=axle_x_m)
    turned_rad = np.vstack([(0.0, 0.0), np.cumsum(STEPS_RAD, axis=0)])
    assert found == pytest.approx(turned_rad, abs=1e-9)
    assert len(list(wheels.notes())) == 1


def test_each_wheel_turns_by_its_own_radius():
    narrow, wide = WHEEL_DIAMETER_M, 1.1 * WHEEL_DIAMETER_M
    found, _ = read(ROS1, poses(), wheel_diameter={'left': narrow, 'right': wide})
    turned_rad = np.sum(STEPS_RAD, axis=0)
    assert found[-1] - found[0] == pytest.approx((turned_rad[0], turned_rad[1] / 1.1))


def test_sideways_motion_is_left_out_and_said():
    found, wheels = read(ROS1, [Pose2D(0.1 * step, 0.05 * step, 0.0) for step in range(11)])
    assert found[-1] - found[0] == pytest.approx((10.0, 10.0))
    assert '0.50 m sideways on 1.00 m ahead' in list(wheels.notes())[1]
