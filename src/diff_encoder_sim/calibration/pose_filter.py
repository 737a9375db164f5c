"""The likelihood of reference poses: a Kalman filter over windows of the reference, as a kernel.

The state is the pose of the axle's centre in the frame of the reference, and the slowly varying error of the
reference. Wheels that slip make the pose a random walk (Siegwart and Nourbakhsh, section 5.2.4); the reference has an
error that decays with a time constant (Gauss-Markov), as maps, markers and smoothing filters make it, and white noise.

A window is corrected by the mean error of its rows. The pose walks on within a window, too: its rows are in parts, and
the covariance has the sum of the errors of the parts so far as three further states.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np

from diff_encoder_sim.base.kernels import Array, compiled

ROBUST_BEYOND_STD = 4.0  # larger errors count linearly (Huber), so that outliers move little

START_STD = 1.0  # of x and y [m]
START_YAW_STD = 0.05  # [rad]; the filter is linear in the heading, which holds for small errors only

# States: x, y, yaw; the slow error in three whitened components; the sum of errors in three whitened components.
POSE, SLOW, SUM, STATES = 0, 3, 6, 9


@compiled(nogil=True)
def filter_poses(
    motions: np.ndarray,
    row_motions: np.ndarray,
    times_s: np.ndarray,
    first_rows: np.ndarray,
    first_parts: np.ndarray,
    poses: np.ndarray,
    weights: np.ndarray,
    has_yaw: bool,
    start_yaw_rad: float,
    is_used: np.ndarray,
    values: np.ndarray,
    quantisation: np.ndarray,
    errors: np.ndarray,
    variances: np.ndarray,
) -> Tuple[np.ndarray, np.ndarray]:
    """Write the prediction errors of all windows of the reference, and return the last state and its covariance.

    Args:
        motions: (p, 6) of the odometry at the middle of each part: x [m], y [m], yaw [rad], path of the left and the
            right wheel [m], and angle turned [rad], all from the start of the drive.
        row_motions: (k, 3) x, y and yaw at each row of the reference.
        times_s: (p,) middles of the parts.
        first_rows: (p + 1,) first row of each part, and the number of rows.
        first_parts: (m + 1,) first part of each window, and the number of parts.
        poses: (k, 3) of the sensor: x [m], y [m], yaw [rad].
        weights: (k, 3, 3) of the errors of a row in the whitened mean of its window; without yaw, 2x2 of them.
        has_yaw: False if only x and y are known.
        start_yaw_rad: heading of the robot at the start of the drive.
        is_used: (m,) bool; other windows do not correct the pose, but have their errors.
        values: separation [m], x, y [m] and yaw [rad] of the sensor on the robot, slip [m^2/m] and [rad^2/rad],
            variance of the white noise of position and yaw of a row, of the slow error of position and yaw (both in
            units of the stated covariance), and its time constant [s].
        quantisation: variances of the position along the heading [m^2] and of the heading [rad^2].
        errors: (m, 3) written; whitened, each independent of the ones before it.
        variances: (m, 3) written.
    """
    state, cov = np.zeros(SUM), np.zeros((STATES, STATES))
    sums, slopes, of_part = np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3))
    _start(state, cov, motions[0], row_motions[0], poses[0], start_yaw_rad, values)
    for window in range(len(is_used)):
        sums[:] = 0.0
        slopes[:] = 0.0
        cov[SUM:] = 0.0
        cov[:, SUM:] = 0.0
        for part in range(first_parts[window], first_parts[window + 1]):
            if part > 0:
                _move(state, cov, motions[part - 1], motions[part], values[0], values[4], values[5])
                _decay(state, cov, math.exp((times_s[part - 1] - times_s[part]) / values[10]), values[8], values[9])
            of_part[:] = 0.0
            for row in range(first_rows[part], first_rows[part + 1]):
                _add_row(
                    state, motions[part], row_motions[row], poses[row], weights[row], has_yaw, values, sums, of_part
                )
            _add_errors(cov, of_part)
            slopes += of_part
        rows = first_rows[first_parts[window + 1]] - first_rows[first_parts[window]]
        of_rows = (values[6] / rows, values[7] / rows)
        of_window = (sums, slopes, has_yaw, of_rows, quantisation, errors[window], variances[window])
        if is_used[window]:
            _correct(state, cov, *of_window)
        else:
            _correct(state.copy(), cov.copy(), *of_window)
    return state, cov


@compiled(nogil=True)
def _start(
    state: Array, cov: Array, motion: Array, row_motion: Array, pose: Array, start_yaw_rad: float, values: Array
) -> None:
    """Start at the first pose of the reference, as the first part's middle sees it."""
    yaw = start_yaw_rad + row_motion[2]
    turn = yaw - row_motion[2]
    dx, dy = motion[0] - row_motion[0], motion[1] - row_motion[1]
    state[0] = (
        pose[0] - math.cos(yaw) * values[1] + math.sin(yaw) * values[2] + math.cos(turn) * dx - math.sin(turn) * dy
    )
    state[1] = (
        pose[1] - math.sin(yaw) * values[1] - math.cos(yaw) * values[2] + math.sin(turn) * dx + math.cos(turn) * dy
    )
    state[2] = turn + motion[2]
    cov[0, 0] = cov[1, 1] = START_STD**2
    cov[2, 2] = START_YAW_STD**2
    cov[3, 3] = cov[4, 4] = values[8]
    cov[5, 5] = values[9]


