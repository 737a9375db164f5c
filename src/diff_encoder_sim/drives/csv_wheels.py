"""Wheel angles from the rows of a CSV file."""

from __future__ import annotations

from typing import Iterator, Optional, Sequence, Tuple

from diff_encoder_sim.drives.bag_messages import Message
from diff_encoder_sim.drives.csv_stream import PAIR
from diff_encoder_sim.drives.sensor_messages import JointValues
from diff_encoder_sim.drives.wheel_units import WheelAngle, WheelUnit
from diff_encoder_sim.wheels.encoder_params import PerWheel


class CsvWheels:
    """Reads the messages of a `CsvStream`."""

    are_joint_angles = False

    def __init__(
        self,
        topic: str,
        joints: Tuple[str, str],
        units: Tuple[WheelUnit, WheelUnit],
        ppr: Optional[PerWheel],
        about: str,
        notes: Sequence[str] = (),
    ) -> None:
        """Prepare to read.

        Args:
            topic: of the stream.
            joints: left, right: the names under which angles are given.
            units: of the numbers, left and right.
            ppr: of counts.
            about: what the numbers are, for the reader.
            notes: what the angles cannot show.
        """
        self.topics: Tuple[str, ...] = (topic,)
        self.joints, self.ppr = joints, ppr
        self.text = f'rows ({about})'
        self._notes = notes
        self._wheels = (WheelAngle(units[0]), WheelAngle(units[1]))

    def angles(self, message: Message) -> Sequence[JointValues]:
        """Return both wheels."""
        values = zip(self._wheels, PAIR.unpack(message.raw))
        angles_rad = [wheel.angle_rad(message.time_ns, value) for wheel, value in values]
        return (JointValues(message.time_ns, self.joints, angles_rad),)

    def notes(self) -> Iterator[str]:
        """List what the angles cannot show; bad rows are the stream's."""
        return iter(self._notes)
