"""Reads a recorded drive once, for encoders of several PPR at the same time."""

from __future__ import annotations

from typing import List, NamedTuple, Optional, Sequence

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.bag_messages import Message
from diff_encoder_sim.drives.bag_output import copied_topics
from diff_encoder_sim.drives.dropped_messages import DroppedMessages
from diff_encoder_sim.drives.message_types import TWIST_TYPE
from diff_encoder_sim.drives.reference import Reference
from diff_encoder_sim.drives.sensor_messages import JointValues, decode_command
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.drives.wheel_source import DriveStream, WheelSource
from diff_encoder_sim.drives.wheels_at_ppr import WheelsAtPpr


class DriveSummary(NamedTuple):
    """What was read of a drive."""

    messages: int  # of the wheels
    duration_s: float  # between the first and the last of them, by the recorder's clock
    faults: List[str]  # one line for each topic


def has_commands(source: DriveStream) -> bool:
    """Return whether a drive has the commands that encoders may count by."""
    return source.topics.get(topics.CMD_VEL) == TWIST_TYPE


class Reencoder:
    """Feeds a recorded drive to every PPR, and compares each one's odometry with a reference."""

    def __init__(self, wheels: WheelSource, reference: Optional[Reference], runs: Sequence[WheelsAtPpr]) -> None:
        """Prepare to read.

        Args:
            wheels: where the angles come from.
            reference: what every path is compared with; None for the path of the finest encoder, an ideal one if any.
            runs: with one encoder each.
        """
        self._wheels, self._reference, self._runs = wheels, reference, runs
        self._finest = max(runs, key=lambda run: (not run.name, min(run.ppr.left, run.ppr.right)))
        self._dropped = DroppedMessages()
        self._messages, self._first_ns, self._last_ns = 0, 0, 0

    def run(self, source: DriveStream, trial: Optional[Trial]) -> DriveSummary:
        """Read the drive to its end.

        Args:
            source: the drive.
            trial: which the bag was recorded in; None for another drive.

        Raises:
            OSError: a bag cannot be written.
        """
        reference = self._reference.topics if self._reference else ()
        copied, of_wheels, commands = copied_topics(source), self._wheels.topics, self._command_topics(source)
        others = *commands, *([topics.TRIAL] if trial else [])
        for message in source.messages((*of_wheels, *reference, *copied, *others)):
            if message.topic in commands:
                self._take_command(message, source.is_cdr)
            if message.topic in of_wheels:
                self._take_wheels(message)
            if self._reference and message.topic in reference:
                self._take_reference(self._reference, message)
            if message.topic in copied:
                self._copy(message, source.is_cdr)
            if trial and message.topic == topics.TRIAL:
                self._write_trial(message.time_ns, trial)
        duration_s = (self._last_ns - self._first_ns) / NANOSECONDS_PER_SECOND
        return DriveSummary(self._messages, duration_s, list(self._dropped.lines()))

    def _command_topics(self, source: DriveStream) -> Sequence[str]:
        """Return the topic of commands where an encoder needs them and the drive has them."""
        is_needed = any(run.counts_by_command for run in self._runs)
        return [topics.CMD_VEL] if is_needed and has_commands(source) else []

    def _take_command(self, message: Message, is_cdr: bool) -> None:
        try:
            command = decode_command(message.raw, is_cdr)
        except InputFault as fault:
            self._dropped.add(message.topic, fault)
            return
        for run in self._runs:
            run.take_command(*command)

    def _take_wheels(self, message: Message) -> None:
        if self._messages == 0:
            self._first_ns = self._last_ns = message.time_ns
        self._messages += 1
        self._first_ns, self._last_ns = min(self._first_ns, message.time_ns), max(self._last_ns, message.time_ns)
        try:
            for joints in self._wheels.angles(message):
                self._compare(self._update(message, joints))
        except InputFault as fault:
            self._dropped.add(message.topic, fault)

    def _update(self, message: Message, joints: JointValues) -> List[WheelsAtPpr]:
        """Return those whose odometry has a new pose; all drop the same messages, but report at their own times."""
        moved, dropped = [], None
        for run in self._runs:
            try:
                if run.update(message.time_ns, joints):
                    moved.append(run)
            except InputFault as fault:
                dropped = fault
        if dropped is not None:
            self._dropped.add(message.topic, dropped)
        return moved

    def _compare(self, moved: Sequence[WheelsAtPpr]) -> None:
        if self._reference is None and self._finest in moved:
            for run in self._runs:
                if run is not self._finest:
                    run.comparison.take_reference(*self._finest.stamped_pose)
        for run in moved:
            if self._reference is not None or run is not self._finest:
                run.comparison.take_estimate(*run.stamped_pose)

    def _take_reference(self, reference: Reference, message: Message) -> None:
        try:
            for stamped in reference.poses(message):
                for run in self._runs:
                    run.comparison.take_reference(stamped.stamp_ns, stamped.pose)
        except InputFault as fault:
            self._dropped.add(message.topic, fault)

    def _copy(self, message: Message, is_cdr: bool) -> None:
        try:
            for run in self._runs:
                if run.bag is not None:
                    run.bag.copy(message, is_cdr)
        except InputFault as fault:
            self._dropped.add(message.topic, fault)

    def _write_trial(self, time_ns: int, trial: Trial) -> None:
        for run in self._runs:
            run.write_trial(time_ns, trial)
