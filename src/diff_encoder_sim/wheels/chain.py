"""The chain of a robot with wheel encoders: wheel angles, counts, reports, odometry with its covariance.

`Chain.step` processes one sample, for nodes and navigated trials; `Chain.run` processes a whole `Drive`, with a batch
axis. Both return the same numbers, bit for bit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.se2 import poses_of_wheels
from diff_encoder_sim.wheels.counter import totals_of, wrap_count
from diff_encoder_sim.wheels.encoder import new_wheels, pulses_from_angle, turn_through
from diff_encoder_sim.wheels.odometry import OdometryEstimate, WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import PROMPT, BoundarySampler, EncoderSample
from diff_encoder_sim.wheels.wheel_encoder import (
    EncoderParams,
    ReportingEncoder,
    is_ideal,
    jitters_ns,
    kind_of_wheel,
    report_link,
)


class ChainReport(NamedTuple):
    """A received report and the odometry after it."""

    sample: EncoderSample
    estimate: Optional[OdometryEstimate]  # None if the report is stale, or without odometry


@dataclass(frozen=True)
class ChainRun:
    """All reports of a drive, in order of arrival.

    Draws with fewer reports repeat their last report, which odometry ignores.

    Attributes:
        odometry: parameters of the odometry.
        rows: (draws, m) first row of the drive with a stamp at or after the arrival of the report.
        stamps_ns: (draws, m) stamps of the reports.
        counts: (draws, m, 2) int64, left and right, wrapped at the counter modulus.
        wheel_rates_radps: (draws, m, 2), or None if the controller measures no speeds.
    """

    odometry: OdometryParams
    rows: np.ndarray
    stamps_ns: np.ndarray
    counts: np.ndarray
    wheel_rates_radps: Optional[np.ndarray]

    def samples(self, draw: int = 0) -> List[EncoderSample]:
        """Return the reports of a draw."""
        stamps_ns, counts = self.stamps_ns[draw].tolist(), self.counts[draw].tolist()
        rates = [None] * len(counts) if self.wheel_rates_radps is None else self.wheel_rates_radps[draw].tolist()
        return [
            EncoderSample(stamp_ns, left, right, None if rate is None else (rate[0], rate[1]))
            for stamp_ns, (left, right), rate in zip(stamps_ns, counts, rates)
        ]

    def estimates(self, draw: int = 0) -> List[Optional[OdometryEstimate]]:
        """Return the odometry estimate, with its covariance, after each report of a draw; None if it is stale."""
        odometry = WheelOdometry(self.odometry)
        return [odometry.update(*sample) for sample in self.samples(draw)]

    @property
    def poses(self) -> np.ndarray:
        """Return (draws, m, 3) x [m], y [m], yaw [rad] in [-pi, pi) of the base after each report, from pose zero."""
        return self._poses(only_last=False)

    @property
    def final_poses(self) -> np.ndarray:
        """Return (draws, 3) the last poses."""
        return self._poses(only_last=True)[:, -1]

    def _poses(self, only_last: bool) -> np.ndarray:
        params = self.odometry
        totals = totals_of(params.counter_limits, self.stamps_ns, self.counts)
        return poses_of_wheels(totals, *params.m_per_pulse, params.wheel_separation, params.axle_x, only_last)


class Chain:
    """Encoders of both wheels, the link to the host, and odometry."""

    def __init__(self, encoder: EncoderParams, odometry: Optional[OdometryParams] = None, draws: int = 1) -> None:
        """Create the chain.

        Args:
            encoder: parameters of both wheels, with the seed of their errors.
            odometry: None for an encoder without odometry.
            draws: number of encoders with independent errors; `step` uses the first.
        """
        self.encoder, self.odometry, self._draws = encoder, odometry, draws
        self._encoders = ReportingEncoder(encoder)
        self._odometry = None if odometry is None else WheelOdometry(odometry)

    @property
    def needs_every_angle(self) -> bool:
        """Return whether angles between report boundaries affect reports; False for an ideal encoder."""
        return self._encoders.needs_every_angle

    def take_command(self, left: float, right: float) -> None:
        """Set the commanded wheel speeds; encoders without direction count by their sign."""
        self._encoders.take_command(left, right)

    def step(self, stamp_ns: int, left_rad: float, right_rad: float) -> List[ChainReport]:
        """Process the accumulated angles of both wheels [rad], and return the arriving reports.

        Raises:
            InputFault: the stamps do not advance.
        """
        samples = self._encoders.step(stamp_ns, left_rad, right_rad)
        update = self._odometry.update if self._odometry is not None else lambda *_: None
        return [ChainReport(sample, update(*sample)) for sample in samples]

    def run(
        self,
        drive: Drive,
        phases_rad: Optional[np.ndarray] = None,
        commands: Optional[np.ndarray] = None,
        rows: Optional[np.ndarray] = None,
    ) -> ChainRun:
        """Return all reports of a drive, as `step` of a new chain does.

        Args:
            drive: wheel angles common to all draws, or per draw.
            phases_rad: (draws, 2) initial wheel angles, added to the angles of each draw; None: 0.
            commands: (n, 2) newest commanded wheel speeds at each row; None: no commands.
            rows: (m,) rows of the drive at which the counters are read; None: at the boundaries of the report rate.
        """
        params = self.encoder
        read = _readings(drive.stamps_ns, params) if rows is None else _Readings(drive.stamps_ns, rows, rows)
        counts = np.zeros((self._draws, len(read.rows), 2), np.int64)
        rates_radps = np.zeros(counts.shape) if params.velocity_method != 'M' else None
        for wheel, side in enumerate(('left', 'right')):
            angles_rad = read.between(np.atleast_2d(drive.wheel_angles_rad[..., wheel]))
            if phases_rad is not None:
                angles_rad = angles_rad + phases_rad[:, wheel, np.newaxis]
            if is_ideal(params, side):
                counts[:, :, wheel] = pulses_from_angle(angles_rad[:, read.rows], getattr(params.counts_per_turn, side))
                continue
            directions = np.zeros(len(read.stamps_ns), np.int64)
            if commands is not None:
                directions = np.sign(commands[read.sources, wheel]).astype(np.int64)
            wheels, angles_rad = new_wheels(params.seed, side, self._draws), np.ascontiguousarray(angles_rad)
            counts[:, :, wheel], rates = turn_through(
                kind_of_wheel(params, side), wheels, read.stamps_ns, angles_rad, directions, read.rows
            )
            if rates_radps is not None:
                rates_radps[:, :, wheel] = rates
        counts, odometry = wrap_count(counts, params.counter_modulus), self.odometry or OdometryParams()
        read_ns = read.stamps_ns[read.rows]
        if params.report == PROMPT:
            taken, read_ns = (np.repeat(each[np.newaxis], self._draws, axis=0) for each in (read.taken, read_ns))
            return ChainRun(odometry, taken, read_ns, counts, rates_radps)
        arrivals = [_arrivals(params, draw, read_ns, read.taken, drive.stamps_ns) for draw in range(self._draws)]
        most = max(map(len, arrivals))
        padded = np.stack([np.pad(each, ((0, most - len(each)), (0, 0)), 'edge') for each in arrivals])
        taken, arrival_ns, readings = np.moveaxis(padded, 2, 0)
        arrived = np.arange(self._draws)[:, np.newaxis], readings
        rates_radps = None if rates_radps is None else rates_radps[arrived]
        return ChainRun(odometry, taken, arrival_ns, counts[arrived], rates_radps)


class _Readings(NamedTuple):
    """Reading times of the counters, at stamps of the drive or between them."""

    stamps_ns: np.ndarray  # (k,) of the drive, and between them
    rows: np.ndarray  # (m,) of these stamps, at which counters are read
    taken: np.ndarray  # (m,) row of the drive whose message leads to the reading
    passed: Optional[np.ndarray] = None  # (m,) of the interval to `taken`, if readings are between stamps of the drive

    @property
    def sources(self) -> np.ndarray:
        """Return the (k,) rows of the drive whose messages lead to the stamps."""
        rows = np.arange(len(self.stamps_ns) - (0 if self.passed is None else len(self.taken)))
        return rows if self.passed is None else np.insert(rows, self.taken, self.taken)

    def between(self, angles_rad: np.ndarray) -> np.ndarray:
        """Return (..., k) angles of (..., n) of the drive; linear between stamps."""
        if self.passed is None:
            return angles_rad
        last_rad, next_rad = angles_rad[:, self.taken - 1], angles_rad[:, self.taken]
        return np.insert(angles_rad, self.taken, last_rad + self.passed * (next_rad - last_rad), axis=1)


def _readings(stamps_ns: np.ndarray, params: EncoderParams) -> _Readings:
    """Return the readings at the boundaries of the report rate, delayed by the jitter."""
    sampler, row = BoundarySampler(params.rate), 0
    found: List[Tuple[int, Optional[int]]] = []
    while row < len(stamps_ns):
        found.append((row, sampler.period_index(int(stamps_ns[row]))))
        row = int(np.searchsorted(stamps_ns, sampler.next_ns))
    rows = np.array([row for row, index in found if index is not None], np.int64)
    jitters = jitters_ns(params)
    if not jitters:
        return _Readings(stamps_ns, rows, rows)
    late_ns = [jitters[index % len(jitters)] for _, index in found if index is not None]
    due_ns = stamps_ns[rows] + np.array(late_ns, np.int64)
    taken = np.searchsorted(stamps_ns, due_ns, side='right')
    due_ns, taken = due_ns[taken < len(stamps_ns)], taken[taken < len(stamps_ns)]
    passed = (due_ns - stamps_ns[taken - 1]) / (stamps_ns[taken] - stamps_ns[taken - 1])
    return _Readings(np.insert(stamps_ns, taken, due_ns), taken + np.arange(len(taken)), taken, passed)


def _arrivals(
    params: EncoderParams, draw: int, read_ns: np.ndarray, taken: np.ndarray, stamps_ns: np.ndarray
) -> np.ndarray:
    """Return (m, 3) row of the drive, stamp [ns] and reading of the reports of a draw, as they arrive."""
    link = report_link(params, draw)
    found: List[Tuple[int, int, int, int, int]] = []
    for reading, (stamp_ns, row) in enumerate(zip(read_ns.tolist(), taken.tolist())):
        for arrival_ns in link.arrivals_ns(stamp_ns):
            arrival_row = max(row, int(np.searchsorted(stamps_ns, arrival_ns)))
            found.append((arrival_row, arrival_ns, len(found), reading, stamp_ns))
    arrived = [
        (row, arrival_ns if params.report.stamps == 'arrival' else stamp_ns, reading)
        for row, arrival_ns, _, reading, stamp_ns in sorted(found)
        if row < len(stamps_ns)
    ]
    return np.array(arrived, np.int64).reshape(-1, 3)
