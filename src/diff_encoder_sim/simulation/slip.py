"""Errors of the simulated wheels: their geometry, and the slip by which they turn further than they roll.

The physics rolls without slip. Slip changes the angles and speeds of the joints, by the motion and the floor.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Sequence, Tuple

import numpy as np
from pydantic import model_validator
from typing_extensions import Annotated

from diff_encoder_sim.base import bounds
from diff_encoder_sim.base.bounds import Between, Place_m
from diff_encoder_sim.base.params import Params, not_allowed, param
from diff_encoder_sim.robots.simulated_robot import GeometryErrors, TrueWheels
from diff_encoder_sim.simulation.state import TICK_S

GeometryError = Annotated[float, Between(-0.5, 0.5)]
Spread = Annotated[float, Between(0.0, 0.1)]
MOST_CONSTANT_SLIP = 0.999
Slip = Annotated[float, Between(0.0, MOST_CONSTANT_SLIP)]
SlipPerAcceleration = Annotated[float, Between(-1.0, 1.0, '1/(m/s^2)')]
TravelError_m = Annotated[float, Between(0.0, 10.0, 'm')]

# Without any of these errors the simulated wheels lose grip in curves, and some travel where they brake. As odometry's
# `curve_noise` and `distance_std`, by its error in the paper's tests (docs/adr/0031-covariance-follows-robot.md).
CONTACT_CURVE_NOISE = 1e-6  # [m^2/m per (m/s^2)^2]
CONTACT_DISTANCE_STD = 4e-6

SPIN_TICKS = 20  # duration of a spin: 0.2 s
MOST_SLIP = 0.9  # of the rolled distance, by motion


class WheelSlipParams(Params):
    """Slip by motion, wheel spin and bumps; none by default. All but bumps is proportional to 1/mu of the floor."""

    acceleration: SlipPerAcceleration = param(
        0.0,
        'fraction of the rolled distance that a wheel turns further per longitudinal acceleration, less while it '
        'brakes [1/(m/s^2)]',
    )
    lateral_acceleration: SlipPerAcceleration = param(
        0.0,
        'likewise of the outer wheel, and less of the inner one, per lateral acceleration v omega of the axle '
        '[1/(m/s^2)]; negative if the centre of mass is behind the axle',
    )
    spin_travel: TravelError_m = param(
        0.0, 'mean travel that a wheel spins at a start from rest, within 0.2 s, exponentially distributed [m]; 0: none'
    )
    spin_above: Annotated[float, Between(0.0, 1e4, 'm/s^2')] = param(
        0.0, 'acceleration of a wheel above which it spins, times mu of the floor [m/s^2]'
    )
    bump_travel: TravelError_m = param(0.0, "standard deviation of a wheel's travel error at a bump [m]; 0: none")
    bump_distance: Annotated[float, Between(1e-3, 1e6, 'm')] = param(
        1.0, 'mean distance of a wheel between two bumps, exponentially distributed [m]'
    )

    @property
    def by_motion(self) -> Tuple[float, float]:
        """Return the slip per longitudinal and per lateral acceleration [1/(m/s^2)]."""
        return self.acceleration, self.lateral_acceleration


class WheelErrorParams(Params):
    """Errors of the true robot against the nominal one; left out, there are none."""

    left_radius_error: GeometryError = param(0.0, 'true against nominal radius, relative')
    right_radius_error: GeometryError = param(0.0, 'true against nominal radius, relative')
    wheel_separation_error: GeometryError = param(0.0, 'true against nominal separation, relative')
    radius_spread: Spread = param(
        0.0, "standard deviation of each wheel's radius from robot to robot, relative; drawn by the seed"
    )
    wheel_separation_spread: Spread = param(0.0, 'likewise of the separation')
    left_slip: Slip = param(0.0, 'fraction of the rolled distance that is lost')
    right_slip: Slip = param(0.0, 'fraction of the rolled distance that is lost')
    slip_noise: bounds.TravelVariance_m = param(0.0, "variance of a wheel's lost travel per metre of it [m^2/m]")
    slip: WheelSlipParams = param(WheelSlipParams(), 'slip by motion, wheel spin and bumps')

    def geometry(self, rng: np.random.Generator) -> GeometryErrors:
        """Draw the errors that make another robot, as those of slip do not."""
        means = self.left_radius_error, self.right_radius_error, self.wheel_separation_error
        spreads = self.radius_spread, self.radius_spread, self.wheel_separation_spread
        drawn = (
            (1.0 + mean) * (1.0 + spread * normal) - 1.0 if spread else mean
            for mean, spread, normal in zip(means, spreads, rng.standard_normal(3).tolist())
        )
        return GeometryErrors(*drawn)

    @property
    def travel_variance(self) -> float:
        """Return the variance of a wheel's travel by noise and bumps, per metre of it [m^2/m]."""
        return self.slip_noise + self.slip.bump_travel**2 / self.slip.bump_distance


