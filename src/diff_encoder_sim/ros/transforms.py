"""A buffer of transforms, and scans that wait in it for the transforms at their stamps."""

from __future__ import annotations

import contextlib
import copy
import math
import threading
from collections import deque
from typing import Callable, Deque, Dict, Iterable, Iterator, List, NamedTuple, Optional, Set, Tuple

import rospy
import tf2_ros
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.base.errors import EVENT, InputFault, in_one_line
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, check_stamp
from diff_encoder_sim.drives.pose_messages import SpatialTransform, decode_spatial_tf
from diff_encoder_sim.ros.conversions import ns_from_stamp, pose_from_transform, scan_from_message, stamp_from_ns
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
            log.warning('/clock went back by %.3f s: clearing the tf buffer', (before - now).to_sec())
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


# A scan that is so much older than the newest one is dropped; and so many may wait.
PATIENCE_NS = 2 * NANOSECONDS_PER_SECOND
LONGEST_QUEUE = 100

# Clocks within a robot differ by less. After a scan from farther ahead the next would look like a restart.
SCANS_MOST_AHEAD_S = 1.0

# A laser that is tilted more is worth a warning: its ranges are used as if it were level.
LEVEL_WITHIN_RAD = math.radians(5.0)


class ScanQueue:
    """Hands on scans in order, with the odometry at their stamps; not thread-safe.

    A scan without transforms does not hold up the ones behind it, and is dropped with a warning when it has waited too
    long.
    """

    def __init__(
        self,
        topic: str,
        buffer: tf2_ros.Buffer,
        base_frame: str,
        odom_frame: str,
        take: Callable[[Scan, Pose2D, Pose2D], None],
    ) -> None:
        """Prepare an empty queue; `take` is called with a scan, the base's pose in odom and the laser's in base."""
        self._topic, self._buffer, self._take = topic, buffer, take
        self._base_frame, self._odom_frame = base_frame, odom_frame
        self._waiting: Deque[LaserScan] = deque(maxlen=LONGEST_QUEUE)
        self._tilted: Set[str] = set()
        self._used_ns: Optional[int] = None

    def add(self, message: LaserScan) -> None:
        """Append a scan, which is later than those before it."""
        self._waiting.append(message)

    def clear(self) -> None:
        """Forget the waiting scans."""
        self._waiting.clear()
        self._used_ns = None

    def process(self) -> None:
        """Hand on the scans that have transforms, and drop those that have waited too long."""
        newest_ns = ns_from_stamp(self._waiting[-1].header.stamp) if self._waiting else 0
        held: List[LaserScan] = []
        for message in self._waiting:
            try:
                place = self._place(message)
            except InputFault as fault:
                self._warn_bad(fault)
            except _NoTransform as reason:
                waited_ns = newest_ns - ns_from_stamp(message.header.stamp)
                if waited_ns < PATIENCE_NS and not reason.is_too_late:
                    held.append(message)
                else:
                    self._warn_dropped(reason)
            else:
                for older in held:
                    self._take_or_drop(older)
                held.clear()
                self._hand_on(message, *place)
        self._waiting = deque(held, maxlen=LONGEST_QUEUE)

    def _take_or_drop(self, message: LaserScan) -> None:
        """Hand on a scan that is older than one that is about to be used, or drop it.

        /tf comes in another thread: its transforms may have come a moment ago.
        """
        try:
            self._hand_on(message, *self._place(message))
        except InputFault as fault:
            self._warn_bad(fault)
        except _NoTransform as reason:
            self._warn_dropped(reason)

    def _place(self, message: LaserScan) -> Tuple[Pose2D, ScannerMount]:
        """Look up where the base was in odom, and how the laser is mounted."""
        mount = self._mount(message.header.frame_id.lstrip('/'))
        return self._odom_pose(message.header.stamp), mount

    def _hand_on(self, message: LaserScan, odom_pose: Pose2D, mount: ScannerMount) -> None:
        scan = mount.level(scan_from_message(message))
        try:
            self._take(scan, odom_pose, mount.laser_pose_in_base)
        except InputFault as fault:
            self._warn_bad(fault)
            return
        if self._used_ns is not None and scan.stamp_ns - self._used_ns > PATIENCE_NS:
            log.info(
                '%s: scans are used again, after %.1f s without one',
                self._topic,
                (scan.stamp_ns - self._used_ns) / NANOSECONDS_PER_SECOND,
                extra=EVENT,
            )
        self._used_ns = scan.stamp_ns

    def _warn_bad(self, fault: InputFault) -> None:
        log.warning('%s: %s; scan dropped', self._topic, fault)

    def _warn_dropped(self, reason: _NoTransform) -> None:
        log.warning('%s: scan dropped: %s', self._topic, reason)

    def _mount(self, laser_frame: str) -> ScannerMount:
        mount = scanner_mount(self._laser_transform(laser_frame))
        if mount.lean_rad > LEVEL_WITHIN_RAD and laser_frame not in self._tilted:
            self._tilted.add(laser_frame)
            log.warning(
                '%s: frame %r is tilted by %.0f degrees; its scans are used as if it were level',
                self._topic,
                laser_frame,
                math.degrees(mount.lean_rad),
                extra=EVENT,
            )
        return mount

    def _odom_pose(self, stamp: rospy.Time) -> Pose2D:
        """Look up where the base was in odom."""
        frames = self._odom_frame, self._base_frame
        try:
            newest = self._buffer.get_latest_common_time(*frames)
        except tf2_ros.TransformException as error:
            raise _NoTransform(*frames, str(error)) from None
        try:
            return pose_from_transform(self._buffer.lookup_transform(*frames, stamp))
        except tf2_ros.TransformException:
            # tf2's own message may be about map->odom, which is dated ahead.
            gap_s = (newest - stamp).to_sec()
            why = f'the newest is {-gap_s:.1f} s older' if gap_s < 0.0 else 'the buffer begins later'
            raise _NoTransform(*frames, why, is_too_late=gap_s > 0.0) from None

    def _laser_transform(self, laser_frame: str) -> TransformStamped:
        try:
            return self._buffer.lookup_transform(self._base_frame, laser_frame, rospy.Time(0))
        except tf2_ros.TransformException as error:
            raise _NoTransform(self._base_frame, laser_frame, str(error)) from None


