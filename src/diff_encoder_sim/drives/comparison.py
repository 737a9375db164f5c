"""Compares the odometry of an encoder with a reference, over sampled start angles of the wheels."""

from __future__ import annotations

import math
from typing import Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.kernels import compiled
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, PoseSeries, wrap_angles
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.reference import Reference
from diff_encoder_sim.drives.trajectory_error import (
    Alignment,
    Pairing,
    PathError,
    aligned,
    common_stamps,
    pairs_error,
    reference_stamps,
)
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import PROMPT
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

_AT_ONCE = 200_000  # poses, whose arrays fit a processor's cache
ERROR_NAMES = ('ate_m', 'end_position_m', 'end_yaw_rad')


class Spread(NamedTuple):
    """Median and 5 to 95 % over the draws."""

    median: float
    p5: float
    p95: float


class Errors(NamedTuple):
    """Errors of an encoder's odometry."""

    first: PathError  # of the first draw
    spreads: Dict[str, Spread]  # over all draws, of ERROR_NAMES, without signs
    of_draws: np.ndarray  # (draws, 3) of ERROR_NAMES


class SensorPlace(NamedTuple):
    """Where the sensor of a reference is on the robot, and how late its poses are."""

    pose: Pose2D = IDENTITY  # in the robot's base
    delay_s: float = 0.0  # positive: a pose shows the robot at an earlier time than its stamp

    def text(self) -> str:
        """Describe the place, empty for the base without delay."""
        if self == SensorPlace():
            return ''
        (x_m, y_m, yaw_rad), late = self.pose, f'delay {self.delay_s:g} s'
        return f'at x {x_m:g} m, y {y_m:g} m, yaw {math.degrees(yaw_rad):g} deg on the robot, {late}'


class DrawnPaths(NamedTuple):
    """Odometry of some draws."""

    first: int  # number of the first of these draws
    stamps_ns: np.ndarray  # (m,), common to them
    poses: np.ndarray  # (draws, m, 3) of the base in odom


