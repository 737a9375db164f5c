"""One encoder and its odometry, fed with recorded wheel angles."""

from __future__ import annotations

from typing import Optional, Tuple

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.drives.bag_output import ReencodedBag
from diff_encoder_sim.drives.sensor_messages import JointValues
from diff_encoder_sim.drives.trajectory_error import Alignment, PathComparison
from diff_encoder_sim.drives.trial_definition import Trial, with_encoder
from diff_encoder_sim.wheels.encoder_params import PerWheel, encoder_label
from diff_encoder_sim.wheels.odometry import OdometryEstimate, WheelOdometry, wheel_speeds_mps
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import EncoderSample
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder


class WheelsAtPpr:
    """Encoder and odometry at one PPR, as gz_diff_encoder_node and gz_diff_odom_node run them."""

    def __init__(self, ppr: PerWheel, encoder: EncoderParams, odometry: OdometryParams, name: str = '') -> None:
        """Prepare an encoder; `name` is that of a real one, with its parameters."""
        self.ppr, self.name = ppr, name
        self.comparison = PathComparison(Alignment.ORIGIN)
        self.reports = 0
        self.counts_by_command = encoder.encoder.counts_by_command
        self.bag: Optional[ReencodedBag] = None  # where messages are written; None: nowhere
        self.stamped_pose: Tuple[int, Pose2D] = (0, IDENTITY)  # the last, base in odom
        self._params = encoder.model_copy(update={'ppr': ppr})
        self._encoder = ReportingEncoder(self._params)
        self._odometry = WheelOdometry(odometry.model_copy(update={'ppr': ppr}))

    @property
    def label(self) -> str:
        """Return how tables call the encoder."""
        return encoder_label(self.ppr, self.name)

    def take_command(self, linear_mps: float, angular_radps: float) -> None:
        """Take a commanded twist, whose wheels tell the direction of counts that have none of their own."""
        separation_m = self._odometry.params.wheel_separation
        self._encoder.take_command(*wheel_speeds_mps(linear_mps, angular_radps, separation_m))

    def update(self, time_ns: int, joints: JointValues) -> bool:
        """Take one joint message that was recorded at `time_ns`; return whether it led to a new odometry pose.

        Raises:
            InputFault: the encoder drops the message.
        """
        has_moved = False
        for sample in self._encoder.update(*joints):
            has_moved = self._take_report(time_ns, sample) or has_moved
        return has_moved

    def _take_report(self, time_ns: int, sample: EncoderSample) -> bool:
        self.reports += 1
        estimate = self._odometry.update(*sample)
        self._write(time_ns, sample, estimate)
        if estimate is None:
            return False
        self.stamped_pose = estimate.stamp_ns, estimate.base_pose_in_odom
        return True

    def write_trial(self, time_ns: int, recorded: Trial) -> None:
        """Write the recorded trial as if it had been driven with this encoder."""
        if self.bag is not None:
            self.bag.trial(time_ns, with_encoder(recorded, self._params, self._odometry.params, self.name))

    def _write(self, time_ns: int, sample: EncoderSample, estimate: Optional[OdometryEstimate]) -> None:
        if self.bag is None:
            return
        self.bag.encoder_pulse(time_ns, sample)
        if estimate is not None:
            self.bag.odometry(time_ns, estimate)
