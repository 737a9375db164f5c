"""The reference of a comparison: a topic of poses, or two frames of /tf."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Dict, Iterator, List, Optional, Tuple, Union

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.drives.bag_source import BagSource
from diff_encoder_sim.drives.pose_messages import POSE_TYPES, PoseDecoder, StampedPose, decode_tf
from diff_encoder_sim.drives.ros1_stream import Message
from diff_encoder_sim.drives.topics import ARROW, TF, TF_STATIC, TRANSFORMS_TYPE, WORLD_POSE

# A longer chain of frames goes in a circle.
_LONGEST_CHAIN = 100


class PoseTopic:
    """Reads the poses of a topic."""

    def __init__(self, topic: str, message_type: str, is_cdr: bool) -> None:
        self.name, self.topics = topic, (topic,)
        self._decoder = PoseDecoder(message_type, is_cdr)

    def poses(self, message: Message) -> Iterator[StampedPose]:
        """Decode the one pose of a message.

        Raises:
            InputFault: the message is torn, or its pose is not finite.
        """
        yield self._decoder.decode(message.raw)


class FramePair:
    """Computes a frame's pose in another, up the chain of transforms.

    There is a pose for every transform of the lowest frame in the chain that is not fixed. Of the
    frames above, as of AMCL's map -> odom, the last transform before it is taken.
    """

    topics = (TF, TF_STATIC)

    def __init__(self, parent_frame: str, child_frame: str, is_cdr: bool) -> None:
        self.name = f'{parent_frame}{ARROW}{child_frame}'
        self._parent, self._child = parent_frame, child_frame
        self._is_cdr = is_cdr
        self._fixed: Dict[str, StampedPose] = {}  # by child frame
        self._moving: Dict[str, StampedPose] = {}

    def poses(self, message: Message) -> Iterator[StampedPose]:
        """Add a message of transforms to the ones before, and yield the poses that it leads to.

        Raises:
            InputFault: the message is torn, or a pose in it is not finite.
        """
        frames = self._fixed if message.topic == TF_STATIC else self._moving
        for transform in decode_tf(message.raw, self._is_cdr):
            frames[transform.child_frame] = transform
            if frames is self._moving and transform.child_frame == self._lowest_moving():
                pose = self._pose()
                if pose is not None:
                    yield StampedPose(transform.stamp_ns, pose, self._parent, self._child)

    @property
    def frames(self) -> List[str]:
        """Return all frames of the transforms up to now."""
        transforms = [*self._fixed.values(), *self._moving.values()]
        return sorted({frame for each in transforms for frame in (each.parent_frame, each.child_frame)})

    def _lowest_moving(self) -> str:
        frame = self._child
        for _ in range(_LONGEST_CHAIN):
            if frame not in self._fixed:
                break
            frame = self._fixed[frame].parent_frame
        return frame

    def _pose(self) -> Optional[Pose2D]:
        """Walk up the chain; None while it does not reach the parent."""
        frame, pose = self._child, IDENTITY
        for _ in range(_LONGEST_CHAIN):
            if frame == self._parent:
                return pose
            transform = self._fixed.get(frame) or self._moving.get(frame)
            if transform is None:
                break
            frame, pose = transform.parent_frame, transform.pose.compose(pose)
        return None


Reference = Union[PoseTopic, FramePair]


def find_reference(path: Path, source: BagSource, given: str) -> Optional[Reference]:
    """Choose the reference: as given, else /world_pose where the bag has it, else None.

    Args:
        path: of the bag, for error messages.
        source: the bag.
        given: a topic, or frames as 'map->base_link'; empty for the default.

    Raises:
        ConfigError: what is given is not there, of another type, or has no pose.
    """
    if given:
        return find_poses(path, source, '--reference', given)
    kind = source.topics.get(WORLD_POSE)
    if kind in POSE_TYPES and _has_pose(source, PoseTopic(WORLD_POSE, kind, source.is_cdr)):
        return PoseTopic(WORLD_POSE, kind, source.is_cdr)
    return None


def find_poses(path: Path, source: BagSource, option: str, given: str) -> Reference:
    """Find the poses that a user names.

    Args:
        path: of the bag, for error messages.
        source: the bag.
        option: by which they are named, for error messages.
        given: a topic, or frames as 'map->base_link'.

    Raises:
        ConfigError: what is given is not there, of another type, or has no pose.
    """
    if ARROW in given:
        return _frame_pair(path, source, option, given)
    kind = source.topics.get(given)
    found = f'of {kind}' if kind else 'not there'
    if kind in POSE_TYPES:
        if _has_pose(source, PoseTopic(given, kind, source.is_cdr)):
            return PoseTopic(given, kind, source.is_cdr)
        found = 'without a pose that can be read'
    allowed = ', '.join(_allowed(source)) or 'it has no poses'
    raise ConfigError(f'{path}: {option}: given {given}, which is {found}; allowed: {allowed}')


def _has_pose(source: BagSource, reference: Reference) -> bool:
    """Return whether a reference leads to a pose; `reference` has learned the transforms up to it."""
    for message in source.messages(reference.topics):
        with contextlib.suppress(InputFault):
            if any(True for _ in reference.poses(message)):
                return True
    return False


def _frame_pair(path: Path, source: BagSource, option: str, given: str) -> FramePair:
    parent_frame, _, child_frame = given.partition(ARROW)
    frames: Tuple[str, str] = (parent_frame.strip(' /'), child_frame.strip(' /'))
    if not all(frames) or frames[0] == frames[1]:
        raise ConfigError(f'{option}: given {given!r}; allowed: two frames, as map{ARROW}base_link')
    if source.topics.get(TF) != TRANSFORMS_TYPE:
        raise ConfigError(f'{path}: {option}: given {given}, but there is no {TF} of {TRANSFORMS_TYPE}')
    tried = FramePair(*frames, source.is_cdr)
    if not _has_pose(source, tried):
        listed = ', '.join(tried.frames) or f'{TF} has none'
        allowed = f'two that moving transforms connect, the parent first, of {listed}'
        raise ConfigError(f'{path}: {option}: given {given}, which leads to no pose; allowed: {allowed}')
    return FramePair(*frames, source.is_cdr)


def _allowed(source: BagSource) -> Iterator[str]:
    """List topics of poses, and frames where there are any."""
    yield from sorted(topic for topic, kind in source.topics.items() if kind in POSE_TYPES)
    if source.topics.get(TF) == TRANSFORMS_TYPE:
        yield f'two frames of {TF} as map{ARROW}base_link'
