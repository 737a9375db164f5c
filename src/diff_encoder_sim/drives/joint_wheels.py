"""Wheel angles from JointState, or from the counts of EncoderPulse."""

from __future__ import annotations

from typing import Iterator, Sequence, Tuple

from diff_encoder_sim.drives.bag_messages import Message
from diff_encoder_sim.drives.counted_angles import CountedAngles
from diff_encoder_sim.drives.sensor_messages import JointDecoder, JointValues
from diff_encoder_sim.drives.wheels import WheelTopic
from diff_encoder_sim.wheels.odometry_params import OdometryParams


class JointWheels:
    """Reads the topic that `find_wheels` has found."""

    def __init__(
        self, wheels: WheelTopic, is_cdr: bool, odometry: OdometryParams, about: str = '', notes: Sequence[str] = ()
    ) -> None:
        """Prepare to read.

        Args:
            wheels: where the angles or counts are.
            is_cdr: of ROS 2.
            odometry: which could be fed with recorded counts; of no account for angles.
            about: how the counts are read, for the reader.
            notes: what the counts cannot show.
        """
        self.topics: Tuple[str, ...] = (wheels.topic,)
        self.joints, self.ppr = wheels.joints, wheels.ppr
        self.text = f'messages of {wheels.topic} ({", ".join(wheels.joints)}{about and f"; {about}"})'
        self.are_joint_angles = wheels.ppr is None
        self._notes = notes
        self._decoder = JointDecoder(wheels.message_type, is_cdr)
        self._counted = None if self.are_joint_angles else CountedAngles(wheels.joints, odometry)

    def angles(self, message: Message) -> Sequence[JointValues]:
        """Return the joints of one message.

        Raises:
            InputFault: the message is torn, or has not the counts of both wheels.
        """
        joints = self._decoder.decode(message.raw)
        return (joints if self._counted is None else self._counted.angles(joints),)

    def notes(self) -> Iterator[str]:
        """List what the counts cannot show, and how often their counters restarted."""
        yield from self._notes
        if self._counted and self._counted.restarts:
            yield (
                f'{self.topics[0]}: counter restarts: {self._counted.restarts}; what the wheels turned meanwhile is '
                f'lost. Counters that wrap elsewhere than at their counter_modulus look like that, too'
            )
