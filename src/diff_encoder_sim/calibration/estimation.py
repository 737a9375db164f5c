"""Calibration: geometry, sensor and slip of a robot from its drives with a reference, and what of it is known."""

from __future__ import annotations

import math
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.calibration import likelihood
from diff_encoder_sim.calibration.first_guess import LEAST_SIZE_M, UNRELATED, FirstGuess, first_guess
from diff_encoder_sim.calibration.likelihood import GEOMETRY, INDEX, NAMES, Track, Uncertainty
from diff_encoder_sim.calibration.umbmark import WheelGeometry
from diff_encoder_sim.drives.reference import Reference

special = deferred('scipy.special')

LEVEL, BY_CHANCE = 0.95, 0.05
SHORTEST_S, LEAST_PATH_M = 10.0, 0.5  # of a drive; a path of the wheels
DIAMETERS_M = 0.005, 2.0  # of wheels; others follow from a wrong unit
FASTEST_RADPS = 200.0  # of a wheel; more is a wrap of the counter
FIRST_GATE = 100.0  # with the first guess, relative to the usual distances
POSE_EVERY_S, WHEELS_EVERY_S = 0.05, 0.02
LEAST_GATE = 16.0  # where the noise is assumed larger than it is
GATE = 60.0  # squared Mahalanobis distance of a window that is not believed; 1e-12 by chance
STARTED_OVER_M = 3.0  # of a drive, by which its start is placed on the reference
FRACTION, FIRST_FRACTION = 0.25, 0.1  # of the windows, whose distances are usual
MOVING_M = 0.1  # path of both wheels in a window
FEWEST_FREEDOM = 5.0  # of a variance
SHORTEST_PIECE_S = 8.0  # between two disturbances
MOST_ROUNDS = 8  # of finding disturbances

# Relative error of a nominal length, and how that of each moves all: turns determine separation / mean diameter.
NOMINAL_STD, NOMINAL_ERRORS = 0.01, np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]])

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
    parameters: np.ndarray  # (14,) by likelihood.NAMES, or (16,) with slip by motion
    uncertainty: Uncertainty
    support: Dict[str, float]  # of each slip by motion: gain of the log-likelihood against 0; {} if not estimated

    @property
    def unsupported(self) -> List[str]:
        """Return the slips by motion that the drives do not support: by the ratio of likelihoods, at 5 %."""
        return [name for name, gain in self.support.items() if special.chdtrc(1.0, 2.0 * max(0.0, gain)) > BY_CHANCE]


def calibrate(
    drives: Sequence[ReferencedDrive],
    nominal: Optional[WheelGeometry] = None,
    near: Optional[np.ndarray] = None,
    has_slip_by_motion: bool = False,
) -> Calibration:
    """Estimate a robot's geometry, place and delay of the reference sensor, and slip, from all drives together.

    The search starts from a first guess, or from the parameters `near` of a calibration by some of the same drives.
    ConfigError if a drive is too short, the robot stands still, wheels are reversed or swapped, or a counter wraps.
    """
    whole = [track_of(each) for each in drives]
    guesses = [guess_of(each.name, track, nominal) for each, track in zip(drives, whole)]
    start = np.append(_start(whole, guesses, nominal), [0.0, 0.0] if has_slip_by_motion else [])
    free = likelihood.free_parameters(whole, start)
    start[free] = (start if near is None else near)[free]
    parameters, parts = _fitted([track.without_gaps() for track in whole], start, near is None)
    for each, tracks in zip(drives, parts):
        if not tracks:
            raise ConfigError(
                f'{each.name}: given no {SHORTEST_PIECE_S:g} s without a disturbance; allowed: a steadier one'
            )
    tracks = [track for of_drive in parts for track in of_drive]
    names = NAMES[likelihood.BY_MOTION] if has_slip_by_motion and near is None else ()
    support = {name: likelihood.support_of(tracks, parameters, INDEX[name]) for name in names}
    parameters = likelihood.uncertainty_at(tracks, parameters).restricted(parameters)
    uncertainty = likelihood.uncertainty_at(tracks, parameters)
    # Errors of the geometry that no residual shows: of lengths that are nominal, and of the reference's scale.
    nominal_errors = NOMINAL_STD * NOMINAL_ERRORS[np.diag(uncertainty.expected)[GEOMETRY] == 0.0]
    hidden_errors = np.vstack((nominal_errors, np.full(3, max(each.reference.scale_std for each in drives))))
    values, undetermined = _values(parameters, uncertainty, hidden_errors)
    named = list(zip([each.name for each in drives], whole, parts))
    disturbances = [found for each in named for found in _disturbances(*each)]
    fits = [_fit(*each, parameters, nominal) for each in named]
    both = (each[GEOMETRY, GEOMETRY] for each in (uncertainty.expected, uncertainty.observed))
    geometry = max(both, key=lambda each: float(each[0, 0] + each[1, 1] - 2.0 * each[0, 1]))  # of the ratio of radii
    geometry = geometry + hidden_errors.T @ hidden_errors
    return Calibration(values, geometry, undetermined, disturbances, fits, parameters, uncertainty, support)


