"""Dynamic window: the velocities that the next control period can reach, and samples of it.

Fox, Burgard and Thrun, The dynamic window approach to collision avoidance, 1997, section III-A.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from diff_encoder_sim.base.compiled import compiled
from diff_encoder_sim.navigation.dwa_params import DwaParams


class DynamicWindow(NamedTuple):
    """Lowest and highest reachable velocities."""

    min_linear_mps: float
    max_linear_mps: float
    min_angular_radps: float
    max_angular_radps: float


def dynamic_window(
    params: DwaParams, linear_mps: float, angular_radps: float, sim_period_s: float, goal_distance_m: float
) -> DynamicWindow:
    """Return the velocities that acceleration and velocity limits allow around a twist.

    With use_dwa those of one control period; without it those of sim_time, no faster than would overshoot the goal.
    A quantised twist can be above the limits (at 40 PPR the second step is 0.63 m/s): then the window is the limit
    alone, where upstream would sample from the limit up to what it takes for reachable.
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


@compiled
def samples_between(low: float, high: float, count: int) -> np.ndarray:
    """Return evenly spaced samples with both ends, and 0 where it lies between two of them.

    As upstream's VelocityIterator: at least two samples, unless the ends are equal.
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


def velocity_samples(window: DynamicWindow, linear_count: int, angular_count: int) -> np.ndarray:
    """Return samples (n, 2) linear [m/s], angular [rad/s] of a window, the angular ones innermost."""
    return _velocity_samples(*window, linear_count, angular_count)


@compiled
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
