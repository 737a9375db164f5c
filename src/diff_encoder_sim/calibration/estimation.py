"""Calibration: geometry, sensor and slip of a robot from its drives with a reference, and what of it is known."""

from __future__ import annotations

import math
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.calibration.first_guess import FirstGuess, first_guess
from diff_encoder_sim.calibration.likelihood import (
    GEOMETRY,
    INDEX,
    LONGEST_DELAY_S,
    NAMES,
    UNSTATED_STD,
    Track,
    covariances_at,
    largest_variance,
    maximise,
)
from diff_encoder_sim.calibration.umbmark import WheelGeometry
from diff_encoder_sim.drives.reference import Reference

special = deferred('scipy.special')

LEVEL = 0.95
SHORTEST_S, LEAST_PATH_M = 10.0, 0.5  # of a drive; a path of the wheels
FASTEST_RADPS = 200.0  # of a wheel; more is a wrap of the counter
FIRST_GATE = 600.0  # with the first guess
UNRELATED = 0.15  # error of the aligned path, as a fraction of its spread
GATE = 60.0  # squared Mahalanobis distance of a window that is not believed; 1e-12 by chance
STARTED_OVER_M = 3.0  # of a drive, by which its start is placed on the reference
MEDIAN_DISTANCE = {False: 1.386, True: 2.366}  # of chi squared with 2 components, and 3 with yaw
SHORTEST_PIECE_S = 6.0  # between two disturbances
MOST_ROUNDS = 8  # of finding disturbances

# Half the interval of what drives determine is below these.
DETERMINED = {
    **dict.fromkeys(('left_wheel_diameter_m', 'right_wheel_diameter_m'), 0.1),  # relative
    'wheel_separation_m': 0.2,  # relative
    **dict.fromkeys(('reference_x_m', 'reference_y_m'), 0.3),
    'reference_yaw_rad': 0.5,
    'reference_delay_s': 0.4,
}


class ReferencedDrive(NamedTuple):
    """A drive with its reference."""

    name: str
    drive: Drive  # angles are positive forward
    reference: Reference
    count_rad: Tuple[float, float]  # angle of a count of the left and the right wheel; 0 if angles are exact


class Estimated(NamedTuple):
    """A number with its interval of 95 %."""

    value: float
    interval: Tuple[float, float]


class Disturbance(NamedTuple):
    """A span in which reference and wheels disagree by more than slip and noise."""

    drive: str
    start_s: float  # since the start of the drive
    end_s: float
    is_lasting: bool  # the robot was pushed or lifted, a wheel spun, or the reference jumped; else it is right again


class Fit(NamedTuple):
    """A drive with the calibration, to be drawn."""

    drive: str
    times_s: np.ndarray  # (k,) of the reference, since the start of the drive
    reference: np.ndarray  # (k, 3) poses of the sensor
    before: Optional[np.ndarray]  # (k, 3) by odometry with the nominal geometry
    after: np.ndarray  # (k, 3) by odometry with the calibrated geometry
    window_times_s: np.ndarray  # (m,)
    residuals: np.ndarray  # (m, 3) prediction errors in standard deviations; NaN where the window is not used


class Calibration(NamedTuple):
    """The estimate; see docs/file_formats.md for the names of the values."""

    values: Dict[str, Estimated]
    geometry_covariance: np.ndarray  # (3, 3) of ln left diameter, ln right diameter, ln separation
    undetermined: List[str]  # names of values that the drives do not determine
    disturbances: List[Disturbance]
    fits: List[Fit]
    parameters: np.ndarray  # (14,) by likelihood.NAMES
    covariances: np.ndarray  # (2, 14, 14), see likelihood.covariances_at