def track_of(drive: ReferencedDrive) -> Track:
    """Return the arrays of a drive; ConfigError if it cannot be used."""
    stamps_ns, angles_rad = drive.drive.stamps_ns, drive.drive.wheel_angles_rad
    times_s = (stamps_ns - stamps_ns[0]) / NANOSECONDS_PER_SECOND
    pose_times_s = (drive.reference.stamps_ns - stamps_ns[0]) / NANOSECONDS_PER_SECOND
    inside = (pose_times_s > likelihood.LONGEST_DELAY_S) & (pose_times_s < times_s[-1] - likelihood.LONGEST_DELAY_S)
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
    rows = np.flatnonzero(inside)[every(pose_times_s[inside], POSE_EVERY_S)]
    samples = every(times_s, WHEELS_EVERY_S)
    poses = drive.reference.poses[rows]
    components = 3 if np.isfinite(poses[0, 2]) else 2
    if drive.reference.covariances is None:
        covariances = np.tile(np.eye(3) * likelihood.UNSTATED_STD**2, (len(poses), 1, 1))
    else:
        covariances = drive.reference.covariances[rows]
    of_poses = pose_times_s[rows], poses, covariances[:, :components, :components]
    return Track(times_s[samples], angles_rad[samples], *of_poses, np.array(drive.count_rad))


def every(times_s: np.ndarray, interval_s: float) -> np.ndarray:
    """Return the rows of some times, one in each interval; more would take longer and add little."""
    return np.asarray(np.unique(np.floor(times_s / interval_s), return_index=True)[1])


def guess_of(name: str, track: Track, nominal: Optional[WheelGeometry]) -> FirstGuess:
    """Return the first guess of a drive; ConfigError if the robot stands still."""
    turned_rad = abs(np.diff(track.angles_rad, axis=0)).sum(axis=0)
    ratio = None if nominal is None else 0.5 * sum(nominal.radii_m) / nominal.separation_m
    guess = first_guess(name, track, ratio)
    nominal_m = nominal.radii_m[0] if nominal else math.inf
    radius_m = nominal_m if track.turns_in_place else guess.radius_m  # turns do not show it
    if not radius_m * turned_rad.max() > LEAST_PATH_M:
        size_m = float(np.ptp(track.poses[:, :2], axis=0).max())
        raise ConfigError(
            f'{name}: given a drive in which a wheel turns by {turned_rad.max():.2f} rad and the reference moves by '
            f'{size_m:.2f} m; allowed: one with a path of at least {LEAST_PATH_M:g} m, in the unit of --length-unit'
        )
    if guess.unrelated > UNRELATED:
        raise ConfigError(
            f'{name}: given a reference off the path of the wheels by {100.0 * guess.unrelated:.0f} % of its size; '
            'allowed: one of the same robot, by the same clock'
        )
    least_m, most_m = (nominal.left_diameter_m / 3.0, nominal.left_diameter_m * 3.0) if nominal else DIAMETERS_M
    if math.isfinite(radius_m) and not least_m <= 2.0 * radius_m <= most_m:
        raise ConfigError(
            f'{name}: given a reference by which wheels have a diameter of {2.0 * radius_m:.3g} m; '
            f'allowed: {least_m:.3g} to {most_m:.3g} m; see --length-unit'
        )
    return guess