class Comparison(NamedTuple):
    """Paths to compare odometry with."""

    name: str
    paths: List[PoseSeries]  # one for each part of the drive; yaw NaN if unknown
    place: SensorPlace = SensorPlace()
    is_own_clock: bool = False  # stamps are not those of the robot: compare at each of them

    @property
    def alignment(self) -> Alignment:
        """Return the alignment: that of the first poses needs their yaw."""
        return Alignment.FIT if any(np.isnan(path.x_y_yaw[:, 2]).any() for path in self.paths) else Alignment.ORIGIN

    def errors(
        self, paths: Sequence[PoseSeries], draws: int = 1, drawn: Sequence[Iterable[DrawnPaths]] = ()
    ) -> Optional[Errors]:
        """Compare the first draw's path in each part, and all draws if there are several; None without common poses."""
        pairs = [
            np.hstack(self._pairs(self._pairing(path.stamps_ns, part), path.x_y_yaw))
            for path, part in zip(paths, self.paths)
        ]
        first = pairs_error(pairs, self.alignment)
        if first is None:
            return None
        values = np.array([[first.ate_rmse_m, math.hypot(*first.end[:2]), abs(first.end.yaw_rad)]])
        if draws > 1:
            values = self._draw_errors(draws, drawn)
        found = np.percentile(values, [50.0, 5.0, 95.0], axis=0).T.tolist()
        return Errors(first, {name: Spread(*each) for name, each in zip(ERROR_NAMES, found)}, values)

    def along(self, paths: Sequence[PoseSeries]) -> Tuple[np.ndarray, np.ndarray]:
        """Return the times since the first common stamp [s] (n,) and the aligned pairs (n, 6) of all parts."""
        times_ns, pairs = [np.zeros(0)], [np.zeros((0, 6))]
        for (stamps_ns, x_y_yaw), reference in zip(paths, self.paths):
            pairing = self._pairing(stamps_ns, reference)
            if len(pairing.before):
                steps_ns = pairing.fractions * (stamps_ns[pairing.after] - stamps_ns[pairing.before])
                times_ns.append(stamps_ns[pairing.before] - stamps_ns[0] + steps_ns)
                pairs.append(aligned(np.hstack(self._pairs(pairing, x_y_yaw)), self.alignment))
        return 1e-9 * np.concatenate(times_ns), np.concatenate(pairs)

    def _pairing(self, stamps_ns: np.ndarray, reference: PoseSeries) -> Pairing:
        return (reference_stamps if self.is_own_clock else common_stamps)(stamps_ns, reference)

    def _pairs(self, pairing: Pairing, x_y_yaw: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Return the poses (..., n, 3) of the sensor by those of the base (..., m, 3), and of the reference (n, 3)."""
        poses, sensor = pairing.estimates(x_y_yaw), self.place.pose
        if sensor != IDENTITY:
            arms = complex(sensor.x_m, sensor.y_m) * np.exp(1j * poses[..., 2])
            poses += np.stack((arms.real, arms.imag, np.full(arms.shape, sensor.yaw_rad)), axis=-1)
        return poses, pairing.references

    def _draw_errors(self, draws: int, drawn: Sequence[Iterable[DrawnPaths]]) -> np.ndarray:
        """Return (draws, 3) ATE [m], distance [m] and heading error [rad] at the end, of each draw."""
        squares_m2, counts, ends = np.zeros(draws), np.zeros(draws), np.zeros((draws, 3))
        for parts, reference in zip(drawn, self.paths):
            for first, stamps_ns, poses in parts:
                pairs, some = self._pairs(self._pairing(stamps_ns, reference), poses), slice(first, first + len(poses))
                if len(pairs[1]):
                    found = _run_errors(*pairs, self.alignment is Alignment.FIT)
                    squares_m2[some] += found[:, 0]
                    counts[some] += len(pairs[1])
                    ends[some] = found[:, 1:]
        yaws_rad = np.abs(wrap_angles(ends[:, 2]))
        return np.column_stack((np.sqrt(squares_m2 / counts), np.hypot(ends[:, 0], ends[:, 1]), yaws_rad))


@compiled(nogil=True)
def _run_errors(poses: np.ndarray, references: np.ndarray, is_fit: bool) -> np.ndarray:
    """Return (draws, 4) the sum of squared distances [m^2], and the last x [m], y [m] and yaw [rad], of each draw.

    They are those of `pairs_error` for one run of poses (draws, n, 3), the yaw not wrapped.
    """
    errors, yaws_rad = np.zeros((len(poses), 4)), references[:, 2]
    true = references[:, 0] + 1j * references[:, 1]
    true = true - true.mean() if is_fit else (true - true[0]) * np.exp(-1j * yaws_rad[0])
    for draw in range(len(poses)):
        places, yaw_rad = poses[draw, :, 0] + 1j * poses[draw, :, 1], poses[draw, :, 2]
        places -= places.mean() if is_fit else places[0]
        rotation = np.exp(1j * (np.angle((np.conj(places) * true).sum()) if is_fit else -yaw_rad[0]))
        off = places * rotation - true
        errors[draw, 0] = (off.real**2 + off.imag**2).sum()
        errors[draw, 1], errors[draw, 2] = off[-1].real, off[-1].imag
        errors[draw, 3] = (yaw_rad[-1] - yaw_rad[0]) - (yaws_rad[-1] - yaws_rad[0])
    return errors


def of_reference(parts: Sequence[Reference], place: SensorPlace, is_own_clock: bool) -> Comparison:
    """Compare with a reference at the times of the robot."""
    delay_ns = round(place.delay_s * NANOSECONDS_PER_SECOND)
    paths = [PoseSeries(part.stamps_ns - delay_ns, part.poses) for part in parts]
    return Comparison(parts[0].name, paths, place, is_own_clock or delay_ns != 0)


def drawn_paths(
    encoder: EncoderParams,
    odometry: OdometryParams,
    drive: Drive,
    phases_rad: np.ndarray,
    commands: Optional[np.ndarray],
    rows: np.ndarray,
) -> Iterator[DrawnPaths]:
    """Yield the odometry of all draws (draws, 2), some with common stamps at a time; `rows` are those of reports."""
    is_prompt = encoder.is_ideal and encoder.report == PROMPT
    at_once = max(_AT_ONCE // max(len(rows), 1), 1) if is_prompt else len(phases_rad)  # errors are by number
    for first in range(0, len(phases_rad), at_once):
        some = phases_rad[first : first + at_once]
        run = Chain(encoder, odometry, len(some)).run(drive, some, commands, rows if is_prompt else None)
        poses, is_common = run.poses, bool((run.stamps_ns == run.stamps_ns[0]).all())
        for draw in [0] if is_common else range(len(some)):
            stamps_ns, of_draws = run.stamps_ns[draw], poses if is_common else poses[draw : draw + 1]
            is_new = np.diff(np.maximum.accumulate(stamps_ns), prepend=-1) > 0  # odometry ignores the others
            yield DrawnPaths(first + draw, stamps_ns[is_new], of_draws if is_new.all() else of_draws[:, is_new])
