"""A first guess of a robot's geometry from a drive with a reference, robust and without a start of its own.

For assumed signs of the wheels and a ratio of radius to separation, odometry has the robot's heading and path up to the
scale. In windows, the path of a sensor off the axle is then linear in what is unknown: scale and rotation, place of the
sensor, place of the window (least squares in complex numbers, so that a mirrored path does not fit).
"""

from __future__ import annotations

import math
from typing import NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import wrap_angles
from diff_encoder_sim.calibration.likelihood import LEAST_TURN_RAD, Track

WINDOW_S = 20.0  # of the alignment
EVERY_S, WHEELS_EVERY_S = 0.25, 0.1  # intervals of its rows, and of the samples of the wheels
RATIOS = np.geomspace(0.03, 1.0, 48)  # radius / separation
DELAYS_S = 0.05 * np.array(sorted(range(-8, 9), key=abs))
FEWEST_ROWS = 8  # of a window
LEAST_SIZE_M = 0.3  # of a path that shows whether a reference follows the wheels
LEAST_ERROR_M = 1e-3  # smaller errors of an alignment do not distinguish ratios and delays
OUTLYING, MOST = 3.0, 12.0  # error of a window in medians of all: beyond, it is left out; with which it then counts
LEAST_TURNS_RAD = 3.0  # of a reference, more than its noise
NEARBY = np.array(sorted(np.geomspace(0.9, 1.1, 41), key=lambda each: abs(math.log(each))))  # the first of equals
USUAL_RATIO = 0.25  # of a robot that never turned
_RIDGE = 1e-3  # for the place of the sensor in windows without turns, and the scale of turns in place

# The signs of the left and the right wheel, and whether they are swapped; the first is right.
WIRINGS = {
    (1, 1, False): '',
    (1, 1, True): 'left and right are swapped, or both reversed; allowed: the left one first, or --reversed left right',
    (-1, 1, False): "the left wheel's numbers fall when the robot drives forward; allowed: --reversed left",
    (1, -1, False): "the right wheel's numbers fall when the robot drives forward; allowed: --reversed right",
}
UNRELATED = 0.1  # distance of an aligned path as a fraction of its size: the reference is of another drive
CLEARLY_BETTER = 0.5  # error of another wiring, as a fraction of that of the right one


class FirstGuess(NamedTuple):
    """About the parameters of a robot."""

    radius_m: float
    ratio: float  # radius / separation
    x_m: float
    y_m: float
    yaw_rad: float  # of the sensor; 0 if unknown
    delay_s: float
    error_m: float  # distance of the aligned path: mean over windows of the root mean square
    unrelated: float  # median over windows of that distance, as a fraction of the size of the path


def first_guess(name: str, track: Track, ratio: Optional[float] = None) -> FirstGuess:
    """Return the guess of a drive; `ratio` is that of a known robot.

    ConfigError if a wheel is reversed, or both are swapped.
    """
    times_s, angles_rad, pose_times_s, poses = track.times_s, track.angles_rad, track.pose_times_s, track.poses
    rows = np.unique(np.searchsorted(pose_times_s, np.arange(pose_times_s[0], pose_times_s[-1], EVERY_S)))
    samples = np.unique(np.searchsorted(times_s, np.arange(times_s[0], times_s[-1], WHEELS_EVERY_S)))
    data = (times_s[samples], angles_rad[samples], pose_times_s[rows], poses[rows])
    usual = ratio or USUAL_RATIO
    is_straight = np.ptp(angles_rad @ (-1, 1)) * usual < LEAST_TURN_RAD  # swapped wheels drive the same path
    ratios = np.append(usual, RATIOS)  # of equals the first counts
    errors = {wiring: np.array([_align(data, wiring, each, 0.0).error_m for each in ratios]) for wiring in WIRINGS}
    wiring = min(WIRINGS, key=lambda each: errors[each].min())
    if not is_straight and errors[wiring].min() < CLEARLY_BETTER * errors[1, 1, False].min():
        other = _align(data, wiring, float(ratios[errors[wiring].argmin()]), 0.0)
        if other.unrelated < UNRELATED:
            raise ConfigError(f'{name}: {WIRINGS[wiring]}')
    of_right = errors[1, 1, False]
    best = float(ratios[of_right.argmin()])
    if is_straight or of_right.min() > 0.9 * np.median(of_right):  # a drive without turns fits with any
        best = _ratio_by_yaw(data) or usual
    delay_s = min(DELAYS_S, key=lambda each: _align(data, (1, 1, False), best, float(each)).error_m)
    nearby = [best] if is_straight else best * NEARBY
    finer = min(nearby, key=lambda each: _align(data, (1, 1, False), each, delay_s).error_m)
    return _align(data, (1, 1, False), float(finer), float(delay_s))