@compiled(nogil=True)
def _move(
    state: Array, cov: Array, before: Array, after: Array, separation_m: float, slip: float, turn_slip: float
) -> None:
    """Move the pose by the wheels from one motion to another, with the noise of slip."""
    turn = state[2] - before[2]
    cos_turn, sin_turn = math.cos(turn), math.sin(turn)
    dx, dy, turned_rad = after[0] - before[0], after[1] - before[1], after[2] - before[2]
    # The mean of the cosine of a heading that is normal: a heading that is not known well leads less far.
    kept = math.exp(-0.5 * cov[2, 2])
    east_m, north_m = kept * (cos_turn * dx - sin_turn * dy), kept * (sin_turn * dx + cos_turn * dy)
    middle_rad = state[2] + 0.5 * turned_rad
    state[0] += east_m
    state[1] += north_m
    state[2] += turned_rad
    for other in range(STATES):
        cov[0, other] -= north_m * cov[2, other]
        cov[1, other] += east_m * cov[2, other]
    for other in range(STATES):
        cov[other, 0] -= north_m * cov[other, 2]
        cov[other, 1] += east_m * cov[other, 2]
    left_m, right_m = after[3] - before[3], after[4] - before[4]
    along = slip * (left_m + right_m) * 0.25
    heading = slip * (left_m + right_m) / separation_m**2 + turn_slip * (after[5] - before[5])
    both = 0.5 * slip * (right_m - left_m) / separation_m
    cos_yaw, sin_yaw = math.cos(middle_rad), math.sin(middle_rad)
    # A heading error arises half-way, on average: it shifts the end by half the chord.
    x_per_rad, y_per_rad = -0.5 * north_m, 0.5 * east_m
    of_xy = along * cos_yaw * sin_yaw + heading * x_per_rad * y_per_rad
    of_xy += both * (cos_yaw * y_per_rad + sin_yaw * x_per_rad)
    of_x_yaw, of_y_yaw = both * cos_yaw + heading * x_per_rad, both * sin_yaw + heading * y_per_rad
    cov[0, 0] += along * cos_yaw**2 + heading * x_per_rad**2 + 2.0 * both * cos_yaw * x_per_rad
    cov[1, 1] += along * sin_yaw**2 + heading * y_per_rad**2 + 2.0 * both * sin_yaw * y_per_rad
    cov[2, 2] += heading
    cov[0, 1] += of_xy
    cov[1, 0] += of_xy
    cov[0, 2] += of_x_yaw
    cov[2, 0] += of_x_yaw
    cov[1, 2] += of_y_yaw
    cov[2, 1] += of_y_yaw


