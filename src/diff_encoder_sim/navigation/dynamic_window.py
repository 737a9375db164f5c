"""The dynamic window: which velocities the next control period can reach, and samples of it.

Fox, Burgard and Thrun, The dynamic window approach to collision avoidance, 1997, section III-A.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from diff_encoder_sim.navigation.dwa_params import DwaParams


class DynamicWindow(NamedTuple):
    """Reachable velocities, lowest and highest."""

    min_linear_mps: float
    max_linear_mps: float
    min_angular_radps: float
    max_angular_radps: float


def dynamic_window(
    params: DwaParams, linear_mps: float, angular_radps: float, sim_period_s: float, goal_distance_m: float
) -> DynamicWindow:
    """What the acceleration limits leave around a twist, within the velocity limits.

    With use_dwa, what one control period reaches. Without, what sim_time reaches, no faster than
    would overshoot the goal.

    A quantised twist can be above the limits (at 40 pulses 0.63 m/s is the second step): the window
    then is the limit alone. Upstream would sample from the limit up to what it believes reachable.
    """
    horizon_s, max_linear_mps = sim_period_s, params.max_vel_x
    if not params.use_dwa:
        horizon_s = params.sim_time
        max_linear_mps = max(min(max_linear_mps, goal_distance_m / horizon_s), params.min_vel_x)
    linear_change, angular_change = params.acc_lim_x * horizon_s, params.acc_lim_theta * horizon_s
    return DynamicWindow(
        _clamp(linear_mps - linear_change, params.min_vel_x, max_linear_mps),
        _clamp(linear_mps + linear_change, params.min_vel_x, max_linear_mps),
        _clamp(angular_radps - angular_change, -params.max_vel_theta, params.max_vel_theta),
        _clamp(angular_radps + angular_change, -params.max_vel_theta, params.max_vel_theta),
    )


def _clamp(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)


@njit(cache=True)
def samples_between(low: float, high: float, count: int) -> np.ndarray:
    """Evenly spaced samples with both ends, and 0 added where two of them have it between.

    As upstream's VelocityIterator: at least two, unless the ends are one.
    """
    if low == high:
        return np.array([low])
    count = max(2, count)
    step = (high - low) / (count - 1)
    samples, filled = np.empty(count + 1), 0
    for index in range(count - 1):
        value = low + index * step
        samples[filled] = value
        filled += 1
        if value < 0.0 < value + step:
            samples[filled] = 0.0
            filled += 1
    samples[filled] = high
    return samples[: filled + 1]


@njit(cache=True)
def _velocity_samples(
    min_linear_mps: float,
    max_linear_mps: float,
    min_angular_radps: float,
    max_angular_radps: float,
    linear_count: int,
    angular_count: int,
) -> np.ndarray:
    linear = samples_between(min_linear_mps, max_linear_mps, linear_count)
    angular = samples_between(min_angular_radps, max_angular_radps, angular_count)
    samples = np.empty((len(linear) * len(angular), 2))
    for index in range(len(samples)):
        samples[index, 0] = linear[index // len(angular)]
        samples[index, 1] = angular[index % len(angular)]
    return samples


def velocity_samples(window: DynamicWindow, linear_count: int, angular_count: int) -> np.ndarray:
    """(n, 2) samples (linear [m/s], angular [rad/s]) of a window, angular ones innermost."""
    return _velocity_samples(*window, linear_count, angular_count)
