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
    times_s: np.ndarray,
    first_parts: np.ndarray,
    rows: np.ndarray,
    weights: np.ndarray,
    yaw_weights: np.ndarray,
    motions: np.ndarray,
    positions: np.ndarray,
    places: np.ndarray,
    yaws: np.ndarray,
    start: np.ndarray,
    is_used: np.ndarray,
    values: np.ndarray,
    quantisation: np.ndarray,
    errors: np.ndarray,
    variances: np.ndarray,
) -> Tuple[np.ndarray, np.ndarray]:
    """Write the prediction errors of all windows of the reference, and return the last state and its covariance.

    Rows count only by sums over their part, of places as complex numbers x + iy times weights x - iy: the real part of
    a product is the scalar product.

    Args:
        times_s: (p,) middles of the parts.
        first_parts: (m + 1,) first part of each window, and the number of parts.
        rows: (m,) number of rows of each window.
        weights: (p, 3) sums of the weights of positions in the whitened mean of a window; (p, 2) without yaw.
        yaw_weights: (p, 3) sums of the weights of yaws; 0 without yaw.
        motions: (p, 6) of the odometry at the middle of each part: x [m], y [m], yaw [rad], path of the left and the
            right wheel [m], and angle turned [rad], all from the start of the drive.
        positions: (p, 3) weighted sums of the reference's positions, and of its yaws beyond `yaws`.
        places: (p, 3) weighted sums of the sensor's places from the robot in the middle of the part, by odometry.
        yaws: (p,) of the reference beyond odometry [rad], in the first row of the part.
        start: (3,) pose of the robot in the middle of the first part.
        is_used: (m,) bool; other windows do not correct the pose, but have their errors.
        values: separation [m], yaw of the sensor on the robot [rad], slip [m^2/m] and [rad^2/rad], variance of the
            white noise of position and yaw of a row, of the slow error of position and yaw (both in units of the
            stated covariance), and its time constant [s].
        quantisation: variances of the position along the heading [m^2] and of the heading [rad^2].
        errors: (m, 3) written; whitened, each independent of the ones before it.
        variances: (m, 3) written.
    """
    state, cov, axes = np.zeros(SUM), np.zeros((STATES, STATES)), weights.shape[1]
    sums, slopes, of_part = np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3))
    state[:SLOW] = start
    cov[0, 0] = cov[1, 1] = START_STD**2
    cov[2, 2] = START_YAW_STD**2
    cov[3, 3] = cov[4, 4] = values[6]
    cov[5, 5] = values[7]
    for window in range(len(is_used)):
        sums[:] = 0.0
        slopes[:] = 0.0
        cov[SUM:] = 0.0
        cov[:, SUM:] = 0.0
        for part in range(first_parts[window], first_parts[window + 1]):
            if part > 0:
                _move(state, cov, motions[part - 1], motions[part], values[0], values[2], values[3])
                _decay(state, cov, math.exp((times_s[part - 1] - times_s[part]) / values[8]), values[6], values[7])
            turn, position = state[2] - motions[part, 2], complex(state[0], state[1])
            off_yaw = (yaws[part] - turn - values[1] + math.pi) % (2.0 * math.pi) - math.pi
            for axis in range(axes):
                weight, yaw_weight = weights[part, axis], yaw_weights[part, axis]
                place = places[part, axis] * complex(math.cos(turn), math.sin(turn))
                sums[axis] += positions[part, axis] - (weight * position + place).real + yaw_weight * off_yaw
                of_part[axis] = weight.real, -weight.imag, yaw_weight - place.imag
            _add_errors(cov, of_part)
            slopes += of_part
        of_rows = (values[4] / rows[window], values[5] / rows[window])
        of_window = (sums, slopes, axes, of_rows, quantisation, errors[window], variances[window])
        if is_used[window]:
            _correct(state, cov, *of_window)
        else:
            _correct(state.copy(), cov.copy(), *of_window)
    return state, cov


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
    axes: int,
    of_rows: Tuple[float, float],
    quantisation: Array,
    errors: Array,
    variances: Array,
) -> None:
    """Correct the state by the mean of a window, one component after the other."""
    gained, total = np.empty(STATES), np.zeros(3)
    cos_yaw, sin_yaw = math.cos(state[2]), math.sin(state[2])
    for axis in range(axes):
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