@compiled(nogil=True)
def _decay(state: Array, cov: Array, kept: float, slow: float, slow_yaw: float) -> None:
    """Let the slow error of the reference decay to a fraction, and renew it."""
    for axis in range(SLOW, SUM):
        state[axis] *= kept
        for other in range(STATES):
            cov[axis, other] *= kept
        for other in range(STATES):
            cov[other, axis] *= kept
        cov[axis, axis] += (slow_yaw if axis == 5 else slow) * (1.0 - kept**2)


@compiled(nogil=True)
def _add_row(
    state: Array,
    motion: Array,
    row_motion: Array,
    pose: Array,
    weight: Array,
    has_yaw: bool,
    values: Array,
    sums: Array,
    slopes: Array,
) -> None:
    """Add the error of a row to the sums of its window, with its slopes by x, y and yaw of the robot."""
    turn, yaw = state[2] - motion[2], state[2] + row_motion[2] - motion[2]
    dx, dy = row_motion[0] - motion[0], row_motion[1] - motion[1]
    cos_turn, sin_turn, cos_yaw, sin_yaw = math.cos(turn), math.sin(turn), math.cos(yaw), math.sin(yaw)
    # From the robot in the middle of the part to the sensor at this row.
    east_m = cos_turn * dx - sin_turn * dy + cos_yaw * values[1] - sin_yaw * values[2]
    north_m = sin_turn * dx + cos_turn * dy + sin_yaw * values[1] + cos_yaw * values[2]
    off_x, off_y, off_yaw = pose[0] - state[0] - east_m, pose[1] - state[1] - north_m, 0.0
    if has_yaw:
        off_yaw = (pose[2] - yaw - values[3] + math.pi) % (2.0 * math.pi) - math.pi
    for axis in range(3 if has_yaw else 2):
        by_x, by_y, by_yaw = weight[axis, 0], weight[axis, 1], weight[axis, 2] if has_yaw else 0.0
        sums[axis] += by_x * off_x + by_y * off_y + by_yaw * off_yaw
        by_heading = by_yaw - by_x * north_m + by_y * east_m
        slopes[axis, 0] += by_x
        slopes[axis, 1] += by_y
        slopes[axis, 2] += by_heading


@compiled(nogil=True)
def _add_errors(cov: Array, slopes: Array) -> None:
    """Add the errors of a part to the sums of its window."""
    for axis in range(3):
        by_x, by_y, by_heading = slopes[axis, 0], slopes[axis, 1], slopes[axis, 2]
        for other in range(STATES):
            cov[SUM + axis, other] += by_x * cov[0, other] + by_y * cov[1, other] + by_heading * cov[2, other]
        for other in range(STATES):
            cov[other, SUM + axis] += by_x * cov[other, 0] + by_y * cov[other, 1] + by_heading * cov[other, 2]


@compiled(nogil=True)
def _correct(
    state: Array,
    cov: Array,
    sums: Array,
    slopes: Array,
    has_yaw: bool,
    of_rows: Tuple[float, float],
    quantisation: Array,
    errors: Array,
    variances: Array,
) -> None:
    """Correct the state by the mean of a window, one component after the other."""
    gained, total = np.empty(STATES), np.zeros(3)
    cos_yaw, sin_yaw = math.cos(state[2]), math.sin(state[2])
    for axis in range(3 if has_yaw else 2):
        error = sums[axis] - total[axis] - state[SLOW + axis]
        for other in range(STATES):
            gained[other] = cov[other, SUM + axis] + cov[other, SLOW + axis]
        variance = gained[SUM + axis] + gained[SLOW + axis] + of_rows[1 if axis == 2 else 0]
        variance += quantisation[0] * (slopes[axis, 0] * cos_yaw + slopes[axis, 1] * sin_yaw) ** 2
        variance += quantisation[1] * slopes[axis, 2] ** 2
        variance *= max(1.0, abs(error) / (ROBUST_BEYOND_STD * math.sqrt(variance)))
        errors[axis], variances[axis] = error, variance
        for other in range(SUM):
            state[other] += gained[other] * error / variance
        for other in range(3):
            total[other] += gained[SUM + other] * error / variance
        for row in range(STATES):
            for column in range(STATES):
                cov[row, column] -= gained[row] * gained[column] / variance
