"""The frames of the robot's links, as robot_state_publisher publishes them."""

from __future__ import annotations

from pathlib import Path
from typing import Collection, List, Union

from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.transform_messages import encode_spatial_transform, encode_tf
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.drives.trial_bags import TrialBags
from diff_encoder_sim.robots.display_urdf import display_urdf
from diff_encoder_sim.robots.robot_source import RobotSource
from diff_encoder_sim.simulation.link_frames import LinkFrame, LinkFrames
from diff_encoder_sim.simulation.state import JointStates

# robot_state_publisher's publish_frequency, 50 Hz.
FRAMES_PERIOD_NS = 20_000_000


class StatePublisher:
    """Writes the wheels' frames to /tf at 50 Hz, and the fixed ones once to /tf_static."""

    def __init__(self, robot_file: Union[str, Path], joints: Collection[str], bag: Union[TrialBag, TrialBags]) -> None:
        """Read the frames of a robot of which these joints move."""
        self._frames = LinkFrames(display_urdf(RobotSource(Path(robot_file)), joints))
        self._bag = bag
        self._published_ns = 0

    def take(self, joints: JointStates) -> None:
        """Publish at the time of these joint states, if the period is over."""
        now_ns, frames = joints.stamp_ns, self._frames
        if now_ns - self._published_ns < FRAMES_PERIOD_NS:
            return
        if self._published_ns == 0:
            self._bag.publish(topics.TF_STATIC, topics.STATE_PUBLISHER_NODE, now_ns, _encode, frames.fixed, now_ns)
        self._published_ns = now_ns
        self._bag.publish(topics.TF, topics.STATE_PUBLISHER_NODE, now_ns, _encode_turned, frames, joints)


def _encode_turned(frames: LinkFrames, joints: JointStates) -> bytes:
    return _encode(frames.turned(dict(zip(joints.names, joints.angles_rad))), joints.stamp_ns)


def _encode(frames: List[LinkFrame], stamp_ns: int) -> bytes:
    return encode_tf(
        *(
            encode_spatial_transform(frame.translation_xyz_m, frame.quat_xyzw, stamp_ns, frame.parent, frame.child)
            for frame in frames
        )
    )
