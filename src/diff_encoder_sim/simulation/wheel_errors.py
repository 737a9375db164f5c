"""Errors of real wheels: geometry that differs from the drawing, and slip; all zero by default."""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from pydantic import Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounded_numbers import Between, TravelVariance_m
from diff_encoder_sim.base.typed_params import Params
from diff_encoder_sim.robots.simulated_robot import GeometryErrors

GeometryError = Annotated[float, Between(-0.5, 0.5)]
Spread = Annotated[float, Between(0.0, 0.1)]
Slip = Annotated[float, Between(0.0, 0.999)]

# Without any of these errors the simulated wheels lose grip in curves, and some travel where they brake. As odometry's
# `curve_noise` and `distance_std`, by its error in the paper's tests (docs/adr/0031-covariance-follows-robot.md).
CONTACT_CURVE_NOISE = 1e-6  # [m^2/m per (m/s^2)^2]
CONTACT_DISTANCE_STD = 4e-6


class WheelErrorParams(Params):
    """Errors of the true robot against the nominal one; left out, there are none."""

    left_radius_error: GeometryError = Field(0.0, description='true against nominal radius, relative')
    right_radius_error: GeometryError = Field(0.0, description='true against nominal radius, relative')
    wheel_separation_error: GeometryError = Field(0.0, description='true against nominal separation, relative')
    radius_spread: Spread = Field(
        0.0, description="standard deviation of each wheel's radius from robot to robot, relative; drawn by the seed"
    )
    wheel_separation_spread: Spread = Field(0.0, description='likewise of the separation')
    left_slip: Slip = Field(0.0, description='fraction of the rolled distance that is lost')
    right_slip: Slip = Field(0.0, description='fraction of the rolled distance that is lost')
    slip_noise: TravelVariance_m = Field(0.0, description="variance of a wheel's lost travel per metre of it [m^2/m]")

    def geometry(self, rng: np.random.Generator) -> GeometryErrors:
        """Draw the errors that make another robot, as those of slip do not."""
        means = self.left_radius_error, self.right_radius_error, self.wheel_separation_error
        spreads = self.radius_spread, self.radius_spread, self.wheel_separation_spread
        drawn = (
            (1.0 + mean) * (1.0 + spread * normal) - 1.0 if spread else mean
            for mean, spread, normal in zip(means, spreads, rng.standard_normal(3).tolist())
        )
        return GeometryErrors(*drawn)

    def travel_errors(self) -> Tuple[float, float]:
        """Return by how much the left and the right wheel travel more than their turning says, relative; no noise."""
        left = self.left_radius_error - self.left_slip * (1.0 + self.left_radius_error)
        return left, self.right_radius_error - self.right_slip * (1.0 + self.right_radius_error)


class SlippingWheels:
    """Turns the rolling of ideal wheels into the turning of wheels that slip.

    The physics rolls without slipping. A wheel with slip s that turns by a rolls by a (1 - s)
    only, so the angle that its encoder measures is the rolled one divided by 1 - s. Noise is added
    as a random walk over the distance rolled: the k|ds| of Siegwart and Nourbakhsh, section 5.2.4.
    """

    def __init__(self, params: WheelErrorParams, radius_m: Tuple[float, float], rng: np.random.Generator) -> None:
        self._rolled_fractions = (1.0 - params.left_slip, 1.0 - params.right_slip)
        self._noise_rad_per_sqrt_rad = [math.sqrt(params.slip_noise / wheel_radius_m) for wheel_radius_m in radius_m]
        self._is_ideal = params.slip_noise == 0 and self._rolled_fractions == (1.0, 1.0)
        self._rng = rng
        self._rolled_rad = (0.0, 0.0)
        self._noise_rad = [0.0, 0.0]

    def rolling_speeds(self, left_radps: float, right_radps: float) -> Tuple[float, float]:
        """Return the ideal wheels' speeds [rad/s] that move the robot as these wheels' speeds do."""
        return left_radps * self._rolled_fractions[0], right_radps * self._rolled_fractions[1]

    def turning_speeds(self, left_radps: float, right_radps: float) -> Tuple[float, float]:
        """Return these wheels' speeds [rad/s] when the ideal ones roll so: the mean, without noise."""
        return left_radps / self._rolled_fractions[0], right_radps / self._rolled_fractions[1]

    def turned(self, rolled_rad: Tuple[float, float]) -> Tuple[float, float]:
        """Return the angles turned [rad] since the start when the ideal wheels rolled `rolled_rad`."""
        if self._is_ideal:
            return rolled_rad
        normals = self._rng.standard_normal(2).tolist()
        for wheel in (0, 1):
            step_rad = abs(rolled_rad[wheel] - self._rolled_rad[wheel])
            self._noise_rad[wheel] += self._noise_rad_per_sqrt_rad[wheel] * math.sqrt(step_rad) * normals[wheel]
        self._rolled_rad = rolled_rad
        return (
            rolled_rad[0] / self._rolled_fractions[0] + self._noise_rad[0],
            rolled_rad[1] / self._rolled_fractions[1] + self._noise_rad[1],
        )
