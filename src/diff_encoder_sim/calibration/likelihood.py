"""The likelihood of drives with a reference, its maximum, and how well that is known.

Errors of references are correlated over a second or so in ways that no model describes: smoothing filters, jitter of
clocks, markers that come and go. So the data are means over windows of `WINDOW_S`, which follow each other without
overlap: each segment of a drive, from one window to the next, counts once (`pose_filter`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.se2 import wrap_angles
from diff_encoder_sim.calibration.pose_filter import ROBUST_BEYOND_STD, filter_poses
from diff_encoder_sim.simulation.slip import extra_travel

WINDOW_S, PARTS = 2.0, 4  # of a window; the robot's slip within a window is that between its parts

# The parameters, in this order: logarithms of positive ones. The last two only if slip by motion is estimated.
NAMES = (
    *('left_wheel_diameter_m', 'right_wheel_diameter_m', 'wheel_separation_m'),
    *('reference_x_m', 'reference_y_m', 'reference_yaw_rad', 'reference_delay_s'),
    *('slip_m2_per_m', 'slip_rad2_per_rad'),
    *('white_std', 'white_yaw_std', 'slow_std', 'slow_yaw_std', 'slow_time_constant_s'),
    *('slip_by_acceleration', 'slip_by_lateral_acceleration'),
)
INDEX = {name: index for index, name in enumerate(NAMES)}
OF_YAW = [INDEX[name] for name in ('reference_yaw_rad', 'white_yaw_std', 'slow_yaw_std')]
GEOMETRY, NOISE, BY_MOTION = slice(0, 3), slice(7, 14), slice(14, 16)

# Weak knowledge (normal, of logarithms where the parameter has one), which only keeps what a drive does not determine
# near a usual value. Diameters and separation: about their first guess. Slip: 1.7 mm after 1 m, 0.2 deg after 1 rad,
# by up to a factor of 7; short drives confuse it with slow errors of the reference, which would narrow the intervals.
USUAL = np.array([0.0] * 7 + [math.log(3e-6), math.log(1e-5), 0.0, 0.0, -3.0, -3.0, math.log(2.0), 0.0, 0.0])
SPREAD = np.array([1.0, 1.0, 0.7, 1.0, 1.0, 10.0, 0.5, 2.0, 2.0, 3.0, 3.0, 1.5, 1.5, 1.5, 0.1, 0.1])
POWERS = np.array([0.0] * 7 + [1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 0.0, 0.0, 0.0])  # of exp(parameter) in variances
STEPS = np.array([1e-5, 1e-5, 1e-4, 1e-4, 1e-4, 1e-4, 1e-3, *[1e-2] * 7, 1e-3, 1e-3])  # of numerical derivatives

LEAST_STD = 5e-4  # [m, rad] of a window: interpolation between samples, and physics, are not better
UNSTATED_STD = 0.01  # [m, rad] unit of the noise of a reference that states no covariance
NOISE_STEP = 0.1  # of logarithms
SPEEDS_EVERY_S = 0.2  # for slip by motion: counts within shorter times are too few for a speed

# Parameters of a climb, and the gain of the log-likelihood that ends it: first without the noise, then with all;
# less changes no parameter by a tenth of its interval.
ROUGHLY, FINALLY, MOST_STEPS = ([*range(7)], 1.0), ([*range(len(NAMES))], 3e-3), 40
LARGEST_STEP, LEAST_VARIANCE = 1.5, 0.05  # of a parameter; of a variance after a step, relative

LEAST_TURN_RAD = 0.5  # of a drive that determines the separation
LEAST_AHEAD = 0.05  # rotation of both wheels ahead, by that of a turn, of a drive that determines the scale
LONGEST_GAP_S = WINDOW_S  # between samples of the wheels, across which a steady motion is good enough
LONGEST_DELAY_S = 0.5  # of the reference; its rows nearer to an end of the drive are left out


@dataclass
class Track:
    """A drive, or a part of one, and its reference, as arrays of the likelihood.

    Attributes:
        times_s: (n,) stamps of the wheel angles, since the start of the drive.
        angles_rad: (n, 2) left and right.
        pose_times_s: (k,) stamps of the reference.
        poses: (k, 3) x [m], y [m], yaw [rad] of the sensor; yaw NaN if unknown.
        covariances: (k, 3, 3) of the poses, or (k, 2, 2) of x and y alone.
        count_rad: (2,) angle of a count of each wheel; 0 for exact angles.
        start_yaw_rad: heading of the robot at the start of the drive, as the first rows of the reference have it.
        is_used: (m,) whether a window of the reference is used.
    """

    times_s: np.ndarray
    angles_rad: np.ndarray
    pose_times_s: np.ndarray
    poses: np.ndarray
    covariances: np.ndarray
    count_rad: np.ndarray
    start_yaw_rad: float = 0.0

    def __post_init__(self) -> None:
        part = np.floor((self.pose_times_s - self.pose_times_s[0]) * PARTS / WINDOW_S).astype(int)
        parts, starts, rows = np.unique(part, return_index=True, return_counts=True)
        self.first_rows = np.append(starts, len(part))
        self.middles_s = np.add.reduceat(self.pose_times_s, starts) / rows
        self.first_parts = np.append(np.unique(parts // PARTS, return_index=True)[1], len(parts))
        firsts, rows = self.first_rows[self.first_parts[:-1]], np.diff(self.first_rows[self.first_parts])
        precisions = np.linalg.inv(self.covariances)
        means = np.add.reduceat(precisions, firsts) / rows[:, np.newaxis, np.newaxis]
        # The mean error weighted by precision, whitened by the Cholesky factor of the mean precision.
        whitened = np.linalg.inv(np.linalg.cholesky(means)) / rows[:, np.newaxis, np.newaxis]
        weights = np.repeat(whitened, rows, axis=0) @ precisions
        # Of positions as complex numbers: the real part of weight times position counts.
        self._weights, self._yaw_weights = weights[:, :, 0] - 1j * weights[:, :, 1], weights[:, :, 2:].sum(axis=2)
        of_parts = self._by_part(self._weights), self._by_part(self._yaw_weights)
        self._windows = self.middles_s, self.first_parts, rows, *of_parts
        self.is_used = np.ones(len(firsts), bool)
        self._paths: Dict[Tuple[float, ...], Any] = {}  # the last ones, and their arguments of `filter_poses`

    @property
    def has_yaw(self) -> bool:
        """Return whether the reference has a yaw."""
        return bool(self.covariances.shape[1] == 3)

    @property
    def edges_s(self) -> np.ndarray:
        """Return (m + 1,) the first stamps of the windows, and the last of all."""
        return np.asarray(np.append(self.pose_times_s, self.pose_times_s[-1])[self.first_rows[self.first_parts]])

    def without_gaps(self) -> List[Track]:
        """Return the parts between gaps of the wheels' samples, in which the motion is unknown."""
        edges_s, pieces, first = self.edges_s, [], 0
        for row in np.flatnonzero(np.diff(self.times_s) > LONGEST_GAP_S):
            begin, end = np.searchsorted(edges_s, self.times_s[[row, row + 1]] + [-LONGEST_DELAY_S, LONGEST_DELAY_S])
            pieces.append((first, max(first, begin - 1)))
            first = min(end, len(self.is_used))
        pieces.append((first, len(self.is_used)))
        return [self.between(*piece) for piece in pieces if piece[1] > piece[0]]

    def between(self, first: int, end: int) -> Track:
        """Return the part of some windows."""
        rows = slice(*self.first_rows[self.first_parts[[first, end]]])
        poses = self.pose_times_s[rows], self.poses[rows], self.covariances[rows]
        span_s = poses[0][0] - WINDOW_S, poses[0][-1] + WINDOW_S  # with any delay
        samples = slice(*np.searchsorted(self.times_s, span_s))
        return Track(self.times_s[samples], self.angles_rad[samples], *poses, self.count_rad)

    @property
    def turns_in_place(self) -> bool:
        """Return whether the robot hardly goes ahead."""
        left, right = self.angles_rad.T
        return bool(np.ptp(0.5 * (left + right)) < LEAST_AHEAD * np.ptp(right - left))

    def motions(self, parameters: np.ndarray, at_s: np.ndarray) -> np.ndarray:
        """Return (m, 6) `motions` of `filter_poses` at times of the drive."""
        left_m, right_m = self._travels(parameters).T
        steps_m = np.diff(np.stack((left_m, right_m)), axis=1, prepend=np.array([left_m[:1], right_m[:1]]))
        yaw_rad = (right_m - left_m) / math.exp(parameters[2])
        turns_rad = np.diff(yaw_rad, prepend=yaw_rad[:1])
        chord_m = 0.5 * steps_m.sum(axis=0) * np.sinc(turns_rad / (2.0 * np.pi))
        middle_rad = yaw_rad - 0.5 * turns_rad - yaw_rad[0]
        paths = (chord_m * np.cos(middle_rad), chord_m * np.sin(middle_rad), turns_rad, *abs(steps_m), abs(turns_rad))
        return np.column_stack([np.interp(at_s, self.times_s, np.cumsum(path)) for path in paths])

    def _travels(self, parameters: np.ndarray) -> np.ndarray:
        """Return the (n, 2) distances rolled by the left and the right wheel [m]."""
        travels_m = 0.5 * np.exp(parameters[:2]) * self.angles_rad
        by_acceleration, by_lateral_acceleration = parameters[BY_MOTION] if len(parameters) > NOISE.stop else (0.0, 0.0)
        if not (by_acceleration or by_lateral_acceleration):
            return np.asarray(travels_m)
        rows = np.unique(np.floor(self.times_s / SPEEDS_EVERY_S), return_index=True)[1]
        by_motion, separation_m = (by_acceleration, by_lateral_acceleration), math.exp(parameters[2])
        extra_m = extra_travel(by_motion, self.times_s[rows], travels_m[rows], separation_m)
        more_m = [np.interp(self.times_s, self.times_s[rows], each) for each in extra_m.T]
        return np.asarray(travels_m - np.column_stack(more_m))

    def errors(self, parameters: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return (m, 3) prediction errors and their variances, 0 and 1 of windows that are not used."""
        errors, variances, _, _ = self.filtered(parameters, self.is_used)
        errors[~self.is_used], variances[~self.is_used] = 0.0, 1.0
        return errors, variances

    def distances(self, parameters: np.ndarray, is_used: np.ndarray) -> np.ndarray:
        """Return (m,) squared Mahalanobis distances of the windows from their prediction."""
        errors, variances, _, _ = self.filtered(parameters, is_used)
        squares, linear_from = errors**2 / variances, ROBUST_BEYOND_STD**2
        # The variances of large errors are enlarged in proportion.
        return np.asarray(np.maximum(squares, squares**2 / linear_from).sum(axis=1))

    def filtered(
        self, parameters: np.ndarray, is_used: np.ndarray
    ) -> Tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return errors, variances, last state and covariance of `filter_poses`."""
        path = (*parameters[GEOMETRY], parameters[INDEX['reference_delay_s']], *parameters[BY_MOTION])
        if path not in self._paths:  # most derivatives are of other parameters
            self._paths = {} if len(self._paths) > len(NAMES) else self._paths  # 9 to 13 for all derivatives at a point
            self._paths[path] = self._sums_of_parts(parameters)
        motions, positions, robots, sensors, yaws, first = self._paths[path]
        values, sensor = np.exp(parameters), complex(*parameters[3:5])
        left_m, right_m = 0.5 * values[:2] * self.count_rad  # distance of a count
        # Two independent remainders of a count, which do not grow: bounded.
        of_counts = (left_m**2 + right_m**2) / 12.0 * np.array([0.25, 1.0 / values[2] ** 2]) + LEAST_STD**2
        given = np.concatenate([values[2:3], parameters[5:6], values[7:9], values[9:13] ** 2, values[13:14]])
        start = complex(*self.poses[0, :2]) - np.exp(1j * self.start_yaw_rad) * (first[0] + sensor * first[1])
        start_pose = np.array([start.real, start.imag, self.start_yaw_rad + motions[0, 2]])
        errors, variances = np.zeros((len(is_used), 3)), np.ones((len(is_used), 3))
        of_path = motions, positions, robots + sensor * sensors, yaws
        state, covariance = filter_poses(
            *self._windows, *of_path, start_pose, is_used, given, of_counts, errors, variances
        )
        return errors, variances, state, covariance

    def _sums_of_parts(self, parameters: np.ndarray) -> Tuple[np.ndarray, ...]:
        """Return motions, positions, places of the robot and of a sensor 1 m ahead of it, yaws; the first places."""
        at_s = np.append(self.middles_s, self.pose_times_s) - parameters[INDEX['reference_delay_s']]
        motions, of_rows = np.split(self.motions(parameters, at_s), [len(self.middles_s)])
        first_rows, rows = self.first_rows[:-1], np.diff(self.first_rows)
        yaws_rad = np.nan_to_num(self.poses[:, 2]) - of_rows[:, 2]
        beyond = wrap_angles(yaws_rad - np.repeat(yaws_rad[first_rows], rows))[:, np.newaxis]
        positions = (self._weights * (self.poses[:, :1] + 1j * self.poses[:, 1:2])).real + self._yaw_weights * beyond
        off_m = of_rows[:, :2] - np.repeat(motions[:, :2], rows, axis=0)
        places = np.column_stack((off_m[:, 0] + 1j * off_m[:, 1], np.exp(1j * of_rows[:, 2])))
        of_places = [self._by_part(self._weights * each[:, np.newaxis]) for each in places.T]
        return motions, self._by_part(positions), *of_places, yaws_rad[first_rows], places[0]

    def _by_part(self, of_rows: np.ndarray) -> np.ndarray:
        """Return sums of rows over the parts."""
        return np.asarray(np.add.reduceat(of_rows, self.first_rows[:-1]))


def free_parameters(tracks: Sequence[Track], parameters: np.ndarray) -> np.ndarray:
    """Return the indices of the parameters that the drives can determine.

    On a straight line, the separation would follow only from the noise of the heading, which is not its measure. Turns
    in place determine radius / separation, but not the scale.
    """
    yaws_rad = [track.motions(parameters, track.pose_times_s)[:, 2] for track in tracks]
    fixed = [] if any(track.has_yaw for track in tracks) else OF_YAW
    if max(map(np.ptp, yaws_rad), default=0.0) < LEAST_TURN_RAD:
        fixed = [*fixed, INDEX['wheel_separation_m']]
    elif all(track.turns_in_place for track in tracks):
        fixed = [*fixed, 0, 1]  # the diameters
    return np.setdiff1d(np.arange(len(parameters)), fixed)


def _log_likelihood(tracks: Sequence[Track], parameters: np.ndarray, centre: np.ndarray) -> float:
    total = -0.5 * float((((parameters - centre) / SPREAD[: len(parameters)]) ** 2).sum())
    for track in tracks:
        errors, variances = track.errors(parameters)
        total -= 0.5 * float((errors**2 / variances + np.log(variances)).sum())
    return total


def moved(parameters: np.ndarray, index: int, step: float) -> np.ndarray:
    """Return the parameters with one of them moved by a step, for numerical derivatives."""
    changed = parameters.copy()
    changed[index] += step
    return changed


def _derivatives(track: Track, parameters: np.ndarray, free: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the scores (free, k) of the rows of a track, and their expected information (free, free)."""
    errors, variances = (each.ravel() for each in track.errors(parameters))
    of_errors, of_variances = np.empty((len(free), len(errors))), np.empty((len(free), len(errors)))
    for place, index in enumerate(free):
        sides = [track.errors(moved(parameters, index, sign * STEPS[index])) for sign in (1.0, -1.0)]
        of_errors[place], of_variances[place] = (
            (ahead - behind).ravel() / (2.0 * STEPS[index]) for ahead, behind in zip(*sides)
        )
    scores = 0.5 * of_variances * (errors**2 / variances - 1.0) / variances - of_errors * errors / variances
    information = (of_errors / variances) @ of_errors.T + 0.5 * (of_variances / variances**2) @ of_variances.T
    return scores.reshape(len(free), -1, 3).sum(axis=2), information


def maximise(
    tracks: Sequence[Track], start: np.ndarray, is_rough: bool = False, fixed: Sequence[int] = ()
) -> np.ndarray:
    """Climb to the maximum by Fisher scoring with Levenberg's damping; return the parameters, some of them `fixed`."""
    only, least_gain = ROUGHLY if is_rough else FINALLY
    free = np.setdiff1d(np.intersect1d(free_parameters(tracks, start), only), fixed)
    centre = np.concatenate((start[GEOMETRY], USUAL[3 : len(start)]))
    parameters, damping, best = start.copy(), 1e-3, _log_likelihood(tracks, start, centre)
    powers = POWERS[free]
    for _ in range(MOST_STEPS):
        found = [_derivatives(track, parameters, free) for track in tracks]
        information = sum(each for _, each in found) + np.diag(SPREAD[free] ** -2)
        slope = sum(scores.sum(axis=1) for scores, _ in found) - (parameters - centre)[free] / SPREAD[free] ** 2
        gain = -math.inf
        while gain < 0.0 and damping < 1e6:
            step = np.linalg.solve(information + damping * np.diag(np.diag(information)), slope)
            step, stepped = step.clip(-LARGEST_STEP, LARGEST_STEP), parameters.copy()
            # A variance that is too large falls at once: the likelihood is nearly a parabola of it, not of its log.
            falls = np.log1p((powers * step).clip(LEAST_VARIANCE - 1.0, 0.0)) / powers.clip(1.0, None)
            stepped[free] += np.where(powers * step < 0.0, falls, step)
            gain = _log_likelihood(tracks, stepped, centre) - best
            damping = damping * 10.0 if not gain >= 0.0 else max(0.1 * damping, 1e-6)
            gain = gain if math.isfinite(gain) else -math.inf
        if gain < 0.0:
            break
        parameters, best = stepped, best + gain
        if gain < least_gain:
            break
    return parameters


@dataclass(frozen=True)
class Uncertainty:
    """How well the parameters are known at the maximum; matrices are 0 of what is not free.

    There are k = 14 parameters, or 16 with slip by motion.

    Attributes:
        expected: (k, k) covariance, the inverse of the expected information: right if the noise is as modelled.
        observed: (k, k) covariance by the scatter of the scores of the windows, which are independent (Godambe's
            sandwich): right for many windows.
        by_noise: (7, k, k) derivatives of `expected` by the parameters of slip and noise, which are estimated, too.
    """

    expected: np.ndarray
    observed: np.ndarray
    by_noise: np.ndarray

    def variance(self, row: np.ndarray) -> float:
        """Return the variance of a linear combination of the parameters: the larger one counts."""
        return float(max(row @ self.expected @ row, row @ self.observed @ row))

    def restricted(self, parameters: np.ndarray) -> np.ndarray:
        """Return the parameters after a step of slip and noise to the maximum of the restricted likelihood (REML).

        At the maximum of the likelihood they are too small, as the geometry is fitted to the same data.
        """
        of_motion = np.delete(np.arange(len(parameters)), NOISE)
        fitted = np.ix_(*[of_motion[np.diag(self.expected)[of_motion] != 0.0]] * 2)
        information, changed = np.linalg.inv(self.expected[fitted]), parameters.copy()
        slopes = [0.5 * float((information * each[fitted]).sum()) for each in self.by_noise]
        changed[NOISE] += (self.expected[NOISE, NOISE] @ slopes).clip(-1.0, 1.0)
        return changed

    def freedom(self, row: np.ndarray, more: float = 0.0, more_by_noise: Optional[np.ndarray] = None) -> float:
        """Return the degrees of freedom of the variance of a combination, for Student's t (Satterthwaite 1946).

        `more` is the variance of an independent error that is added, as of a prediction, with (7,) its derivatives.
        """
        slopes = np.array([row @ each @ row for each in self.by_noise])
        slopes = slopes if more_by_noise is None else slopes + more_by_noise
        spread = float(slopes @ self.expected[NOISE, NOISE] @ slopes)
        return 2.0 * (float(row @ self.expected @ row) + more) ** 2 / max(spread, 1e-300)


def uncertainty_at(tracks: Sequence[Track], parameters: np.ndarray) -> Uncertainty:
    """Return how well the parameters are known at the maximum."""
    free = free_parameters(tracks, parameters)

    def inverse_of(information: np.ndarray) -> np.ndarray:
        covariance = np.zeros((len(parameters), len(parameters)))
        covariance[np.ix_(free, free)] = np.linalg.inv(information + np.diag(SPREAD[free] ** -2))
        return covariance

    found = [_derivatives(track, parameters, free) for track in tracks]
    expected = inverse_of(np.sum([information for _, information in found], axis=0))
    scatter = np.zeros_like(expected)
    scatter[np.ix_(free, free)] = np.diag(SPREAD[free] ** -2) + sum(scores @ scores.T for scores, _ in found)
    by_noise = np.zeros((NOISE.stop - NOISE.start, *expected.shape))
    for place, index in enumerate(range(NOISE.start, NOISE.stop)):
        if index in free:
            stepped = moved(parameters, index, NOISE_STEP)
            at_moved = inverse_of(np.sum([_derivatives(track, stepped, free)[1] for track in tracks], axis=0))
            by_noise[place] = (at_moved - expected) / NOISE_STEP
    return Uncertainty(expected, expected @ scatter @ expected, by_noise)


def support_of(tracks: Sequence[Track], parameters: np.ndarray, index: int) -> float:
    """Return by how much the maximum of the log-likelihood falls if a parameter is fixed at 0."""
    without = maximise(tracks, moved(parameters, index, -parameters[index]), fixed=[index])
    return _log_likelihood(tracks, parameters, parameters) - _log_likelihood(tracks, without, without)


def warm_up() -> None:
    """Compile the kernels, or load them from numba's cache."""
    times_s, still = np.arange(5.0), np.zeros((5, 3))
    Track(times_s, still[:, :2], times_s, still, np.tile(np.eye(3), (5, 1, 1)), np.zeros(2)).errors(USUAL[: NOISE.stop])
