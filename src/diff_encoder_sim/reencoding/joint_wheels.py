"""Wheel angles from JointState, or from the counts of EncoderPulse."""

from __future__ import annotations

from typing import Iterator, Sequence, Tuple

from diff_encoder_sim.reencoding.counted_angles import CountedAngles
from diff_encoder_sim.reencoding.wheels import WheelTopic
from diff_encoder_sim.serialization.bag_messages import Message
from diff_encoder_sim.serialization.joint_messages import JointDecoder, JointValues


class JointWheels:
    """Reads the topic that `find_wheels` has found."""

    def __init__(self, wheels: WheelTopic, is_cdr: bool, counter_modulus: int) -> None:
        """Prepare to read; `is_cdr` is of ROS 2, `counter_modulus` of recorded counts."""
        self.topics: Tuple[str, ...] = (wheels.topic,)
        self.joints, self.ppr = wheels.joints, wheels.ppr
        self.text = f'messages of {wheels.topic} ({", ".join(wheels.joints)})'
        self.are_joint_angles = wheels.ppr is None
        self._decoder = JointDecoder(wheels.message_type, is_cdr)
        self._counted = CountedAngles(wheels.joints, wheels.ppr, counter_modulus) if wheels.ppr else None

    def angles(self, message: Message) -> Sequence[JointValues]:
        """Return the joints of one message.

        Raises:
            InputFault: the message is torn.
        """
        joints = self._decoder.decode(message.raw)
        return (joints if self._counted is None else self._counted.angles(joints),)

    def notes(self) -> Iterator[str]:
        """List nothing: the table says all."""
        return iter(())