def calibrate(drives: Sequence[ReferencedDrive], nominal: Optional[WheelGeometry] = None) -> Calibration:
    """Estimate a robot's geometry, place and delay of the reference sensor, and slip, from all drives together.

    Raises:
        ConfigError: a drive is too short, the robot stands still, wheels are reversed or swapped, or a counter wraps.
    """
    whole = [track_of(each) for each in drives]
    guesses = [guess_of(each.name, track, nominal) for each, track in zip(drives, whole)]
    parts = [track.without_gaps() for track in whole]
    parameters = _fitted(parts, _start(whole, guesses, nominal))
    covariances = covariances_at([track for of_drive in parts for track in of_drive], parameters)
    values, undetermined = _values(parameters, covariances)
    disturbances = [found for each, tracks in zip(drives, parts) for found in _disturbances(each.name, tracks)]
    fits = [_fit(*each, parameters, nominal) for each in zip([each.name for each in drives], whole, parts)]
    of_ratio = np.eye(len(NAMES))[1] - np.eye(len(NAMES))[0]
    geometry = max(covariances, key=lambda each: of_ratio @ each @ of_ratio)[GEOMETRY, GEOMETRY]
    return Calibration(values, geometry, undetermined, disturbances, fits, parameters, covariances)


def track_of(drive: ReferencedDrive) -> Track:
    """Return the arrays of a drive; ConfigError if it cannot be used."""
    stamps_ns, angles_rad = drive.drive.stamps_ns, drive.drive.wheel_angles_rad
    times_s = (stamps_ns - stamps_ns[0]) / NANOSECONDS_PER_SECOND
    pose_times_s = (drive.reference.stamps_ns - stamps_ns[0]) / NANOSECONDS_PER_SECOND
    inside = (pose_times_s > LONGEST_DELAY_S) & (pose_times_s < times_s[-1] - LONGEST_DELAY_S)
    inside &= np.isfinite(drive.reference.poses[:, :2]).all(axis=1)
    together_s = float(np.ptp(pose_times_s[inside])) if inside.any() else 0.0
    if together_s < SHORTEST_S:
        raise ConfigError(
            f'{drive.name}: given {together_s:.1f} s of wheels and reference together; '
            f'allowed: at least {SHORTEST_S:g} s'
        )
    turned_rad = abs(np.diff(angles_rad, axis=0))
    fast = np.argwhere(turned_rad > FASTEST_RADPS * np.diff(times_s)[:, np.newaxis])
    if len(fast):
        row, side = fast[0]
        raise ConfigError(
            f'{drive.name}: given a {("left", "right")[side]} wheel that turns by {turned_rad[row, side]:.0f} rad from '
            f'one sample to the next at {times_s[row]:.2f} s; allowed: --ticks-modulus, if its counter wraps'
        )
    poses = drive.reference.poses[inside]
    components = 3 if np.isfinite(poses[0, 2]) else 2
    if drive.reference.covariances is None:
        covariances = np.tile(np.eye(3) * UNSTATED_STD**2, (len(poses), 1, 1))
    else:
        covariances = drive.reference.covariances[inside]
    return Track(
        times_s,
        angles_rad,
        pose_times_s[inside],
        poses,
        covariances[:, :components, :components],
        np.array(drive.count_rad),
    )


def guess_of(name: str, track: Track, nominal: Optional[WheelGeometry]) -> FirstGuess:
    """Return the first guess of a drive; ConfigError if the robot stands still."""
    turned_rad = abs(np.diff(track.angles_rad, axis=0)).sum(axis=0)
    ratio = None
    if nominal is not None:
        ratio = 0.25 * (nominal.left_diameter_m + nominal.right_diameter_m) / nominal.separation_m
    guess = first_guess(name, track.times_s, track.angles_rad, track.pose_times_s, track.poses, ratio)
    if not guess.radius_m * turned_rad.max() > LEAST_PATH_M:
        raise ConfigError(
            f'{name}: given a drive in which a wheel turns by {turned_rad.max():.2f} rad; '
            f'allowed: one with a path of at least {LEAST_PATH_M:g} m'
        )
    if guess.error_m > UNRELATED * guess.spread_m:
        raise ConfigError(
            f'{name}: given a reference that does not follow the wheels: {guess.error_m:.2f} m of '
            f'{guess.spread_m:.2f} m in parts of 20 s; allowed: a reference of the same robot, by the same clock'
        )
    return guess


