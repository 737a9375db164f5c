"""Scoring of trajectories by dwa_local_planner's critics, all samples in one kernel.

Fox, Burgard and Thrun 1997, section III-B, with the critics that upstream made of it. Each critic
gives a trajectory a cost, the sum decides, and one below zero rejects:

| column | critic | cost | below zero |
|---|---|---|---|
| 0 | oscillation | 0 | -5: against the direction it is bound to |
| 1 | obstacle | highest cost under outline and centre | -6 in collision, -7 off the map |
| 2 | goal front | cells from the nose to the goal ahead of the plan | -4 off the map |
| 3 | alignment | cells from the nose to the plan | -4 off the map |
| 4 | path | cells from the centre to the plan | -2 no way, -3 blocked, -4 off the map |
| 5 | goal | cells from the centre to the plan's end in sight | as path |
| 6 | twirling | turning speed [rad/s] | |

Distances are those of the trajectory's last point; every point is checked.
"""
from __future__ import annotations

import math

import numpy as np
from numba import njit

from diff_encoder_sim.navigation.footprint import outline_cost

OSCILLATION, OBSTACLE, GOAL_FRONT, ALIGNMENT, PATH, GOAL, TWIRLING = range(7)
CRITICS = 7

NO_TRAJECTORY, UNREACHABLE, BLOCKED, OFF_MAP = -1.0, -2.0, -3.0, -4.0
OSCILLATES, COLLIDES, CENTRE_OFF_MAP = -5.0, -6.0, -7.0


@njit(cache=True)
def step_count(linear_mps: float, angular_radps: float, sim_time_s: float, granularity_m: float,
               angular_granularity_rad: float) -> int:
    """Points of a trajectory, none farther apart than the granularities."""
    return math.ceil(max(abs(linear_mps) * sim_time_s / granularity_m,
                         abs(angular_radps) * sim_time_s / angular_granularity_rad))


@njit(cache=True)
def approach(value: float, target: float, largest_step: float) -> float:
    """`value` moved towards `target` by no more than a step."""
    if value < target:
        return min(target, value + largest_step)
    return max(target, value - largest_step)


@njit(cache=True)
def roll_out(pose: np.ndarray, twist: np.ndarray, sample: np.ndarray, steps: int,
             sim_time_s: float, accelerations: np.ndarray, accelerates: bool,
             points: np.ndarray) -> None:
    """Fill `points` (steps, 3) x, y, yaw: from the start pose, the end of the last step left out.

    Args:
        pose: (3,) x, y [m], yaw [rad]; twist, sample: (2,) [m/s], [rad/s].
        accelerations: (2,) limits [m/s^2], [rad/s^2].
        accelerates: go from the twist to the sample at the limits, instead of at once.
    """
    interval_s = sim_time_s / steps
    x_m, y_m, yaw_rad = pose[0], pose[1], pose[2]
    linear_mps, angular_radps = sample[0], sample[1]
    if accelerates:
        linear_mps, angular_radps = twist[0], twist[1]
    for step in range(steps):
        points[step, 0], points[step, 1], points[step, 2] = x_m, y_m, yaw_rad
        if accelerates:
            linear_mps = approach(linear_mps, sample[0], accelerations[0] * interval_s)
            angular_radps = approach(angular_radps, sample[1], accelerations[1] * interval_s)
        x_m += linear_mps * math.cos(yaw_rad) * interval_s
        y_m += linear_mps * math.sin(yaw_rad) * interval_s
        yaw_rad += angular_radps * interval_s


