"""The motor controller: from velocity commands to wheel speeds, within the robot's limits."""

from __future__ import annotations

import logging
import math
from typing import Tuple

from pydantic import Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounded_numbers import (
    Between,
    PositiveAcceleration_mps2,
    PositiveDuration_s,
    PositiveSpeed_mps,
    PositiveTurnAcceleration_radps2,
    PositiveTurnRate_radps,
)
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.base.typed_params import Params

log = logging.getLogger(__name__)


# Of a limit; less is rounding.
ABOVE_LIMIT = 1.0 + 1e-9


class DriveParams(Params):
    """Limits of the motors and their controller."""

    max_linear_speed: PositiveSpeed_mps = Field(1.0, description='commands are cut to it [m/s]')
    max_angular_speed: PositiveTurnRate_radps = Field(2.0, description='commands are cut to it [rad/s]')
    max_linear_acceleration: PositiveAcceleration_mps2 = Field(1.5, description='slope of the velocity ramp [m/s^2]')
    max_angular_acceleration: PositiveTurnAcceleration_radps2 = Field(
        6.0, description='slope of the turning-rate ramp [rad/s^2]'
    )
    wheel_torque: Annotated[float, Between(1e-6, 1e6, 'N m')] = Field(20.0, description='of each motor [N m]')
    command_timeout: PositiveDuration_s = Field(
        0.5, description='the robot stops after this time without a command [s]'
    )


class DriveController:
    """Ramps the body velocity towards the newest command and splits it onto the wheels."""

    def __init__(self, params: DriveParams, wheel_radius_m: float, wheel_separation_m: float) -> None:
        self.params = params
        self._wheel_radius_m = wheel_radius_m
        self._wheel_separation_m = wheel_separation_m
        self.reset()

    def reset(self) -> None:
        """Stand still with no command."""
        self._command = (0.0, 0.0)
        self._command_time_ns = 0
        self._velocity = (0.0, 0.0)  # linear [m/s] and angular [rad/s], on the ramp
        self._wheel_speeds_radps = (0.0, 0.0)

    def command(self, now_ns: int, linear_mps: float, angular_radps: float) -> None:
        """Take a command; one beyond the limits is cut to them, with a warning.

        Raises:
            InputFault: the command is not finite; the last one stays until it times out.
        """
        if not (math.isfinite(linear_mps) and math.isfinite(angular_radps)):
            raise InputFault(f'linear.x {linear_mps} m/s, angular.z {angular_radps} rad/s; expected finite numbers')
        limits = self.params.max_linear_speed, self.params.max_angular_speed
        cut = (_clamp(linear_mps, limits[0]), _clamp(angular_radps, limits[1]))
        if max(abs(linear_mps) / limits[0], abs(angular_radps) / limits[1]) > ABOVE_LIMIT:
            text = (
                'velocity command of %.3f m/s, %.3f rad/s exceeds the limits of %.3f m/s, %.3f rad/s: limited to them'
            )
            log.warning(text, linear_mps, angular_radps, *limits)
        self._command = cut
        self._command_time_ns = now_ns

    def wheel_speeds_radps(self, now_ns: int, interval_s: float) -> Tuple[float, float]:
        """Return the speeds of the left and the right wheel [rad/s] for the next interval."""
        age_s = (now_ns - self._command_time_ns) / NANOSECONDS_PER_SECOND
        wanted = self._command if age_s <= self.params.command_timeout else (0.0, 0.0)
        if wanted != self._velocity:
            self._ramp(wanted, interval_s)
        return self._wheel_speeds_radps

    def _ramp(self, wanted: Tuple[float, float], interval_s: float) -> None:
        linear_mps, angular_radps = self._velocity
        linear_mps += _clamp(wanted[0] - linear_mps, self.params.max_linear_acceleration * interval_s)
        angular_radps += _clamp(wanted[1] - angular_radps, self.params.max_angular_acceleration * interval_s)
        self._velocity = linear_mps, angular_radps
        half_difference_mps = 0.5 * self._wheel_separation_m * angular_radps
        self._wheel_speeds_radps = (
            (linear_mps - half_difference_mps) / self._wheel_radius_m,
            (linear_mps + half_difference_mps) / self._wheel_radius_m,
        )


def _clamp(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))