def _start(tracks: Sequence[Track], guesses: Sequence[FirstGuess], nominal: Optional[WheelGeometry]) -> np.ndarray:
    """Return the parameters to start from: those of the drive with the most rows."""
    guess = max(zip(tracks, guesses), key=lambda each: len(each[0].poses))[1]
    diameter_m = 2.0 * guess.radius_m
    stated = np.median(tracks[0].covariances, axis=0)
    noise = math.log(max(1e-3, guess.error_m) / math.sqrt(stated[0, 0]))
    of_yaw = math.log(0.03 / math.sqrt(stated[2, 2])) if tracks[0].has_yaw else 0.0
    of_noise = (math.log(1e-6), math.log(1e-5), noise, of_yaw, noise, of_yaw, math.log(2.0))
    place = (guess.x_m, guess.y_m, guess.yaw_rad, guess.delay_s)
    left, right = diameter_m, diameter_m
    if nominal is not None:
        ratio = nominal.right_diameter_m / nominal.left_diameter_m
        left, right = 2.0 * diameter_m / (1.0 + ratio), 2.0 * diameter_m * ratio / (1.0 + ratio)
    return np.array([math.log(left), math.log(right), math.log(guess.radius_m / guess.ratio), *place, *of_noise])


def _fitted(parts: List[List[Track]], start: np.ndarray) -> np.ndarray:
    """Maximise the likelihood; `parts` are the tracks of each drive, which disturbances split further.

    Disturbances are found with each estimate, and left out of the next.
    """
    parameters, gate = start, FIRST_GATE
    for _ in range(MOST_ROUNDS):
        before = [track.is_used for of_drive in parts for track in of_drive]
        _place_starts(parts, parameters)
        parts[:] = [[piece for track in of_drive for piece in _pieces(track, parameters, gate)] for of_drive in parts]
        _place_starts(parts, parameters)
        tracks = [track for of_drive in parts for track in of_drive]
        is_same = [np.array_equal(old, track.is_used) for old, track in zip(before, tracks)]
        if gate == GATE and len(before) == len(tracks) and all(is_same):
            break
        parameters, _ = maximise(tracks, start)  # not from the last ones: a disturbance leads far astray
        gate = GATE
    return parameters


def _place_starts(parts: Sequence[Sequence[Track]], parameters: np.ndarray) -> None:
    for track in (track for of_drive in parts for track in of_drive):
        track.start_yaw_rad = start_heading(track, parameters, STARTED_OVER_M)


def _pieces(track: Track, parameters: np.ndarray, gate: float) -> List[Track]:
    """Find the windows of a track that do not fit, and return it in two pieces if one changes the pose for good."""
    is_used = np.ones(len(track.is_used), bool)
    while True:
        errors, variances, _, _ = track.filtered(parameters, is_used)
        distances = (errors**2 / variances).sum(axis=1)
        # Disturbances make the estimated noise too large, and all distances too small: relative to their median.
        relative = gate * min(1.0, float(np.median(distances)) / MEDIAN_DISTANCE[track.has_yaw])
        worst = int(np.where(is_used, distances, 0.0)[1:].argmax()) + 1
        if distances[worst] <= relative:
            track.is_used = is_used
            return [track]
        after = worst + 1 + int(np.argmax(is_used[worst + 1 :])) if is_used[worst + 1 :].any() else worst
        is_used[worst] = False
        errors, variances, _, _ = track.filtered(parameters, is_used)
        if after > worst and (errors[after] ** 2 / variances[after]).sum() > relative:
            pieces = [track.between(0, worst), track.between(worst + 1, len(is_used))]
            return [each for each in pieces if np.ptp(each.pose_times_s) >= SHORTEST_PIECE_S]