def _start(tracks: Sequence[Track], guesses: Sequence[FirstGuess], nominal: Optional[WheelGeometry]) -> np.ndarray:
    """Return the parameters to start from: those of the drive with the most rows."""
    guess = max(zip(tracks, guesses), key=lambda each: len(each[0].poses))[1]
    diameter_m = 2.0 * guess.radius_m
    stated = np.median(tracks[0].covariances, axis=0)
    noise = math.log(max(1e-3, guess.error_m) / math.sqrt(stated[0, 0]))
    of_yaw = math.log(0.03 / math.sqrt(stated[2, 2])) if tracks[0].has_yaw else 0.0
    of_noise = (math.log(1e-5), math.log(1e-4), noise, of_yaw, noise - 2.0, of_yaw - 2.0, math.log(2.0))
    place = (guess.x_m, guess.y_m, guess.yaw_rad, guess.delay_s)
    left, right = diameter_m, diameter_m
    separation_m = guess.radius_m / guess.ratio
    if all(track.turns_in_place for track in tracks):
        if nominal is None:
            raise ConfigError('drives: given only turns in place; allowed: straights, too, or --robot with the wheels')
        left, right = nominal.left_diameter_m, nominal.right_diameter_m
        separation_m = 0.25 * (left + right) / guess.ratio
    elif nominal is not None:
        ratio = nominal.right_diameter_m / nominal.left_diameter_m
        left, right = 2.0 * diameter_m / (1.0 + ratio), 2.0 * diameter_m * ratio / (1.0 + ratio)
    return np.array([math.log(left), math.log(right), math.log(separation_m), *place, *of_noise])


def _fitted(whole: List[List[Track]], parameters: np.ndarray, is_guess: bool) -> Tuple[np.ndarray, List[List[Track]]]:
    """Maximise the likelihood; return the parameters, and the tracks of each drive between its disturbances.

    Disturbances are found with each estimate, and left out of the next one.
    """
    before: List[Tuple[float, Tuple[bool, ...]]] = []
    for turn in range(MOST_ROUNDS):
        is_first = is_guess and turn < 2
        parts = [[piece for track in tracks for piece in pieces_of(track, parameters, is_first)] for tracks in whole]
        pieces = [piece for tracks in parts for piece in tracks]
        found = [(float(piece.pose_times_s[0]), tuple(piece.is_used)) for piece in pieces]
        if found == before and not is_first:
            break
        # The noise is fitted after the geometry, without disturbances: a large one would explain them all.
        parameters = likelihood.maximise(pieces, parameters, is_rough=is_guess and turn == 0)
        before = found
    return parameters, parts


def pieces_of(track: Track, parameters: np.ndarray, is_first: bool = False, usual: float = math.inf) -> List[Track]:
    """Leave out the windows of a track that do not fit, and split it where they change the pose for good."""
    if np.ptp(track.pose_times_s) < SHORTEST_PIECE_S:
        return []
    track.start_yaw_rad = start_heading(track, parameters, STARTED_OVER_M)
    is_used = np.ones(len(track.is_used), bool)
    paths_m = np.diff(track.motions(parameters, track.edges_s)[:, 3:5].sum(axis=1))
    moving = paths_m >= min(MOVING_M, float(np.median(paths_m)))  # a reference has less noise at rest
    while True:
        distances = track.distances(parameters, is_used)
        # Disturbances make the estimated noise too large, and all distances too small: relative to the lower ones,
        # and to the `usual` ones of the whole track, as a part may not fit at all.
        fraction = FIRST_FRACTION if is_first else FRACTION
        expected = float(special.chdtri(2.0 + track.has_yaw, 1.0 - fraction))
        usual = min(usual, float(np.quantile(distances[moving], fraction)) / expected)
        least = FIRST_GATE * max(1.0, usual) if is_first else max(LEAST_GATE, GATE * min(1.0, usual))
        worst = int(np.where(is_used, distances, 0.0).argmax())
        if not is_used[worst] or distances[worst] <= least:
            track.is_used = is_used
            return [track] if is_used.sum() * likelihood.WINDOW_S >= SHORTEST_PIECE_S else []
        is_used[worst] = False
        after = worst + 1 + int(np.argmax(np.append(is_used[worst + 1 :], True)))
        if after < len(is_used) and track.distances(parameters, is_used)[after] > least:
            halves = [track.between(*each) for each in ((0, worst), (worst + 1, len(is_used))) if each[0] < each[1]]
            return [piece for half in halves for piece in pieces_of(half, parameters, is_first, usual)]


