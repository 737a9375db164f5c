"""The reference of a comparison: a topic of poses, or two frames of /tf."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Dict, Iterator, List, Optional, Union

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.drives.drive_stream import DriveStream, Message
from diff_encoder_sim.drives.message_decoders import POSE_TYPES, PoseDecoder, StampedPose, decode_tf
from diff_encoder_sim.drives.topics import ARROW, TF, TF_STATIC, TRANSFORMS_TYPE, WORLD_POSE

# A longer chain of frames is a circle.
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
        """Add the transforms of a message, and yield the poses that follow.

        Raises:
            InputFault: the message is torn, or a pose in it is not finite.
        """
        frames = self._fixed if message.topic == TF_STATIC else self._moving
        for transform in decode_tf(message.raw, self._is_cdr):
            frames[transform.child_frame] = transform
            chain = [self._child]  # up to the parent
            while chain[-1] != self._parent and len(chain) < _LONGEST_CHAIN:
                above = self._fixed.get(chain[-1]) or self._moving.get(chain[-1])
                if above is None:
                    break
                chain.append(above.parent_frame)
            lowest_moving = next((frame for frame in chain if frame not in self._fixed), None)
            if frames is self._moving and transform.child_frame == lowest_moving and chain[-1] == self._parent:
                pose = IDENTITY
                for frame in chain[:-1]:
                    pose = (self._fixed.get(frame) or self._moving[frame]).pose.compose(pose)
                yield StampedPose(transform.stamp_ns, pose, self._parent, self._child)

    @property
    def frames(self) -> List[str]:
        """Return all frames of the transforms so far."""
        transforms = [*self._fixed.values(), *self._moving.values()]
        return sorted({frame for each in transforms for frame in (each.parent_frame, each.child_frame)})


Reference = Union[PoseTopic, FramePair]


def find_reference(path: Path, source: DriveStream, given: str) -> Optional[Reference]:
    """Choose the reference: as given, else /world_pose if the bag has it, else None.

    Args:
        path: of the bag, for error messages.
        source: the bag.
        given: a topic, or frames as 'map->base_link'; empty for the default.

    Raises:
        ConfigError: the given topic or frame does not exist, is of another type, or has no pose.
    """
    if given:
        return find_poses(path, source, '--reference', given)
    with contextlib.suppress(ConfigError):
        return find_poses(path, source, '--reference', WORLD_POSE)
    return None


def find_poses(path: Path, source: DriveStream, option: str, given: str) -> Reference:
    """Find the poses that a user names.

    Args:
        path: of the bag, for error messages.
        source: the bag.
        option: by which they are named, for error messages.
        given: a topic, or frames as 'map->base_link'.

    Raises:
        ConfigError: the given topic or frame does not exist, is of another type, or has no pose.
    """
    if ARROW in given:
        return _frame_pair(path, source, option, given)
    kind = source.topics.get(given)
    found = f'of {kind}' if kind else 'not there'
    if kind in POSE_TYPES:
        if _has_pose(source, PoseTopic(given, kind, source.is_cdr)):
            return PoseTopic(given, kind, source.is_cdr)
        found = 'without a pose that can be read'
    allowed = sorted(topic for topic, kind in source.topics.items() if kind in POSE_TYPES)
    if source.topics.get(TF) == TRANSFORMS_TYPE:
        allowed.append(f'two frames of {TF} as map{ARROW}base_link')
    listed = ', '.join(allowed) or 'it has no poses'
    raise ConfigError(f'{path}: {option}: given {given}, which is {found}; allowed: {listed}')


def _frame_pair(path: Path, source: DriveStream, option: str, given: str) -> FramePair:
    parent_frame, child_frame = (frame.strip(' /') for frame in given.split(ARROW, 1))
    if not (parent_frame and child_frame) or parent_frame == child_frame:
        raise ConfigError(f'{option}: given {given!r}; allowed: two frames, as map{ARROW}base_link')
    if source.topics.get(TF) != TRANSFORMS_TYPE:
        raise ConfigError(f'{path}: {option}: given {given}, but there is no {TF} of {TRANSFORMS_TYPE}')
    tried = FramePair(parent_frame, child_frame, source.is_cdr)
    if not _has_pose(source, tried):
        listed = ', '.join(tried.frames) or f'{TF} has none'
        allowed = f'two that moving transforms connect, the parent first, of {listed}'
        raise ConfigError(f'{path}: {option}: given {given}, which leads to no pose; allowed: {allowed}')
    return FramePair(parent_frame, child_frame, source.is_cdr)


def _has_pose(source: DriveStream, reference: Reference) -> bool:
    """Return whether a reference leads to a pose; `reference` then has the transforms up to it."""
    for message in source.messages(reference.topics):
        with contextlib.suppress(InputFault):
            if any(True for _ in reference.poses(message)):
                return True
    return False