def _values(parameters: np.ndarray, covariances: np.ndarray) -> Tuple[Dict[str, Estimated], List[str]]:
    """Return the values by name, and the names of those that are not determined."""
    reach = float(special.ndtri(0.5 + 0.5 * LEVEL))
    combinations = {name: np.eye(len(NAMES))[INDEX[name]] for name in NAMES[:9]}
    left, right, separation = (combinations[name] for name in NAMES[:3])
    combinations['radius_ratio'] = right - left
    combinations['radius_per_separation'] = left - separation  # of the diameter, halved below
    values, undetermined = {}, []
    for name, row in combinations.items():
        if name == 'reference_yaw_rad' and not covariances[0, INDEX[name], INDEX[name]]:
            continue
        centre, half = float(row @ parameters), reach * math.sqrt(largest_variance(row, covariances))
        low, high = centre - half, centre + half
        if name not in NAMES[3:7]:
            centre, low, high = math.exp(centre), math.exp(low), math.exp(high)
        scale = 0.5 if name == 'radius_per_separation' else 1.0
        values[name] = Estimated(scale * centre, (scale * low, scale * high))
        if half > DETERMINED.get(name, math.inf):
            undetermined.append(name)
    return values, undetermined


def _disturbances(name: str, tracks: Sequence[Track]) -> List[Disturbance]:
    """Return the gaps between the tracks of a drive, and their windows that are not used, in order."""
    found = [
        Disturbance(name, float(before.pose_times_s[-1]), float(after.pose_times_s[0]), True)
        for before, after in zip(tracks, tracks[1:])
    ]
    for track in tracks:
        for window in np.flatnonzero(~track.is_used):
            start_s, end_s = track.edges_s[[window, window + 1]].tolist()
            found.append(Disturbance(name, start_s, end_s, False))
    return sorted(found, key=lambda each: each.start_s)


def _fit(
    name: str, whole: Track, tracks: Sequence[Track], parameters: np.ndarray, nominal: Optional[WheelGeometry]
) -> Fit:
    residuals = []
    for track in tracks:
        errors, variances = track.errors(parameters)
        residuals.append(np.where(track.is_used[:, np.newaxis], errors / np.sqrt(variances), math.nan))
    before = None if nominal is None else sensor_path(whole, with_geometry(parameters, nominal))
    times_s = np.concatenate([track.edges_s[:-1] for track in tracks])
    paths = whole.poses, before, sensor_path(whole, parameters)
    return Fit(name, whole.pose_times_s, *paths, times_s, np.concatenate(residuals))


def with_geometry(parameters: np.ndarray, geometry: WheelGeometry) -> np.ndarray:
    """Return the parameters with other wheels and separation."""
    changed = parameters.copy()
    changed[GEOMETRY] = np.log(geometry)
    return changed


def sensor_path(track: Track, parameters: np.ndarray) -> np.ndarray:
    """Return (k, 3) poses of the sensor by odometry, on the reference by the rigid motion that fits best."""
    motions, path = _path(track, parameters)
    target, turn = track.poses[:, 0] + 1j * track.poses[:, 1], _turn(track, path)
    placed = target.mean() + (path - path.mean()) * np.exp(1j * turn)
    return np.column_stack((placed.real, placed.imag, motions[:, 2] + turn + parameters[INDEX['reference_yaw_rad']]))


def start_heading(track: Track, parameters: np.ndarray, over_m: float) -> float:
    """Return the robot's heading at the start of a drive [rad], by which its first metres fit best."""
    motions, path = _path(track, parameters)
    rows = np.searchsorted(motions[:, 3:5].mean(axis=1), motions[0, 3:5].mean() + over_m)
    return _turn(track, path[: max(2, int(rows))])


def _path(track: Track, parameters: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return `Track.motions` at all rows of the reference, and the places of the sensor as complex numbers."""
    motions = track.motions(parameters, track.pose_times_s - parameters[INDEX['reference_delay_s']])
    return motions, motions[:, 0] + 1j * motions[:, 1] + complex(*parameters[3:5]) * np.exp(1j * motions[:, 2])


def _turn(track: Track, path: np.ndarray) -> float:
    """Return the turn that fits the first rows of the reference best."""
    target = track.poses[: len(path), 0] + 1j * track.poses[: len(path), 1]
    return float(np.angle(((path - path.mean()).conj() * (target - target.mean())).sum()))
