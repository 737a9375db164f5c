"""Wheel angles from the counts of EncoderPulse, across wraps and restarts of the counters."""

from __future__ import annotations

from typing import Iterator, List, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.bag_source import Message
from diff_encoder_sim.drives.sensor_messages import JointDecoder
from diff_encoder_sim.drives.topics import ENCODER_PULSE_TYPE
from diff_encoder_sim.drives.wheel_source import (
    TimedDrive,
    WheelNumbers,
    angles_of_counts_rad,
    ascending_runs,
    paired_drives,
)
from diff_encoder_sim.wheels.counter import CounterSteps, Reading
from diff_encoder_sim.wheels.encoder_params import PerWheel
from diff_encoder_sim.wheels.odometry_params import OdometryParams


class PulseWheels:
    """Reads the counts of a topic."""

    are_joint_angles = False

    def __init__(
        self,
        topic: str,
        joints: Tuple[str, str],
        is_cdr: bool,
        odometry: OdometryParams,
        about: str,
        notes: Sequence[str],
    ) -> None:
        """Prepare to read.

        Args:
            topic: of EncoderPulse.
            joints: left, right.
            is_cdr: of ROS 2.
            odometry: which could be fed with the counts: their resolution, where they wrap, how fast wheels can turn.
            about: how the counts are read, for the reader.
            notes: what the counts cannot show.
        """
        self.topics: Tuple[str, ...] = (topic,)
        self.joints = joints
        self.ppr: Optional[PerWheel] = odometry.counts_per_turn
        self.text = f'messages of {topic} ({", ".join(joints)}; {about})'
        self.restarts = 0  # of the counters
        self._odometry, self._notes = odometry, notes
        self._decoder = JointDecoder(ENCODER_PULSE_TYPE, is_cdr)
        self._sides = WheelNumbers(), WheelNumbers()

    def add(self, message: Message) -> None:
        """Add the counts of one message.

        Raises:
            InputFault: the message is torn, or has not one count of each wheel.
        """
        stamp_ns, names, counts = self._decoder.decode(message.raw)
        by_name = dict(zip(names, counts))
        if any(joint not in by_name or names.count(joint) > 1 for joint in self.joints):
            raise InputFault(f'names {list(names)}; expected {" and ".join(self.joints)}, each once')
        for side, joint in zip(self._sides, self.joints):
            side.add(stamp_ns, message.time_ns, by_name[joint])

    def drives(self) -> List[TimedDrive]:
        """Return the angles; what the wheels turned while the counters restarted is lost."""
        left, right = (side.series() for side in self._sides)
        counted = np.zeros((len(left.values), 2))
        steps, self.restarts = CounterSteps(self._odometry.counter_limits), 0
        for rows in ascending_runs(left.stamps_ns):
            steps.reset()
            totals = 0, 0
            stamps_ns, counts = left.stamps_ns[rows].tolist(), np.column_stack((left.values, right.values))[rows]
            for row, stamp_ns, pair in zip(rows.tolist(), stamps_ns, counts.astype(np.int64).tolist()):
                step = steps.take(Reading(stamp_ns, *pair))
                if step is None:
                    totals = pair[0], pair[1]
                else:
                    totals = totals[0] + step.left_pulses, totals[1] + step.right_pulses
                    self.restarts += bool(step.restart)
                counted[row] = totals
        ppr = self._odometry.counts_per_turn
        left_rad = angles_of_counts_rad(counted[:, 0], ppr.left)
        right_rad = angles_of_counts_rad(counted[:, 1], ppr.right)
        return paired_drives(left._replace(values=left_rad), right._replace(values=right_rad))[0]

    def notes(self) -> Iterator[str]:
        """List what the counts cannot show, and how often their counters restarted."""
        yield from self._notes
        if self.restarts:
            yield (
                f'{self.topics[0]}: counter restarts: {self.restarts}; what the wheels turned meanwhile is '
                f'lost. Counters that wrap elsewhere than at their counter_modulus look like that, too'
            )
