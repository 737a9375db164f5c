"""UMBmark: systematic errors of odometry from squares that are driven in both directions.

Borenstein and Feng, "Measurement and correction of systematic odometry errors in mobile robots", IEEE Transactions on
Robotics and Automation 12 (1996). The paper's equations are for small angles; here the wheels' rotations are integrated
with the geometry that fits best to the ends, so that 3 % are corrected as well as 0.1 %.
"""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D, poses_of_wheels
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.reference import Reference

optimize = deferred('scipy.optimize')

REST_NS, REST_RAD = 3 * NANOSECONDS_PER_SECOND // 10, 0.01  # a robot rests if no wheel turns by more in this time
LEAST_SIDE_M = 0.5
CLOSED_RAD, CLOSED_SIDES = 0.25 * math.pi, 0.75  # a square ends, by odometry, as close to its start

DIRECTIONS = ('cw', 'ccw')
LENGTHS = ('left_wheel_diameter_m', 'right_wheel_diameter_m', 'wheel_separation_m')


class WheelGeometry(NamedTuple):
    """What odometry assumes."""

    left_diameter_m: float
    right_diameter_m: float
    separation_m: float

    @property
    def radii_m(self) -> Tuple[float, float]:
        """Return the radii of the left and the right wheel."""
        return 0.5 * self.left_diameter_m, 0.5 * self.right_diameter_m

    def path(self, angles_rad: np.ndarray, axle_x_m: float = 0.0) -> np.ndarray:
        """Return (n, 3) poses, from 0, by (n, 2) angles of the wheels: of a base whose axle is ahead by `axle_x_m`."""
        return np.asarray(poses_of_wheels(angles_rad[np.newaxis], *self.radii_m, self.separation_m, axle_x_m, False)[0])


class Square(NamedTuple):
    """One square, from rest to rest."""

    is_clockwise: bool
    turned_rad: np.ndarray  # (n, 2) of the left and the right wheel since the start
    end_m: np.ndarray  # (2,) true end of the axle's middle in the frame of its start


class Umbmark(NamedTuple):
    """The result; the mean diameter is the nominal one: squares do not determine it."""

    squares: Tuple[int, int]  # clockwise, counter-clockwise
    centres_m: np.ndarray  # (2, 2) mean true minus odometry's end, x and y, clockwise and counter-clockwise
    e_d: float  # E_d: right over left diameter
    e_b: float  # E_b: true over nominal separation
    e_max_m: Tuple[float, float]  # E_max,syst before and after the correction: the larger distance of a centre from 0
    corrected: WheelGeometry

    def text(self) -> str:
        """Return the result for the terminal."""
        lines = (
            'UMBmark: {} squares clockwise, {} counter-clockwise'.format(*self.squares),
            f'  E_d (right / left wheel)         {self.e_d:.5f}',
            f'  E_b (true / nominal separation)  {self.e_b:.5f}',
            '  E_max,syst                       {:.4f} m before, {:.4f} m after'.format(*self.e_max_m),
        )
        return '\n'.join(lines)

    def as_json(self) -> Dict[str, Any]:
        """Return the result for a JSON file; lengths in metres."""
        return {
            'e_d': self.e_d,
            'e_b': self.e_b,
            **dict(zip(('e_max_syst_before_m', 'e_max_syst_after_m'), self.e_max_m)),
            **{f'centre_{name}_m': centre.tolist() for name, centre in zip(DIRECTIONS, self.centres_m)},
            **dict(zip(LENGTHS, self.corrected)),
        }


def umbmark(squares: Sequence[Square], nominal: WheelGeometry) -> Umbmark:
    """Find the wheels and the separation that fit the ends of squares; ConfigError unless there is one each way."""
    is_clockwise = np.array([square.is_clockwise for square in squares], bool)
    counts = int(is_clockwise.sum()), int((~is_clockwise).sum())
    if not all(counts):
        given = f'given {counts[0]} clockwise and {counts[1]} counter-clockwise'
        raise ConfigError(f'squares from rest to rest: {given}; allowed: at least one of each')

    def centres_m(geometry: WheelGeometry) -> np.ndarray:
        errors_m = np.array([each.end_m - geometry.path(each.turned_rad)[-1, :2] for each in squares])
        return np.array([errors_m[is_clockwise].mean(axis=0), errors_m[~is_clockwise].mean(axis=0)])

    def geometry_of(e_d: float, e_b: float) -> WheelGeometry:
        left_m = 2.0 * sum(nominal.radii_m) / (1.0 + e_d)
        return WheelGeometry(left_m, e_d * left_m, e_b * nominal.separation_m)

    start = nominal.right_diameter_m / nominal.left_diameter_m, 1.0
    fit = optimize.least_squares(lambda found: centres_m(geometry_of(*found)).ravel(), start, x_scale=0.01)
    e_d, e_b = fit.x.tolist()
    corrected = geometry_of(e_d, e_b)
    before_m, after_m = (float(np.hypot(*centres_m(each).T).max()) for each in (nominal, corrected))
    return Umbmark(counts, centres_m(nominal), e_d, e_b, (before_m, after_m), corrected)