@njit(cache=True)
def score_points(costs: np.ndarray, per_m: float, vertices_m: np.ndarray, points: np.ndarray,
                 path_distance: np.ndarray, goal_distance: np.ndarray,
                 front_distance: np.ndarray, nose_m: float, scales: np.ndarray,
                 sums_obstacle: bool, scores: np.ndarray) -> None:
    """Fill `scores` (7,) with what the critics of places say of a trajectory's points.

    Stops at the first critic below zero. All coordinates in the grid's own frame.
    """
    rows, columns = costs.shape
    blocked = rows * columns
    for index in range(len(points)):
        x_m, y_m = points[index, 0], points[index, 1]
        cos_yaw, sin_yaw = math.cos(points[index, 2]), math.sin(points[index, 2])
        row, column = math.floor(y_m * per_m), math.floor(x_m * per_m)
        if not (0 <= row < rows and 0 <= column < columns):
            scores[OBSTACLE] = CENTRE_OFF_MAP
            return
        if scales[OBSTACLE] != 0.0:
            cost = outline_cost(costs, per_m, vertices_m, x_m, y_m, cos_yaw, sin_yaw)
            if cost < 0.0:
                scores[OBSTACLE] = COLLIDES
                return
            cost = max(cost, float(costs[row, column]))
            scores[OBSTACLE] = scores[OBSTACLE] + cost if sums_obstacle \
                else max(scores[OBSTACLE], cost)
        for critic, distance in ((PATH, path_distance), (GOAL, goal_distance)):
            if scales[critic] != 0.0:
                cells = distance[row, column]
                if cells >= blocked:
                    scores[critic] = BLOCKED if cells == blocked else UNREACHABLE
                    return
                scores[critic] = cells
        if scales[GOAL_FRONT] != 0.0 or scales[ALIGNMENT] != 0.0:
            row = math.floor((y_m + nose_m * sin_yaw) * per_m)
            column = math.floor((x_m + nose_m * cos_yaw) * per_m)
            is_inside = 0 <= row < rows and 0 <= column < columns
            # The nose may look into obstacles: it costs, but does not reject.
            for critic, distance in ((GOAL_FRONT, front_distance), (ALIGNMENT, path_distance)):
                if scales[critic] != 0.0:
                    if not is_inside:
                        scores[critic] = OFF_MAP
                        return
                    scores[critic] = distance[row, column]


@njit(cache=True)
def score_samples(costs: np.ndarray, per_m: float, vertices_m: np.ndarray, pose: np.ndarray,
                  twist: np.ndarray, samples: np.ndarray, limits: np.ndarray,
                  simulation: np.ndarray, accelerates: bool, path_distance: np.ndarray,
                  goal_distance: np.ndarray, front_distance: np.ndarray, nose_m: float,
                  scales: np.ndarray, sums_obstacle: bool, allowed: np.ndarray,
                  scores: np.ndarray, totals: np.ndarray) -> int:
    """Score every sample; returns the index of the cheapest, the first of equals, -1 for none.

    Args:
        samples: (n, 2) linear [m/s], angular [rad/s].
        limits: (5,) min and max translation [m/s], min turn [rad/s], accelerations.
        simulation: (3,) time [s], granularity [m], angular granularity [rad].
        allowed: (4,) bool, whether forward, backward, left and right are.
        scores: (n, 7), filled with the critics' costs, unscaled; totals: (n,), with the sums.
    """
    best = -1
    most = 0
    for index in range(len(samples)):
        most = max(most, step_count(samples[index, 0], samples[index, 1], simulation[0],
                                    simulation[1], simulation[2]))
    points = np.empty((most, 3))
    for index in range(len(samples)):
        linear_mps, angular_radps = samples[index]
        scores[index, :] = 0.0
        scores[index, TWIRLING] = abs(angular_radps)
        totals[index] = NO_TRAJECTORY
        steps = step_count(linear_mps, angular_radps, simulation[0], simulation[1], simulation[2])
        too_slow = abs(linear_mps) + 1e-4 < limits[0] and abs(angular_radps) + 1e-4 < limits[2]
        if steps == 0 or too_slow or abs(linear_mps) - 1e-4 > limits[1]:
            continue
        if (linear_mps > 0 and not allowed[0]) or (linear_mps < 0 and not allowed[1]) \
                or (angular_radps > 0 and not allowed[2]) \
                or (angular_radps < 0 and not allowed[3]):
            scores[index, OSCILLATION] = OSCILLATES
            totals[index] = OSCILLATES
            continue
        roll_out(pose, twist, samples[index], steps, simulation[0], limits[3:5], accelerates,
                 points)
        score_points(costs, per_m, vertices_m, points[:steps], path_distance, goal_distance,
                     front_distance, nose_m, scales, sums_obstacle, scores[index])
        totals[index] = _total(scores[index], scales)
        if totals[index] >= 0.0 and (best < 0 or totals[index] < totals[best]):
            best = index
    return best


@njit(cache=True)
def _total(scores: np.ndarray, scales: np.ndarray) -> float:
    total = 0.0
    for critic in range(CRITICS):
        if scores[critic] < 0.0:
            return scores[critic]
        total += scales[critic] * scores[critic]
    return total
