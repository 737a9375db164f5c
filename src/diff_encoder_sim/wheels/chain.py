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
from diff_encoder_sim.wheels.encoder import kinds_of, new_wheels, pulses_from_angle, turn_through
from diff_encoder_sim.wheels.odometry import OdometryEstimate, WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import PROMPT, BoundarySampler, EncoderSample, ReportLink
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder


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
        """Create `draws` encoders with independent errors, of which `step` uses the first; `odometry` may be None."""
        self.encoder, self.odometry, self._draws = encoder, odometry, draws
        self.encoders = ReportingEncoder(encoder)
        self._odometry = None if odometry is None else WheelOdometry(odometry)

    def step(self, stamp_ns: int, left_rad: float, right_rad: float) -> List[ChainReport]:
        """Process accumulated angles of both wheels [rad]; return arriving reports. InputFault for a stale stamp."""
        samples = self.encoders.step(stamp_ns, left_rad, right_rad)
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
        params, stamps_ns = self.encoder, drive.stamps_ns
        rows, read_ns = _readings(stamps_ns, params) if rows is None else (rows, stamps_ns[rows])
        angles_rad = drive.wheel_angles_rad.reshape(-1, len(stamps_ns), 2)
        phases_rad = np.zeros((self._draws, 2)) if phases_rad is None else phases_rad
        counts, rates_radps = np.zeros((self._draws, len(rows), 2), np.int64), None
        if params.is_ideal:
            read_rad = angles_rad if len(rows) == len(stamps_ns) else angles_rad[:, rows]
            for wheel, (_, ppr) in enumerate(params.counts_per_turn):
                turned_rad = read_rad[..., wheel] + phases_rad[:, wheel, np.newaxis]
                counts[:, :, wheel] = pulses_from_angle(turned_rad, ppr)
        else:
            commands = np.zeros((len(stamps_ns), 2)) if commands is None else np.asarray(commands, float)
            wheels, turned_rad = new_wheels(params.seed, self._draws), (np.ascontiguousarray(angles_rad), phases_rad)
            counts, rates_radps = turn_through(kinds_of(params), wheels, stamps_ns, *turned_rad, commands, read_ns)
        counts = wrap_count(counts, params.counter_modulus)
        rates_radps = None if params.velocity_method == 'M' else rates_radps
        odometry, draws = self.odometry or OdometryParams(), np.arange(self._draws)[:, np.newaxis]
        if params.report == PROMPT:
            rows, read_ns = (np.broadcast_to(each, (self._draws, len(each))) for each in (rows, read_ns))
            return ChainRun(odometry, rows, read_ns, counts, rates_radps)
        arrivals = [_arrivals(params, draw, read_ns, rows, stamps_ns) for draw in range(self._draws)]
        most = max(map(len, arrivals))
        padded = np.stack([np.pad(each, ((0, most - len(each)), (0, 0)), 'edge') for each in arrivals])
        rows, arrival_ns, readings = np.moveaxis(padded, 2, 0)
        rates_radps = None if rates_radps is None else rates_radps[draws, readings]
        return ChainRun(odometry, rows, arrival_ns, counts[draws, readings], rates_radps)


def _readings(stamps_ns: np.ndarray, params: EncoderParams) -> Tuple[np.ndarray, np.ndarray]:
    """Return the (m,) rows that lead to readings, and their times, at the boundaries of the report rate and later."""
    sampler, row = BoundarySampler(params.rate), 0
    found: List[Tuple[int, int]] = []
    while row < len(stamps_ns):
        index = sampler.period_index(int(stamps_ns[row]))
        if index is not None:
            found.append((row, index))
        row = int(np.searchsorted(stamps_ns, sampler.next_ns))
    rows, indices = np.array(found, np.int64).reshape(-1, 2).T
    jitters_ns = params.report.jitters_ns(1.0 / params.rate, params.seed)
    read_ns = stamps_ns[rows] + jitters_ns[indices % len(jitters_ns)]
    rows = np.searchsorted(stamps_ns, read_ns)
    return rows[rows < len(stamps_ns)], read_ns[rows < len(stamps_ns)]


def _arrivals(
    params: EncoderParams, draw: int, read_ns: np.ndarray, rows: np.ndarray, stamps_ns: np.ndarray
) -> np.ndarray:
    """Return (m, 3) row of the drive, stamp [ns] and reading of the reports of a draw, as they arrive."""
    link = ReportLink(params.report, 1.0 / params.rate, params.seed, draw)
    sent = [(late_ns, reading) for reading, at_ns in enumerate(read_ns.tolist()) for late_ns in link.arrivals_ns(at_ns)]
    arrival_ns, readings = np.array(sorted(sent), np.int64).reshape(-1, 2).T
    arrival_rows = np.maximum(rows[readings], np.searchsorted(stamps_ns, arrival_ns))
    report_ns = arrival_ns if params.report.stamps == 'arrival' else read_ns[readings]
    return np.asarray(np.column_stack([arrival_rows, report_ns, readings])[arrival_rows < len(stamps_ns)])
