"""Parameters of odometry: assumed geometry, encoder, and twist estimation."""

from __future__ import annotations

import math
from typing import Any, Dict, Optional, Tuple

from pydantic import Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import Between, Length_m, Offset_m, TravelVariance_m
from diff_encoder_sim.base.params import param
from diff_encoder_sim.base.per_wheel import WheelDiameter_m
from diff_encoder_sim.wheels.counter import CounterLimits
from diff_encoder_sim.wheels.covariance import GeometryStd, reading_variance
from diff_encoder_sim.wheels.encoder_params import CountingParams

# Travel variance per metre at a lateral acceleration of 1 m/s^2, proportional to its square.
CurveVariance = Annotated[float, Between(0.0, 1.0, 'm^2/m per (m/s^2)^2')]

RelativeStd = Annotated[float, Between(0.0, 2.0)]

# Default slip variance [m^2/m]: 4.5 mm after 20 m.
USUAL_MOTION_NOISE = 1e-6

FOLLOWED = "none: by the robot's wheel errors, else"

# Parameters of the wheel uncertainty.
UNCERTAINTY_KEYS = ('motion_noise', 'curve_noise', 'distance_std', 'turn_std', 'diameter_difference_std')


class OdometryParams(CountingParams):
    """Parameters of gz_diff_odom_node.

    `wheel_diameter` and `wheel_separation` are the assumed geometry; the simulator has the true one.
    """

    wheel_diameter: WheelDiameter_m = param(0.2, 'as the odometry assumes it [m]')
    wheel_separation: Length_m = param(0.4, 'between the contact points, as the odometry assumes it [m]')
    axle_x: Offset_m = param(0.0, 'place of the axle ahead of the origin of base_frame [m]')
    velocity_window: Annotated[int, Between(1, 10_000)] = param(1, 'report intervals that the twist spans')
    motion_noise: Optional[TravelVariance_m] = param(
        None, f"variance of a wheel's travel per metre of it [m^2/m]; {FOLLOWED} 1e-6"
    )
    curve_noise: Optional[CurveVariance] = param(
        None,
        'what a sideways acceleration of 1 m/s^2 adds to motion_noise, and its square in proportion '
        f'[m^2/m per (m/s^2)^2]; {FOLLOWED} 0',
    )
    distance_std: Optional[RelativeStd] = param(
        None, f"standard deviation of a distance's relative error; {FOLLOWED} 0"
    )
    turn_std: Optional[RelativeStd] = param(None, f"standard deviation of a turn's relative error; {FOLLOWED} 0")
    diameter_difference_std: Optional[RelativeStd] = param(
        None, f'standard deviation of the right minus the left diameter, relative to their mean; {FOLLOWED} 0'
    )
    max_wheel_speed: Annotated[float, Between(1e-3, 1e9, 'rad/s')] = param(
        100.0, 'a faster wheel means that the counter was restarted [rad/s]'
    )
    max_wheel_acceleration: Annotated[float, Between(1e-1, 1e9, 'rad/s^2')] = param(
        200.0, 'counters near zero that this cannot explain were restarted, too [rad/s^2]'
    )
    velocity_low_pass: Annotated[float, Between(0.0, 100.0, 's')] = param(
        0.0, "time constant of a low-pass on the wheels' speeds in the twist [s]; 0: none"
    )
    following_error_window: Annotated[float, Between(1e-3, 1e9, 'rad/s')] = param(
        1.0, 'on /diagnostics: how far a wheel may be from its commanded speed [rad/s]'
    )
    following_error_timeout: Annotated[float, Between(1e-2, 1e6, 's')] = param(
        1.0, 'on /diagnostics: for how long it may be further from it [s]'
    )
    odom_frame: str = Field('odom', min_length=1, description='frame of the pose')
    base_frame: str = Field('base_link', min_length=1, description='frame of the robot')
    publish_tf: bool = param(True, 'broadcast odom_frame -> base_frame on TF')

    def values_in_use(self) -> Dict[str, Any]:
        """Return the values by key, with the encoder's resolution and all uncertainties."""
        return {**super().values_in_use(), **self.uncertainty}

    @property
    def travel_variance(self) -> float:
        """Return the variance of a wheel's travel per metre of it [m^2/m]."""
        return USUAL_MOTION_NOISE if self.motion_noise is None else self.motion_noise

    @property
    def geometry_std(self) -> GeometryStd:
        """Return the standard deviations of the geometry's relative errors."""
        return GeometryStd(self.distance_std or 0.0, self.turn_std or 0.0, self.diameter_difference_std or 0.0)

    @property
    def uncertainty(self) -> Dict[str, float]:
        """Return the wheel uncertainty by parameter name, with defaults filled in."""
        return dict(zip(UNCERTAINTY_KEYS, (self.travel_variance, self.curve_noise or 0.0, *self.geometry_std)))

    @property
    def m_per_pulse(self) -> Tuple[float, float]:
        """Return the distance per pulse of the left and the right rim [m]."""
        diameter, ppr = self.wheel_diameter, self.counts_per_turn
        return math.pi * diameter.left / ppr.left, math.pi * diameter.right / ppr.right

    @property
    def reading_variances_m2(self) -> Tuple[float, float]:
        """Return the variance of the left and of the right wheel's travel in one reading [m^2]."""
        (left_m, right_m), ppr, variance = self.m_per_pulse, self.counts_per_turn, self.encoder.pulse_variance
        return reading_variance(left_m, variance(ppr.left)), reading_variance(right_m, variance(ppr.right))

    @property
    def counter_limits(self) -> CounterLimits:
        """Return the limits of counters and wheels."""
        ppr, jump = self.counts_per_turn, self.encoder.most_jump
        left, right = ppr.left / (2.0 * math.pi), ppr.right / (2.0 * math.pi)  # counts per rad
        speeds = self.max_wheel_speed * left, self.max_wheel_speed * right
        accelerations = self.max_wheel_acceleration * left, self.max_wheel_acceleration * right
        return CounterLimits(self.counter_modulus, *speeds, *accelerations, jump(ppr.left), jump(ppr.right))