class _NoTransform(Exception):
    """A transform is missing at a scan's stamp; if `is_too_late`, waiting will not help."""

    def __init__(self, parent: str, child: str, why: str, is_too_late: bool = False) -> None:
        super().__init__(f'no transform from {child!r} to {parent!r} at its stamp ({why})')
        self.is_too_late = is_too_late


class ScannerMount(NamedTuple):
    """A laser on the robot, projected to the floor."""

    laser_pose_in_base: Pose2D
    is_upside_down: bool
    lean_rad: float  # angle between the scanned plane and the floor

    def level(self, scan: Scan) -> Scan:
        """Return a scan with its rays counter-clockwise as seen from above."""
        if not self.is_upside_down:
            return scan
        return scan._replace(angle_min_rad=-scan.angle_min_rad, angle_increment_rad=-scan.angle_increment_rad)


def scanner_mount(transform: TransformStamped) -> ScannerMount:
    """Compute the mounting from the transform of the laser's frame to the base's.

    Raises:
        InputFault: the transform is no valid pose.
    """
    pose = pose_from_transform(transform)
    rotation = transform.transform.rotation
    aside = rotation.x**2 + rotation.y**2
    upright = rotation.z**2 + rotation.w**2
    # Component of the laser's z axis along the base's.
    up = (upright - aside) / (upright + aside)
    return ScannerMount(pose, up < 0.0, math.acos(min(abs(up), 1.0)))