class FloorArea(Params):
    """A rectangle of the floor with its own friction."""

    x_min: Place_m = param(..., 'in the map frame [m]')
    x_max: Place_m = param(..., '[m]')
    y_min: Place_m = param(..., '[m]')
    y_max: Place_m = param(..., '[m]')
    mu: bounds.Friction = param(
        ..., "friction coefficient, which replaces that of the world's floor; all slip is proportional to 1 / mu"
    )

    @model_validator(mode='after')
    def _check_order(self) -> FloorArea:
        for low, high in (('x_min', 'x_max'), ('y_min', 'y_max')):
            if getattr(self, low) > getattr(self, high):
                raise not_allowed(high, getattr(self, high), f'at least {low}, {getattr(self, low)}')
        return self

    def contains(self, x_m: float, y_m: float) -> bool:
        """Return whether a point of the map is in the rectangle."""
        return self.x_min <= x_m <= self.x_max and self.y_min <= y_m <= self.y_max


class Floor(NamedTuple):
    """Friction of the floor: of the world, and of areas; where areas overlap, the last one counts."""

    mu: float = 1.0
    areas: Sequence[FloorArea] = ()

    def slip_factor(self, x_m: float, y_m: float) -> float:
        """Return the factor on all slip at a point of the map; 1 at SDF's default friction."""
        return 1.0 / next((area.mu for area in reversed(self.areas) if area.contains(x_m, y_m)), self.mu)


def slips_by_motion(
    by_motion: Tuple[float, float], speeds_mps: Any, accelerations_mps2: Any, separation_m: float
) -> Tuple[Any, Any]:
    """Return the forward travel of the left and the right wheel beyond their rolling, per distance rolled.

    `by_motion` is `WheelSlipParams.by_motion`; speeds and accelerations are pairs, left and right, of numbers or
    arrays. A tyre slips in proportion to its longitudinal force (Pacejka, Tire and Vehicle Dynamics, 2012, section
    1.2.1). The forces of both wheels accelerate the mass m, and in a curve they balance the moment m c v omega of the
    lateral force at the axle, if the centre of mass is c ahead of it: m c v omega / L on the outer wheel, and the
    opposite on the inner one. So `lateral_acceleration` of a robot is its `acceleration` times 2 c / L.
    """
    by_acceleration, by_lateral_acceleration = by_motion
    left_mps, right_mps = speeds_mps
    by_curve = by_lateral_acceleration * (right_mps**2 - left_mps**2) / (2.0 * separation_m)  # v omega
    left_mps2, right_mps2 = accelerations_mps2
    return by_acceleration * left_mps2 - by_curve, by_acceleration * right_mps2 + by_curve


def extra_travel(
    by_motion: Tuple[float, float], times_s: np.ndarray, travels_m: np.ndarray, separation_m: float
) -> np.ndarray:
    """Return the mean forward travel of wheels beyond their rolling, since the start of a drive [m].

    On a floor with SDF's default friction.

    Args:
        by_motion: as `WheelSlipParams.by_motion`.
        times_s: (n,) ascending.
        travels_m: (..., n, 2) rolled by the left and the right wheel.
        separation_m: between the wheels.

    Returns:
        (..., n, 2) distances of left and right.
    """
    extra_m = np.zeros_like(travels_m)
    if not any(by_motion) or len(times_s) < 3:
        return extra_m
    steps_m, intervals_s = np.diff(travels_m, axis=-2), np.diff(times_s)
    speeds_mps = steps_m / intervals_s[:, np.newaxis]
    # By central differences the slip of a drive from rest to rest by acceleration adds up to 0, as that of the motion.
    middles_s = times_s[:-1] + 0.5 * intervals_s
    accelerations_mps2 = np.gradient(speeds_mps, middles_s, axis=-2)
    speeds_of, accelerations_of = (np.moveaxis(each, -1, 0) for each in (speeds_mps, accelerations_mps2))
    slips = np.stack(slips_by_motion(by_motion, speeds_of, accelerations_of, separation_m), axis=-1)
    np.cumsum(slips * abs(steps_m), axis=-2, out=extra_m[..., 1:, :])
    return extra_m


