"""A buffer of transforms that no message on /tf can bring down, and that tf2 gets only what is looked up of."""

from __future__ import annotations

import contextlib
import copy
import threading
from collections import deque
from typing import Callable, Deque, Dict, Iterable, Iterator, Set, Tuple

import rospy
import tf2_ros
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.base.errors import InputFault, in_one_line
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, check_stamp
from diff_encoder_sim.drives.pose_messages import SpatialTransform, decode_spatial_tf
from diff_encoder_sim.ros.conversions import ns_from_stamp, stamp_from_ns
from diff_encoder_sim.ros.encoded_topics import EncodedMessage, encoded_class
from diff_encoder_sim.ros.node import log, subscriber

USUAL_CACHE_S = 10.0  # tf2's own


class TransformBuffer(tf2_ros.Buffer):  # type: ignore[misc]  # tf2 has no types
    """Holds the transforms of /tf and /tf_static, without those that tf2 cannot take.

    tf2 aborts the whole process for a stamp near 2^32 s: such a one must not come to it. Most transforms are of frames
    that no lookup passes, as of wheels: tf2 gets those of a frame when a lookup passes it, and then all since before.
    """

    def __init__(self, cache_s: float = USUAL_CACHE_S) -> None:
        """Subscribe to both topics; transforms are kept for `cache_s`."""
        super().__init__(rospy.Duration(cache_s))
        self._cache_ns = round(cache_s * NANOSECONDS_PER_SECOND)
        self._on_change: Callable[[], None] = lambda: None
        self._lock = threading.Lock()  # each publisher comes in a thread of its own
        self._held: Dict[str, Deque[Tuple[SpatialTransform, str]]] = {}  # by child frame, with the publisher
        self._parents: Dict[str, str] = {}
        self._passed: Set[str] = set()  # by lookups
        self._newest = rospy.Time.now()
        self._subscribers = [
            subscriber('/tf', encoded_class(TFMessage), self._on_transforms),
            subscriber('/tf_static', TFMessage, self._on_static),
        ]

    def listen(self, on_change: Callable[[], None]) -> None:
        """Call back, in a thread of the topic's, when a transform has come that a lookup so far would have passed."""
        self._on_change = on_change
        on_change()  # what came before

    def lookup_transform(self, target_frame: str, source_frame: str, time: rospy.Time) -> TransformStamped:
        """Look up a transform as tf2 does, without waiting for it."""
        self._hand_over(target_frame, source_frame)
        with _name_errors():
            return self.lookup_transform_core(target_frame, source_frame, time)

    def get_latest_common_time(self, target_frame: str, source_frame: str) -> rospy.Time:
        """Look up the newest time of a transform as tf2 does."""
        self._hand_over(target_frame, source_frame)
        with _name_errors():
            return super().get_latest_common_time(target_frame, source_frame)

    def clear(self) -> None:
        """Forget all transforms but the static ones."""
        with self._lock:
            self._held.clear()
            super().clear()

    def set_transform_static(self, transform: TransformStamped, authority: str) -> None:
        """Take a transform of /tf_static. Its stamp means nothing, and must not be the newest of a frame that moves."""
        transform = copy.deepcopy(transform)
        transform.header.stamp = rospy.Time()
        frames = transform.header.frame_id, transform.child_frame_id
        parent, child = (frame.lstrip('/') for frame in frames)
        try:
            with self._lock:
                self._hand_over_held(child)  # in their order: of a frame the newest of both kinds counts
                super().set_transform_static(transform, authority)
                self._parents[child] = parent
        except (ValueError, TypeError) as error:
            _warn('/tf_static', authority, frames, error)

    def _on_static(self, message: TFMessage) -> None:
        self._forget_after_reset()
        for transform in message.transforms:
            self.set_transform_static(transform, _authority(message))
        self._on_change()

    def _on_transforms(self, message: EncodedMessage) -> None:
        self._forget_after_reset()
        try:
            transforms = list(decode_spatial_tf(message.content))
        except InputFault as fault:
            log.warning('/tf: %s; message of %s dropped', fault, _authority(message))
            return
        for transform in transforms:
            self._hold(transform, _authority(message))
        if not self._passed.isdisjoint(transform.child for transform in transforms) or not self._passed:
            self._on_change()

    def _forget_after_reset(self) -> None:
        with self._lock:
            now, before = rospy.Time.now(), self._newest
            self._newest = now
        if now < before:
            log.warning('/clock went back by %.3f s: the transforms of before are forgotten', (before - now).to_sec())
            self.clear()

    def _hold(self, transform: SpatialTransform, authority: str) -> None:
        try:
            check_stamp(transform.stamp_ns, ns_from_stamp(rospy.Time.now()))
        except InputFault as fault:
            _warn('/tf', authority, (transform.parent, transform.child), fault)
            return
        with self._lock:
            self._parents[transform.child] = transform.parent
            held = self._held.setdefault(transform.child, deque())
            if held and held[-1][0].stamp_ns == transform.stamp_ns:
                return  # of one time tf2 takes the first, too; and a stamp that stands still fills no memory
            held.append((transform, authority))
            while held[0][0].stamp_ns < transform.stamp_ns - self._cache_ns:
                held.popleft()

    def _hand_over(self, *frames: str) -> None:
        """Give tf2 the transforms of these frames and of those above them."""
        with self._lock:
            for frame in self._ancestry(frames):
                self._hand_over_held(frame)

    def _hand_over_held(self, frame: str) -> None:
        for transform, authority in self._held.pop(frame, ()):
            self._set(transform, authority)

    def _ancestry(self, frames: Iterable[str]) -> Set[str]:
        passed: Set[str] = set()
        for start in frames:
            frame = start
            while frame and frame not in passed:
                passed.add(frame)
                frame = self._parents.get(frame, '')
        self._passed |= passed
        return passed

    def _set(self, transform: SpatialTransform, authority: str) -> None:
        message = TransformStamped(child_frame_id=transform.child)
        message.header.stamp, message.header.frame_id = stamp_from_ns(transform.stamp_ns), transform.parent
        message.transform = Transform(Vector3(*transform.translation_xyz_m), Quaternion(*transform.quat_xyzw))
        try:
            super().set_transform(message, authority)
        except (ValueError, TypeError) as error:
            _warn('/tf', authority, (transform.parent, transform.child), error)


@contextlib.contextmanager
def _name_errors() -> Iterator[None]:
    """Raise an error of tf2 for names that its interface does not accept, as with a null character."""
    try:
        yield
    except ValueError as error:
        raise tf2_ros.InvalidArgumentException(str(error)) from None


def _authority(message: EncodedMessage) -> str:
    """Return the name of the node that has published a message."""
    return str(message._connection_header.get('callerid', 'an unknown node'))  # rospy's name for the header


def _warn(topic: str, authority: str, frames: Tuple[str, str], error: Exception) -> None:
    log.warning('%s: transform %r -> %r of %s: %s; dropped', topic, *frames, authority, in_one_line(error))