def _values(
    parameters: np.ndarray, uncertainty: Uncertainty, hidden_errors: np.ndarray
) -> Tuple[Dict[str, Estimated], List[str]]:
    """Return the values by name, and the names of those that are not determined; (k, 3) errors of the geometry."""
    by_motion = NAMES[likelihood.BY_MOTION.start : len(parameters)]
    combinations = {name: np.eye(len(parameters))[INDEX[name]] for name in (*NAMES[:9], *by_motion)}
    left, right, separation = (combinations[name] for name in NAMES[:3])
    combinations['radius_ratio'] = right - left
    combinations['radius_per_separation'] = left - separation  # of the diameter, halved below
    # Of turns in place, positions show a circle of the sensor, but not where ahead is.
    circling = [] if uncertainty.expected[[0, INDEX['reference_yaw_rad']]].any() else NAMES[3:5]
    values, undetermined = {}, []
    for name, row in combinations.items():
        if name == 'reference_yaw_rad' and not uncertainty.expected[INDEX[name], INDEX[name]]:
            continue
        centre = float(row @ parameters)
        variance = uncertainty.variance(row)
        std = math.hypot(math.sqrt(variance), *(hidden_errors @ row[GEOMETRY]))
        half = reach_of(LEVEL, uncertainty.freedom(row)) * std
        low, high = centre - half, centre + half
        if name not in (*NAMES[3:7], *by_motion):
            centre, low, high = math.exp(centre), math.exp(low), math.exp(high)
        scale = 0.5 if name == 'radius_per_separation' else 1.0
        values[name] = Estimated(scale * centre, (scale * low, scale * high))
        if half > DETERMINED.get(name, math.inf) or variance == 0.0 or name in circling:
            undetermined.append(name)
    if 'wheel_separation_m' in undetermined:
        undetermined.append('radius_per_separation')
    return values, undetermined


def reach_of(level: float, freedom: float) -> float:
    """Return half an interval in standard deviations."""
    return float(special.stdtrit(max(FEWEST_FREEDOM, min(freedom, 1e6)), 0.5 + 0.5 * level))


def _disturbances(name: str, whole: Track, tracks: Sequence[Track]) -> List[Disturbance]:
    """Return the spans of a drive between its tracks, and their windows that are not used, in order."""
    starts_s = [whole.pose_times_s[0], *(track.pose_times_s[-1] for track in tracks)]
    ends_s = [*(track.pose_times_s[0] for track in tracks), whole.pose_times_s[-1]]
    found = [Disturbance(name, float(start), float(end), True) for start, end in zip(starts_s, ends_s) if end > start]
    for track in tracks:
        spans_s = np.column_stack((track.edges_s[:-1], track.edges_s[1:]))[~track.is_used].tolist()
        found += [Disturbance(name, start_s, end_s, False) for start_s, end_s in spans_s]
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
    """Return the parameters with other wheels and separation, without slip by motion."""
    changed = parameters.copy()
    changed[GEOMETRY] = np.log(geometry)
    changed[likelihood.BY_MOTION] = 0.0
    return changed


def sensor_path(track: Track, parameters: np.ndarray) -> np.ndarray:
    """Return (k, 3) poses of the sensor by odometry, on the reference by the rigid motion that fits best."""
    motions, path = odometry_path(track, parameters)
    target, turn = track.poses[:, 0] + 1j * track.poses[:, 1], _turn(track, path)
    placed = target.mean() + (path - path.mean()) * np.exp(1j * turn)
    return np.column_stack((placed.real, placed.imag, motions[:, 2] + turn + parameters[INDEX['reference_yaw_rad']]))


def start_heading(track: Track, parameters: np.ndarray, over_m: float) -> float:
    """Return the robot's heading at the start of a drive [rad], by which its first rows fit best."""
    motions, path = odometry_path(track, parameters)
    rows = rows_of_start(path, over_m)
    if track.has_yaw and abs(path[:rows] - path[0]).max() < LEAST_SIZE_M:  # turns in place
        yaws_rad = track.poses[:rows, 2] - motions[:rows, 2] - parameters[INDEX['reference_yaw_rad']]
        return float(np.angle(np.exp(1j * yaws_rad).mean()))
    return _turn(track, path[:rows])


def rows_of_start(path: np.ndarray, over_m: float) -> int:
    """Return the number of rows until the sensor is so far from its start, or half as far as it ever is."""
    away_m = abs(path - path[0])  # not the wheels' path: positions show the heading of a robot that turns badly
    return max(2, int(np.argmax(away_m >= min(over_m, 0.5 * away_m.max()))))


def odometry_path(track: Track, parameters: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return `Track.motions` at all rows of the reference, and the places of the sensor as complex numbers."""
    motions = track.motions(parameters, track.pose_times_s - parameters[INDEX['reference_delay_s']])
    return motions, motions[:, 0] + 1j * motions[:, 1] + complex(*parameters[3:5]) * np.exp(1j * motions[:, 2])


def _turn(track: Track, path: np.ndarray) -> float:
    """Return the turn that fits the first rows of the reference best."""
    target = track.poses[: len(path), 0] + 1j * track.poses[: len(path), 1]
    return float(np.angle(((path - path.mean()).conj() * (target - target.mean())).sum()))
