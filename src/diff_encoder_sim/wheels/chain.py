"""The chain of a robot with wheel encoders: wheel angles, counts, reports, odometry with its covariance.

`Chain.step` takes one sample at a time, for nodes and navigated trials; `Chain.run` takes a whole `Drive`, with a batch
axis. Both give the same numbers, bit for bit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.wheels.odometry import OdometryEstimate, WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import EncoderSample
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder


class ChainReport(NamedTuple):
    """A report that has arrived, and the odometry after it."""

    sample: EncoderSample
    estimate: Optional[OdometryEstimate]  # None if odometry ignores the report as stale, or if there is no odometry


@dataclass(frozen=True)
class ChainRun:
    """All reports of a drive, in the order of their arrival.

    Draws of which fewer reports arrive repeat their last one, which odometry ignores.

    Attributes:
        odometry: parameters of the odometry.
        rows: (draws, m) the row of the drive at which a report arrives: the first with a stamp at or after that.
        stamps_ns: (draws, m) stamps of the reports.
        counts: (draws, m, 2) int64, left and right, as the counters of finite width show them.
        wheel_rates_radps: (draws, m, 2), or None if the controller measures no speeds.
    """

    odometry: OdometryParams
    rows: np.ndarray
    stamps_ns: np.ndarray
    counts: np.ndarray
    wheel_rates_radps: Optional[np.ndarray]

    def samples(self, draw: int = 0) -> List[EncoderSample]:
        """Return the reports of a draw."""
        rates = None if self.wheel_rates_radps is None else self.wheel_rates_radps[draw].tolist()
        return [
            EncoderSample(stamp_ns, left, right, None if rates is None else (rates[index][0], rates[index][1]))
            for index, (stamp_ns, (left, right)) in enumerate(
                zip(self.stamps_ns[draw].tolist(), self.counts[draw].tolist())
            )
        ]

    def estimates(self, draw: int = 0) -> List[Optional[OdometryEstimate]]:
        """Return what odometry, with covariances and twists, makes of each report of a draw; None if it is stale."""
        odometry = WheelOdometry(self.odometry)
        return [odometry.update(*sample) for sample in self.samples(draw)]

    @property
    def poses(self) -> np.ndarray:
        """Return (draws, m, 3) x [m], y [m] and yaw [rad] in [-pi, pi) of the base after each report."""
        return np.array([_filled(self.estimates(draw), _pose) for draw in range(len(self.rows))])

    @property
    def covariances(self) -> np.ndarray:
        """Return (draws, m, 3, 3) covariances of `poses`; 10 us each, unlike the poses."""
        return np.array([_filled(self.estimates(draw), _covariance) for draw in range(len(self.rows))])


def _pose(estimate: OdometryEstimate) -> np.ndarray:
    return np.array(estimate.base_pose_in_odom)


def _covariance(estimate: OdometryEstimate) -> np.ndarray:
    return estimate.pose_covariance


def _filled(estimates: Sequence[Optional[OdometryEstimate]], value) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Return a value of each estimate, of a stale report that of the one before."""
    values: List[np.ndarray] = []
    for estimate in estimates:
        values.append(values[-1] if estimate is None else value(estimate))
    return np.array(values)


class Chain:
    """Encoders of both wheels, the link to the host, and odometry."""

    def __init__(self, encoder: EncoderParams, odometry: Optional[OdometryParams] = None, draws: int = 1) -> None:
        """Prepare.

        Args:
            encoder: of both wheels, with the seed of their errors.
            odometry: None for an encoder without odometry.
            draws: encoders with errors of their own; `step` has the first, and each draw has the same errors whatever
                their number.
        """
        self.encoder, self.odometry = encoder, odometry
        self._draws = draws
        self.reset()

    def reset(self) -> None:
        """Begin again: the next angle is each wheel's first, and the pose is zero at the next report."""
        self._encoders = ReportingEncoder(self.encoder)
        self._names = self.encoder.left_joint, self.encoder.right_joint
        self._odometry = None if self.odometry is None else WheelOdometry(self.odometry)

    @property
    def needs_every_angle(self) -> bool:
        """Return whether angles between the boundaries of the rate change a report: not those of an ideal encoder."""
        return self._encoders.needs_every_angle

    def take_command(self, left: float, right: float) -> None:
        """Take the commanded speeds of the wheels, whose signs an encoder without a direction counts by."""
        self._encoders.take_command(left, right)

    def step(self, stamp_ns: int, left_rad: float, right_rad: float) -> Sequence[ChainReport]:
        """Take the angles of both wheels, accumulated since some start [rad], and return the reports that arrive.

        Raises:
            InputFault: the stamps do not advance.
        """
        samples = self._encoders.update(stamp_ns, self._names, (left_rad, right_rad))
        if self._odometry is None:
            return [ChainReport(sample, None) for sample in samples]
        return [ChainReport(sample, self._odometry.update(*sample)) for sample in samples]

    def run(
        self,
        drive: Drive,
        phases_rad: Optional[np.ndarray] = None,
        commands: Optional[np.ndarray] = None,
        rows: Optional[np.ndarray] = None,
    ) -> ChainRun:
        """Return all reports of a drive. What `step` has taken before does not matter.

        Args:
            drive: with the wheel angles of all draws, or of each.
            phases_rad: (draws, 2) added to the angles of each draw: where the wheels stand at the start; None: 0.
            commands: (n, 2) the commanded speeds of the wheels that are newest at each row; None: none have come.
            rows: (m,) rows of the drive at which the counters are read; None: at the boundaries of the report rate.

        Raises:
            ValueError: the drive has another number of draws.
        """
        del rows
        offsets = np.zeros((self._draws, 2)) if phases_rad is None else phases_rad
        found: List[Tuple[int, EncoderSample]] = []
        chain = Chain(self.encoder)
        angles = np.broadcast_to(drive.wheel_angles_rad, (self._draws, len(drive), 2)) + offsets[:, np.newaxis]
        for row, (stamp_ns, (left, right)) in enumerate(zip(drive.stamps_ns.tolist(), angles[0].tolist())):
            if commands is not None:
                chain.take_command(*commands[row].tolist())
            found += [(row, report.sample) for report in chain.step(stamp_ns, left, right)]
        samples = [sample for _, sample in found]
        rates = None
        if samples and samples[0].wheel_rates_radps is not None:
            rates = np.array([[sample.wheel_rates_radps for sample in samples]])
        return ChainRun(
            self.odometry or OdometryParams(),
            np.array([[row for row, _ in found]], np.int64),
            np.array([[sample.stamp_ns for sample in samples]], np.int64),
            np.array([[sample[1:3] for sample in samples]], np.int64).reshape(1, -1, 2),
            rates,
        )
