"""From wheel angles to what encoder and odometry would have made of them at another PPR."""

from __future__ import annotations

from collections import Counter
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.encoders.pulses import PerWheel
from diff_encoder_sim.encoders.wheel_encoder import DiffEncoder, EncoderParams
from diff_encoder_sim.evaluation.trajectory_error import Alignment, PathComparison
from diff_encoder_sim.odometry.wheel_odometry import OdometryParams, WheelOdometry
from diff_encoder_sim.recording import topics
from diff_encoder_sim.recording.bag_source import BagSource
from diff_encoder_sim.reencoding.bag_output import ReencodedBag, copied_topics
from diff_encoder_sim.reencoding.reencoded_trial import with_encoder
from diff_encoder_sim.reencoding.reference import Reference
from diff_encoder_sim.reencoding.wheels import CountedAngles, WheelTopic
from diff_encoder_sim.serialization.joint_messages import JointDecoder, JointValues
from diff_encoder_sim.serialization.ros1_stream import Message
from diff_encoder_sim.trials.trial_definition import Trial


class Faults:
    """Messages that were dropped: how many, and why the first was."""

    def __init__(self) -> None:
        self._first: Dict[str, str] = {}  # by topic
        self._counts: Counter = Counter()

    def add(self, topic: str, fault: InputFault) -> None:
        """One message of a topic."""
        self._counts[topic] += 1
        self._first.setdefault(topic, str(fault))

    def lines(self) -> Iterator[str]:
        """One for each topic."""
        for topic, count in self._counts.items():
            yield f'{topic}: {count} messages dropped; of the first: {self._first[topic]}'


class WheelsAtPpr:
    """One encoder with its odometry, as gz_diff_encoder_node and gz_diff_odom_node hold them."""

    def __init__(self, ppr: PerWheel, encoder: EncoderParams, odometry: OdometryParams) -> None:
        self.ppr = ppr
        self.comparison = PathComparison(Alignment.ORIGIN)
        self.reports = 0
        self.bag: Optional[ReencodedBag] = None  # what is published goes there
        self.stamped_pose: Tuple[int, Pose2D] = (0, IDENTITY)  # the last, base in odom
        self._encoder = DiffEncoder(encoder.model_copy(update={'ppr': ppr}))
        self._odometry = WheelOdometry(odometry.model_copy(update={'ppr': ppr}))

    def update(self, time_ns: int, joints: JointValues) -> bool:
        """Take one joint message that was recorded at `time_ns`; whether odometry came of it.

        Raises:
            InputFault: the encoder drops the message.
        """
        sample = self._encoder.update(*joints)
        if sample is None:
            return False
        self.reports += 1
        estimate = self._odometry.update(*sample)
        if self.bag is not None:
            self.bag.encoder_pulse(time_ns, sample)
            if estimate is not None:
                self.bag.odometry(time_ns, estimate)
        if estimate is None:
            return False
        self.stamped_pose = estimate.stamp_ns, estimate.base_pose_in_odom
        return True

    def trial(self, recorded: Trial) -> Trial:
        """The recorded trial, had it been driven with this encoder."""
        return with_encoder(recorded, self.ppr, self._odometry.params)


class DriveSummary(NamedTuple):
    """What was read of a drive."""

    messages: int  # of the wheels
    duration_s: float  # between the first and the last of them, by the recorder's clock
    faults: List[str]  # one line for each topic


class Reencoder:
    """Lets a recorded drive pass by every PPR at once, and compares where each says it went."""

    def __init__(
        self,
        wheels: WheelTopic,
        reference: Optional[Reference],
        runs: Sequence[WheelsAtPpr],
        is_cdr: bool,
        counter_modulus: int,
    ) -> None:
        """Args:
        wheels: where the angles come from.
        reference: what every path is compared with; None for the path at the finest PPR.
        runs: by PPR.
        is_cdr: whether the bag is of ROS 2.
        counter_modulus: of recorded counts.
        """
        self._topic, self._reference, self._runs = wheels.topic, reference, runs
        self._finest = max(runs, key=lambda run: min(run.ppr.left, run.ppr.right))
        self._decoder = JointDecoder(wheels.message_type, is_cdr)
        self._counted = CountedAngles(wheels, counter_modulus) if wheels.ppr else None
        self._faults = Faults()
        self._messages, self._first_ns, self._last_ns = 0, 0, 0

    def run(self, source: BagSource, trial: Optional[Trial]) -> DriveSummary:
        """Read the drive to its end.

        Args:
            source: the bag.
            trial: what the bag is of; None when it is no trial's.

        Raises:
            OSError: a bag cannot be written.
        """
        reference = self._reference.topics if self._reference else ()
        copied = [*copied_topics(source), *([topics.TRIAL] if trial else [])]
        for message in source.messages((self._topic, *reference, *copied)):
            if message.topic == self._topic:
                self._take_wheels(message)
                continue
            if message.topic in reference:
                self._take_reference(message)
            if message.topic in copied:
                self._copy(message, trial)
        duration_s = (self._last_ns - self._first_ns) / NANOSECONDS_PER_SECOND
        return DriveSummary(self._messages, duration_s, list(self._faults.lines()))

    def _take_wheels(self, message: Message) -> None:
        if self._messages == 0:
            self._first_ns = message.time_ns
        self._messages, self._last_ns = self._messages + 1, message.time_ns
        try:
            joints = self._decoder.decode(message.raw)
        except InputFault as fault:
            self._faults.add(self._topic, fault)
            return
        if self._counted is not None:
            joints = self._counted.angles(joints)
        if self._update(message.time_ns, joints):
            self._compare()

    def _update(self, time_ns: int, joints: JointValues) -> bool:
        """Whether odometry came of it; all encoders read and drop the same messages."""
        has_moved, dropped = False, None
        for run in self._runs:
            try:
                has_moved = run.update(time_ns, joints)
            except InputFault as fault:
                dropped = fault
        if dropped is not None:
            self._faults.add(self._topic, dropped)
        return has_moved

    def _compare(self) -> None:
        for run in self._runs:
            if self._reference is None and run is not self._finest:
                run.comparison.take_reference(*self._finest.stamped_pose)
            if self._reference is not None or run is not self._finest:
                run.comparison.take_estimate(*run.stamped_pose)

    def _take_reference(self, message: Message) -> None:
        try:
            for stamped in self._reference.poses(message):
                for run in self._runs:
                    run.comparison.take_reference(stamped.stamp_ns, stamped.pose)
        except InputFault as fault:
            self._faults.add(message.topic, fault)

    def _copy(self, message: Message, trial: Optional[Trial]) -> None:
        for run in self._runs:
            if run.bag is None:
                continue
            if message.topic == topics.TRIAL:
                run.bag.trial(message.time_ns, run.trial(trial))
            else:
                run.bag.copy(message)