def _ratio_by_yaw(data: Sequence[np.ndarray]) -> Optional[float]:
    """Return radius / separation by the turns of the reference; None without yaw or turns."""
    times_s, angles_rad, pose_times_s, poses = data
    turns_rad = np.diff(np.unwrap(poses[:, 2]))
    of_wheels_rad = np.diff(np.interp(pose_times_s, times_s, angles_rad[:, 1] - angles_rad[:, 0]))
    if not np.isfinite(turns_rad).all() or abs(turns_rad).sum() < LEAST_TURNS_RAD:
        return None
    ratio = float(of_wheels_rad @ turns_rad / max(1e-9, of_wheels_rad @ of_wheels_rad))
    return ratio if ratio > 0.0 else None


def _align(data: Sequence[np.ndarray], wiring: Tuple[int, int, bool], ratio: float, delay_s: float) -> FirstGuess:
    """Fit the path of odometry to the poses in windows."""
    times_s, angles_rad, pose_times_s, poses = data
    left, right = (angles_rad * np.array(wiring[:2])).T[:: -1 if wiring[2] else 1]
    turned_rad = ratio * (right - left - right[0] + left[0])
    middle_rad = 0.5 * (turned_rad[1:] + turned_rad[:-1])
    path = np.append(0.0, np.cumsum(0.5 * np.diff(left + right) * np.exp(1j * middle_rad)))  # of a wheel of radius 1
    at_s = pose_times_s - delay_s
    headings = np.exp(1j * np.interp(at_s, times_s, turned_rad))
    paths = np.interp(at_s, times_s, path.real) + 1j * np.interp(at_s, times_s, path.imag)
    windows = np.floor((pose_times_s - pose_times_s[0]) / WINDOW_S)
    starts, rows = np.unique(windows, return_index=True, return_counts=True)[1:]

    def mean(values: np.ndarray) -> np.ndarray:
        return np.asarray(np.add.reduceat(values, starts) / rows)

    ahead, turned, target = (
        each - np.repeat(mean(each), rows) for each in (paths, headings, poses[:, 0] + 1j * poses[:, 1])
    )
    # Normal equations of target = scale * ahead + place * turned, both turned by the start's heading.
    of_ahead, of_turned = mean(abs(ahead) ** 2) + _RIDGE, mean(abs(turned) ** 2) + _RIDGE
    both, right, left = mean(ahead.conj() * turned), mean(ahead.conj() * target), mean(turned.conj() * target)
    determinant = of_ahead * of_turned - abs(both) ** 2
    scale = (of_turned * right - both * left) / determinant
    place = (of_ahead * left - both.conj() * right) / determinant
    errors_m = np.sqrt(mean(abs(target - np.repeat(scale, rows) * ahead - np.repeat(place, rows) * turned) ** 2))
    good = (rows >= FEWEST_ROWS) & (of_ahead > _RIDGE)
    if not good.any():
        return FirstGuess(math.nan, ratio, 0.0, 0.0, 0.0, delay_s, math.inf, 1.0)
    unrelated = np.median((errors_m / np.sqrt(mean(abs(target) ** 2)).clip(LEAST_SIZE_M, None))[good])
    # Others have a disturbance, but count: a wrong ratio must not leave out the turns.
    median_m = float(np.median(errors_m[good]))
    error_m = max(LEAST_ERROR_M, float(errors_m[good].clip(max=MOST * median_m).mean()))
    good &= errors_m <= OUTLYING * median_m
    of_scale, of_place = (determinant / each * rows * good for each in (of_turned, of_ahead))
    turns = np.exp(-1j * np.angle(scale))
    sensor = np.average(place * turns, weights=of_place)
    yaws_rad = np.angle(mean(np.exp(1j * poses[:, 2]) / headings) * turns)
    weights = of_scale.clip(max=np.median(of_scale[good]))
    # The closest one to all, as a mean would be right nowhere if the yaw of the reference jumps.
    yaw_rad = float(np.nan_to_num(min(yaws_rad, key=lambda each: weights @ abs(wrap_angles(yaws_rad - each)))))
    radius_m = float(np.average(abs(scale), weights=of_scale))
    return FirstGuess(radius_m, ratio, sensor.real, sensor.imag, yaw_rad, delay_s, error_m, float(unrelated))
