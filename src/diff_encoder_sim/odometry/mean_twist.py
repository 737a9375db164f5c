"""The mean twist between two reports of the wheels, and its covariance."""

from __future__ import annotations

import functools
from typing import NamedTuple, Tuple

import numpy as np


class MeanTwist(NamedTuple):
    """A twist over some interval, in base_link."""

    linear_mps: float  # along x, signed
    angular_radps: float  # counter-clockwise
    covariance: np.ndarray  # 2x2 over (linear [m/s], angular [rad/s])


def mean_twist(
    pulses: Tuple[int, int],
    m_per_pulse: Tuple[float, float],
    reading_vars_m2: Tuple[float, float],
    interval_s: float,
    wheel_separation_m: float,
    motion_noise: float,
) -> MeanTwist:
    """Return the twist that moves the wheels by whole pulses, left and right; zero over no time.

    A difference of two readings has two independent rounding errors.

    Args:
        pulses: left and right, within the interval.
        m_per_pulse: travel of each wheel per pulse.
        reading_vars_m2: variance of each wheel's travel in one reading.
        interval_s: between the readings.
        wheel_separation_m: between the contact points.
        motion_noise: variance of a wheel's travel per metre of it [m^2/m].
    """
    if interval_s == 0.0:
        return MeanTwist(0.0, 0.0, np.zeros((2, 2)))
    travels_m = (pulses[0] * m_per_pulse[0], pulses[1] * m_per_pulse[1])
    jacobian = _twist_by_travel(wheel_separation_m, interval_s)
    linear_mps, angular_radps = (jacobian @ travels_m).tolist()
    travel_variances = [
        2.0 * reading_var_m2 + motion_noise * abs(travel_m)
        for reading_var_m2, travel_m in zip(reading_vars_m2, travels_m)
    ]
    return MeanTwist(linear_mps, angular_radps, (jacobian * travel_variances) @ jacobian.T)


# Reports come at one rate, so hardly ever another interval.
@functools.lru_cache(maxsize=16)
def _twist_by_travel(wheel_separation_m: float, interval_s: float) -> np.ndarray:
    """Return a read-only 2x2 matrix: what a metre of the left and of the right wheel adds to the twist."""
    jacobian = np.array([[0.5, 0.5], [-1.0, 1.0]])
    jacobian[1] /= wheel_separation_m
    jacobian /= interval_s
    jacobian.setflags(write=False)
    return jacobian


def wheel_speeds_mps(linear_mps: float, angular_radps: float, wheel_separation_m: float) -> Tuple[float, float]:
    """Return the speeds of the left and right wheel in a twist of base_link, the axle's middle."""
    half_mps = 0.5 * wheel_separation_m * angular_radps
    return linear_mps - half_mps, linear_mps + half_mps
