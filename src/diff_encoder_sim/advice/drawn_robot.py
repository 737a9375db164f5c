"""Robot properties that affect odometry: true wheels, slip, and the geometry that odometry assumes."""

from __future__ import annotations

import enum
import math
from typing import Mapping, NamedTuple

import numpy as np

from diff_encoder_sim.navigation.goal_stopping import StopSpread
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.simulated_robot import TrueWheels, load_simulated_robot
from diff_encoder_sim.simulation.simulator import WheelErrorParams
from diff_encoder_sim.trials.robot_params import RobotParams, spread_with
from diff_encoder_sim.wheels.odometry_params import OdometryParams


class WheelCause(enum.Enum):
    """Cause of a difference between the wheels and their model in odometry."""

    RADIUS = 'wheel radius'
    SEPARATION = 'wheel separation'
    SLIP = 'wheel slip'
    CONTACT = 'simulated contact'  # slip of error-free wheels on the simulated floor; not of a real robot


# Amount of each cause from 0 (none, the default) to 1 (all).
Amounts = Mapping[WheelCause, float]
ALL_CAUSES: Amounts = dict.fromkeys(WheelCause, 1.0)
ROBOTS_CAUSES: Amounts = dict.fromkeys((WheelCause.RADIUS, WheelCause.SEPARATION, WheelCause.SLIP), 1.0)


class DrawnWheels(NamedTuple):
    """True wheels of sampled robots, (draws, 1) each."""

    left_radius_m: np.ndarray
    right_radius_m: np.ndarray
    separation_m: np.ndarray


class DrawnRobot(NamedTuple):
    """Robot from which samples with different wheels are drawn."""

    sound: TrueWheels  # without errors
    errors: WheelErrorParams
    odometry: OdometryParams
    axle_x_m: float  # true position of the axle ahead of the base
    stop: StopSpread

    def wheels(self, amounts: Amounts, rng: np.random.Generator, draws: int) -> DrawnWheels:
        """Sample true wheels; without a cause they equal those that odometry assumes."""
        errors, normals = self.errors, rng.standard_normal((3, draws, 1))
        radius, separation = amounts.get(WheelCause.RADIUS, 0.0), amounts.get(WheelCause.SEPARATION, 0.0)
        radius_m, separation_m = 0.5 * self.odometry.wheel_diameter, self.odometry.wheel_separation
        means, spread = self._mean_wheels(), errors.radius_spread
        return DrawnWheels(
            radius_m + radius * (means.left_radius_m * (1.0 + spread * normals[0]) - radius_m),
            radius_m + radius * (means.right_radius_m * (1.0 + spread * normals[1]) - radius_m),
            separation_m
            + separation * (means.separation_m * (1.0 + errors.wheel_separation_spread * normals[2]) - separation_m),
        )

    def has(self, cause: WheelCause) -> bool:
        """Return whether the robot has this error."""
        errors, odometry, means = self.errors, self.odometry, self._mean_wheels()
        if cause is WheelCause.CONTACT:
            return True
        if cause is WheelCause.SLIP:
            return bool(errors.left_slip or errors.right_slip or errors.slip_noise)
        if cause is WheelCause.SEPARATION:
            return bool(errors.wheel_separation_spread) or not _equal(means.separation_m, odometry.wheel_separation)
        is_off = not all(_equal(2.0 * radius_m, odometry.wheel_diameter) for radius_m in means[:2])
        return is_off or bool(errors.radius_spread)

    def _mean_wheels(self) -> TrueWheels:
        errors, sound = self.errors, self.sound
        return TrueWheels(
            sound.left_radius_m * (1.0 + errors.left_radius_error),
            sound.right_radius_m * (1.0 + errors.right_radius_error),
            sound.separation_m * (1.0 + errors.wheel_separation_error),
        )


def drawn_robot(source: RobotSource, params: RobotParams) -> DrawnRobot:
    """Load a robot.

    Raises:
        ConfigError: the robot description is invalid.
    """
    robot = load_simulated_robot(source, params.simulator.choices())
    stop = spread_with(params, params.encoder.counts_per_turn)
    return DrawnRobot(robot.wheels, params.simulator.wheel_errors, params.odometry, robot.description.axle_x_m, stop)


def _equal(one_m: float, other_m: float) -> bool:
    return math.isclose(one_m, other_m, rel_tol=1e-9)