class _SlippingWheel:
    """One wheel of `SlippingWheels`."""

    def __init__(self, errors: WheelErrorParams, slip: float, radius_m: float, events: np.random.Generator) -> None:
        self._params, self._slip, self._rolled_fraction, self.radius_m = errors.slip, slip, 1.0 - slip, radius_m
        self._noise_rad_per_sqrt_rad = math.sqrt(errors.slip_noise / radius_m)
        self._rolled_rad = self._extra_rad = self._events_radps = 0.0
        self.commanded_mps = 0.0
        # In this tick: slip by motion, change of the constant slip by the floor, and the floor's factor.
        self._by_motion, self._by_floor, self._factor = 0.0, 0.0, 1.0
        self._events, self._to_bump_m = events, events.exponential(errors.slip.bump_distance)
        self._spin_m, self._spin_ticks = 0.0, 0  # in each of the remaining ticks

    def command(self, turning_radps: float, acceleration_mps2: float, by_motion: float, factor: float) -> float:
        """Return the rolling speed of the next tick, without noise, spin and bumps."""
        params, fraction = self._params, self._rolled_fraction
        if params.spin_travel and self.commanded_mps == 0.0 and abs(acceleration_mps2) * factor > params.spin_above:
            travel_m = factor * self._events.exponential(params.spin_travel)
            self._spin_m, self._spin_ticks = math.copysign(travel_m / SPIN_TICKS, acceleration_mps2), SPIN_TICKS
        self.commanded_mps, self._factor = turning_radps * self.radius_m, factor
        self._by_motion = max(-MOST_SLIP, min(factor * by_motion, MOST_SLIP))
        on_floor = min(factor * self._slip, MOST_CONSTANT_SLIP)
        self._by_floor = 1.0 / (1.0 - on_floor) - 1.0 / fraction if factor != 1.0 else 0.0
        more = self._by_floor + math.copysign(1.0, turning_radps) * self._by_motion
        return turning_radps * fraction / (1.0 + fraction * more)

    def turned(self, rolled_rad: float, normal: float) -> float:
        """Return the angle turned since the start after a tick; `normal` is the sample of the noise."""
        step_rad, self._rolled_rad = rolled_rad - self._rolled_rad, rolled_rad
        noise_rad = self._noise_rad_per_sqrt_rad * math.sqrt(abs(step_rad)) * normal
        events_rad = self._events_m(abs(step_rad) * self.radius_m) / self.radius_m
        self._extra_rad += self._factor * noise_rad + self._more(step_rad) + events_rad
        self._events_radps = events_rad / TICK_S
        return rolled_rad / self._rolled_fraction + self._extra_rad

    def turning_speed(self, rolled_radps: float) -> float:
        """Return the speed [rad/s] in the tick of `turned`, without noise."""
        return rolled_radps / self._rolled_fraction + self._more(rolled_radps) + self._events_radps

    def _more(self, rolled: float) -> float:
        """Return the rotation beyond constant slip by motion and floor."""
        return self._by_motion * abs(rolled) + self._by_floor * rolled

    def _events_m(self, rolled_m: float) -> float:
        """Return the travel by spin and bumps in a tick."""
        travel_m, params = 0.0, self._params
        if self._spin_ticks:
            travel_m, self._spin_ticks = self._spin_m, self._spin_ticks - 1
        self._to_bump_m -= rolled_m
        while params.bump_travel and self._to_bump_m < 0.0:
            travel_m += params.bump_travel * self._events.standard_normal()
            self._to_bump_m += self._events.exponential(params.bump_distance)
        return travel_m


class SlippingWheels:
    """Turns the rolling of ideal wheels into the turning of wheels that slip.

    A wheel with slip s that turns by a rolls by a (1 - s) only, so the angle that its encoder measures is the rolled
    one divided by 1 - s. Noise is added as a random walk over the distance rolled: the k|ds| of Siegwart and
    Nourbakhsh, section 5.2.4. Slip by motion follows the commanded speeds, as measured ones would feed it back.
    """

    def __init__(
        self, params: WheelErrorParams, wheels: TrueWheels, rng: np.random.Generator, events: np.random.Generator
    ) -> None:
        sides = (params.left_slip, wheels.left_radius_m), (params.right_slip, wheels.right_radius_m)
        self._wheels = [_SlippingWheel(params, *side, events) for side in sides]
        self._by_motion, self._separation_m, self._rng = params.slip.by_motion, wheels.separation_m, rng
        self._is_ideal = (
            params.slip_noise == params.left_slip == params.right_slip == 0 and params.slip == WheelSlipParams()
        )

    def rolling_speeds(
        self, left_radps: float, right_radps: float, slip_factors: Tuple[float, float] = (1.0, 1.0)
    ) -> Tuple[float, float]:
        """Return the ideal wheels' speeds [rad/s] that move the robot as these wheels' speeds do in the next tick.

        `slip_factors` are those of the floor below the wheels.
        """
        turning_radps = left_radps, right_radps
        if self._is_ideal:
            return turning_radps
        speeds_mps = [speed * wheel.radius_m for wheel, speed in zip(self._wheels, turning_radps)]
        accelerations_mps2 = [(speed - wheel.commanded_mps) / TICK_S for wheel, speed in zip(self._wheels, speeds_mps)]
        slips = slips_by_motion(self._by_motion, speeds_mps, accelerations_mps2, self._separation_m)
        each = zip(self._wheels, turning_radps, accelerations_mps2, slips, slip_factors)
        left, right = (wheel.command(*motion) for wheel, *motion in each)
        return left, right

    def turning_speeds(self, left_radps: float, right_radps: float) -> Tuple[float, float]:
        """Return these wheels' speeds [rad/s] when the ideal ones roll so: the mean, without noise."""
        left, right = self._wheels
        return left.turning_speed(left_radps), right.turning_speed(right_radps)

    def turned(self, rolled_rad: Tuple[float, float]) -> Tuple[float, float]:
        """Return the angles turned [rad] since the start when the ideal wheels rolled `rolled_rad`."""
        if self._is_ideal:
            return rolled_rad
        left, right = map(_SlippingWheel.turned, self._wheels, rolled_rad, self._rng.standard_normal(2).tolist())
        return left, right