def squares_of_ends(ends_cw: np.ndarray, ends_ccw: np.ndarray, side_m: float, nominal: WheelGeometry) -> List[Square]:
    """Return the squares of a robot whose odometry believes that each of them closes, as in the paper.

    Clockwise (n, 2) and counter-clockwise (m, 2) ends [m] are seen from the start, x along the first side, y left.
    """
    rim_m = 0.25 * math.pi * nominal.separation_m  # of a wheel in a quarter turn in place
    squares = []
    for is_clockwise, ends_m, left_m in ((True, ends_cw, rim_m), (False, ends_ccw, -rim_m)):
        ways_m = np.cumsum([(0.0, 0.0), *[(side_m, side_m), (left_m, -left_m)] * 4], axis=0)
        squares += [Square(is_clockwise, ways_m / nominal.radii_m, end_m) for end_m in ends_m]
    return squares


def find_squares(drive: Drive, reference: Reference, nominal: WheelGeometry) -> List[Square]:
    """Find the parts of a drive, from rest to rest, that odometry believes to be closed squares.

    The poses of the reference are those of the axle's middle; ConfigError if they have no yaw.
    """
    if np.isnan(reference.poses).any():
        raise ConfigError(f'{reference.name}: given positions without yaw; allowed for UMBmark: poses, or --ends')
    true = [*reference.poses[:, :2].T, np.unwrap(reference.poses[:, 2])]
    angles_rad, odometry = drive.wheel_angles_rad, nominal.path(drive.wheel_angles_rad)
    heading_rad = np.unwrap(odometry[:, 2])
    length_m = np.append(0.0, np.cumsum(np.abs(np.diff(angles_rad, axis=0) @ nominal.radii_m))) / 2.0
    squares: List[Square] = []
    rests, after = _rests(drive.stamps_ns, angles_rad), 0
    for start, end in itertools.combinations(rests, 2):
        turn_rad, side_m = heading_rad[end] - heading_rad[start], 0.25 * (length_m[end] - length_m[start])
        away_m = math.hypot(*(odometry[end, :2] - odometry[start, :2]).tolist())
        is_closed = abs(abs(turn_rad) - 2.0 * math.pi) < CLOSED_RAD and away_m < CLOSED_SIDES * side_m
        if start >= after and is_closed and side_m > LEAST_SIDE_M:
            stamps_ns = drive.stamps_ns[[start, end]]
            first, last = map(Pose2D, *(np.interp(stamps_ns, reference.stamps_ns, column).tolist() for column in true))
            end_m = np.array(last.relative_to(first)[:2])
            squares.append(Square(turn_rad < 0.0, angles_rad[start : end + 1] - angles_rad[start], end_m))
            after = end
    return squares


def _rests(stamps_ns: np.ndarray, angles_rad: np.ndarray) -> List[int]:
    """Return the sample in the middle of each time at which the robot rests, and the first and last of the drive."""
    later = np.searchsorted(stamps_ns, stamps_ns + REST_NS)
    has_later = later < len(stamps_ns)
    moved_rad = np.abs(angles_rad[later[has_later]] - angles_rad[has_later]).max(axis=1, initial=0.0)
    changes = np.diff(np.concatenate([[0], moved_rad < REST_RAD, [0]]))
    times = zip(np.flatnonzero(changes > 0).tolist(), np.flatnonzero(changes < 0).tolist())
    return [0, *((first + int(later[end - 1])) // 2 for first, end in times), len(stamps_ns) - 1]


def read_ends(path: Path) -> Tuple[np.ndarray, np.ndarray]:
    """Read ends (n, 2) of clockwise and (m, 2) of counter-clockwise squares: lines of cw or ccw, x, y [m].

    ConfigError if the file cannot be read, or a line is bad.
    """
    ends_m: Dict[str, List[Tuple[float, float]]] = {name: [] for name in DIRECTIONS}
    try:
        lines = path.read_text(encoding='utf-8').splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f'{path}: cannot be read: {error}') from None
    for number, line in enumerate(lines, 1):
        words = line.replace(',', ' ').split()
        if not words or (number == 1 and words[0] not in ends_m):
            continue  # a header
        try:
            direction, x, y = words
            if not math.isfinite(float(x) + float(y)):
                raise ValueError
            ends_m[direction].append((float(x), float(y)))
        except (ValueError, KeyError):
            raise ConfigError(f'{path}: line {number}: given {line}; allowed: cw or ccw, x, y in metres') from None
    clockwise_m, counter_m = (np.array(ends_m[name]).reshape(-1, 2) for name in DIRECTIONS)
    return clockwise_m, counter_m
