"""Where the wheel angles of a drive come from: interface of wheel-angle sources."""

from __future__ import annotations

from typing import Collection, Dict, Iterator, Optional, Sequence, Tuple

from typing_extensions import Protocol

from diff_encoder_sim.drives.bag_messages import Message
from diff_encoder_sim.drives.sensor_messages import JointValues
from diff_encoder_sim.wheels.encoder_params import PerWheel


class DriveStream(Protocol):
    """A drive as it was recorded: a bag (`open_source`), or a CSV file."""

    is_cdr: bool
    topics: Dict[str, str]  # types by topic
    fault: str  # why not all of it can be read

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages of some topics in the order of their recording, as often as asked for."""


class WheelSource(Protocol):
    """Turns the messages of some topics into wheel angles, as they come: nothing is kept of the drive."""

    topics: Tuple[str, ...]
    joints: Tuple[str, str]  # left, right: the names under which angles are given
    ppr: Optional[PerWheel]  # of the encoder that counted; None where it is not known
    are_joint_angles: bool  # of joints, which may turn backward when the robot drives forward
    text: str  # what it reads, after a number of messages

    def angles(self, message: Message) -> Sequence[JointValues]:
        """Return the angles [rad] that a message of `topics` completes: of both wheels, or of one.

        Raises:
            InputFault: the message cannot be used.
        """

    def notes(self) -> Iterator[str]:
        """List what must be known of the angles, one line each, when the drive has been read."""
