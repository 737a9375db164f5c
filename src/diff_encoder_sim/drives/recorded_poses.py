"""Recorded poses: those of a topic, or of a frame in another by the transforms of /tf."""

from __future__ import annotations

import contextlib
from array import array
from collections import ChainMap
from typing import Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, PoseSeries
from diff_encoder_sim.drives.drive_stream import DriveStream, Message
from diff_encoder_sim.drives.message_decoders import POSE_TYPES, PoseDecoder, StampedPose, decode_tf
from diff_encoder_sim.drives.topics import ARROW, TF, TF_STATIC, TRANSFORMS_TYPE, WORLD_POSE

_LONGEST_CHAIN = 100  # of frames; a longer one is a circle


class RecordedPoses:
    """Collects poses from the messages of `topics`."""

    def __init__(self, name: str, topics: Tuple[str, ...]) -> None:
        self.name, self.topics = name, topics
        self.child_frame = ''  # of the last pose
        self.fault = ''  # why not all of a table can be read
        self.stamps_ns, self.times_ns = array('q'), array('q')  # times by the recorder's clock
        self._poses = array('d')  # x, y, yaw
        self._covariances = array('d')  # xx, xy, x yaw, yy, y yaw, yaw yaw; empty if the source has none

    def add(self, message: Message) -> None:
        """Add the poses of a message; InputFault if it is torn, or a pose in it is not finite."""
        raise NotImplementedError

    def _append(self, stamped: StampedPose, time_ns: int, covariance: Sequence[float] = ()) -> None:
        self.child_frame = stamped.child_frame
        self.stamps_ns.append(stamped.stamp_ns)
        self.times_ns.append(time_ns)
        self._poses.extend(stamped.pose)
        self._covariances.extend(covariance)

    def series(self) -> PoseSeries:
        """Return the poses in the order of their recording."""
        return PoseSeries(np.array(self.stamps_ns), np.array(self._poses).reshape(-1, 3))

    def covariances(self) -> Optional[np.ndarray]:
        """Return (n, 3, 3) of x, y and yaw [m^2, m rad, rad^2] as recorded; None if the source has none."""
        if not self._covariances:
            return None
        return np.array(self._covariances).reshape(-1, 6)[:, [[0, 1, 2], [1, 3, 4], [2, 4, 5]]]


class PoseTopic(RecordedPoses):
    """The poses of a topic of one of `POSE_TYPES`."""

    def __init__(self, topic: str, message_type: str, is_cdr: bool) -> None:
        super().__init__(topic, (topic,))
        self._decoder = PoseDecoder(message_type, is_cdr)

    def add(self, message: Message) -> None:
        """Add the pose of a message."""
        pose, covariance = self._decoder.decode(message.raw), self._decoder.decode_covariance(message.raw)
        self._append(pose, message.time_ns, covariance)


class FramePair(RecordedPoses):
    """A frame's poses in another, up the chain of transforms.

    There is a pose for every transform of the lowest frame in the chain that is not fixed. Of the
    frames above, as of AMCL's map -> odom, the last transform before it is taken.
    """

    def __init__(self, parent_frame: str, child_frame: str, is_cdr: bool) -> None:
        super().__init__(f'{parent_frame}{ARROW}{child_frame}', (TF, TF_STATIC))
        self._parent, self._child, self._is_cdr = parent_frame, child_frame, is_cdr
        self._fixed: Dict[str, StampedPose] = {}  # by child frame
        self._moving: Dict[str, StampedPose] = {}

    def add(self, message: Message) -> None:
        """Add the transforms of a message, and the poses that follow."""
        frames = self._fixed if message.topic == TF_STATIC else self._moving
        for transform in decode_tf(message.raw, self._is_cdr):
            frames[transform.child_frame] = transform
            chain = frame_chain(ChainMap(self._fixed, self._moving), self._child, self._parent) or []
            if transform is next((each for each in chain if each.child_frame not in self._fixed), None):
                pose = StampedPose(transform.stamp_ns, pose_along(chain), self._parent, self._child)
                self._append(pose, message.time_ns)

    @property
    def frames(self) -> List[str]:
        """Return all frames of the transforms so far."""
        transforms = [*self._fixed.values(), *self._moving.values()]
        return sorted({frame for each in transforms for frame in (each.parent_frame, each.child_frame)})


def frame_chain(transforms: Mapping[str, StampedPose], child: str, parent: str) -> Optional[List[StampedPose]]:
    """Return the transforms from a frame up to another, of those by child frame; None if they do not lead there."""
    chain: List[StampedPose] = []
    while child != parent:
        if child not in transforms or len(chain) == _LONGEST_CHAIN:
            return None
        chain.append(transforms[child])
        child = chain[-1].parent_frame
    return chain


def pose_along(chain: Sequence[StampedPose]) -> Pose2D:
    """Return the pose of the first child frame of a chain in its last parent frame."""
    pose = IDENTITY
    for transform in chain:
        pose = transform.pose.compose(pose)
    return pose


def find_reference(source: DriveStream, given: str) -> Optional[RecordedPoses]:
    """Find the given poses, else /world_pose if the bag has it, else None; errors as `find_poses`."""
    if given:
        return find_poses(source, '--reference', given)
    with contextlib.suppress(ConfigError):
        return find_poses(source, '--reference', WORLD_POSE)
    return None


def find_poses(source: DriveStream, option: str, given: str) -> RecordedPoses:
    """Find the poses of a topic, or of frames as 'map->base_link', that an option gives; ConfigError without any."""
    if ARROW in given:
        return _find_frames(source, option, given)
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
    raise ConfigError(f'{source.path}: {option}: given {given}, which is {found}; allowed: {listed}')


def _find_frames(source: DriveStream, option: str, given: str) -> FramePair:
    parent_frame, child_frame = (frame.strip(' /') for frame in given.split(ARROW, 1))
    if not (parent_frame and child_frame) or parent_frame == child_frame:
        raise ConfigError(f'{option}: given {given!r}; allowed: two frames, as map{ARROW}base_link')
    if source.topics.get(TF) != TRANSFORMS_TYPE:
        raise ConfigError(f'{source.path}: {option}: given {given}, but there is no {TF} of {TRANSFORMS_TYPE}')
    tried = FramePair(parent_frame, child_frame, source.is_cdr)
    if not _has_pose(source, tried):
        listed = ', '.join(tried.frames) or f'{TF} has none'
        allowed = f'two that moving transforms connect, the parent first, of {listed}'
        raise ConfigError(f'{source.path}: {option}: given {given}, which leads to no pose; allowed: {allowed}')
    return FramePair(parent_frame, child_frame, source.is_cdr)


def _has_pose(source: DriveStream, poses: RecordedPoses) -> bool:
    """Return whether a bag has a pose; `poses` then has the transforms up to it."""
    for message in source.messages(poses.topics):
        with contextlib.suppress(InputFault):
            poses.add(message)
        if poses.stamps_ns:
            return True
    return False
