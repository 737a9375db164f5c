"""Dynamic window: the velocities that the next control period can reach, and samples of it.

Fox, Burgard and Thrun, The dynamic window approach to collision avoidance, 1997, section III-A.
"""

from __future__ import annotations

from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.compiled import compiled
from diff_encoder_sim.navigation.dwa_params import DwaParams


class WindowParams(NamedTuple):
    """Limits of the dynamic window, and how it is sampled."""

    min_linear_mps: float
    max_linear_mps: float
    max_angular_radps: float
    linear_mps2: float
    angular_radps2: float
    horizon_s: float  # time in which a velocity must be reached
    spares_goal: bool  # no velocity passes the goal within the horizon
    linear_count: int
    angular_count: int


def window_params(params: DwaParams, sim_period_s: float) -> WindowParams:
    """Return the limits: with use_dwa for one control period; without it for sim_time."""
    return WindowParams(
        params.min_vel_x,
        params.max_vel_x,
        params.max_vel_theta,
        params.acc_lim_x,
        params.acc_lim_theta,
        sim_period_s if params.use_dwa else params.sim_time,
        not params.use_dwa,
        params.vx_samples,
        params.vth_samples,
    )


@compiled
def dynamic_window(
    params: WindowParams, linear_mps: float, angular_radps: float, goal_distance_m: float
) -> Tuple[float, float, float, float]:
    """Return the lowest and highest linear [m/s] and angular [rad/s] velocities that the limits allow around a twist.

    A quantised twist can be above the limits (at 40 PPR the second step is 0.63 m/s): then the window is the limit
    alone, where upstream would sample from the limit up to what it takes for reachable.
    """
    lowest_mps, highest_mps = params.min_linear_mps, params.max_linear_mps
    if params.spares_goal:
        highest_mps = max(min(highest_mps, goal_distance_m / params.horizon_s), lowest_mps)
    linear_change, angular_change = params.linear_mps2 * params.horizon_s, params.angular_radps2 * params.horizon_s
    return (
        min(max(linear_mps - linear_change, lowest_mps), highest_mps),
        min(max(linear_mps + linear_change, lowest_mps), highest_mps),
        min(max(angular_radps - angular_change, -params.max_angular_radps), params.max_angular_radps),
        min(max(angular_radps + angular_change, -params.max_angular_radps), params.max_angular_radps),
    )


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


@compiled
def velocity_samples(
    params: WindowParams, linear_mps: float, angular_radps: float, goal_distance_m: float
) -> np.ndarray:
    """Return samples (n, 2) linear [m/s], angular [rad/s] of the window around a twist, the angular ones innermost."""
    low_mps, high_mps, low_radps, high_radps = dynamic_window(params, linear_mps, angular_radps, goal_distance_m)
    linear = samples_between(low_mps, high_mps, params.linear_count)
    angular = samples_between(low_radps, high_radps, params.angular_count)
    samples = np.empty((len(linear) * len(angular), 2))
    for index in range(len(samples)):
        samples[index, 0] = linear[index // len(angular)]
        samples[index, 1] = angular[index % len(angular)]
    return samples
