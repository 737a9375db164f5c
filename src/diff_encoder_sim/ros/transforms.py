"""Transform buffer, and a queue of scans that wait for the transforms at their stamps."""

from __future__ import annotations

import math
from collections import deque
from typing import Callable, ContextManager, Deque, List, NamedTuple, Set, Tuple

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.ros.conversions import ns_from_stamp, pose_from_transform, scan_from_message
from diff_encoder_sim.ros.encoded_topics import stamped_subscriber
from diff_encoder_sim.ros.node import log


class TransformBuffer(tf2_ros.Buffer):  # type: ignore[misc]  # tf2 has no types
    """Buffer of /tf and /tf_static for `cache_s`, with a callback for new transforms."""

    def __init__(self, cache_s: float = 10.0) -> None:
        super().__init__(rospy.Duration(cache_s))
        self.on_change: Callable[[], None] = lambda: None
        self._listener = _Listener(self, tcp_nodelay=True)

    def listen(self, on_change: Callable[[], None]) -> None:
        """Call `on_change` after each message, in the topic's thread, and once now."""
        self.on_change = on_change
        on_change()


class _Listener(tf2_ros.TransformListener):  # type: ignore[misc]
    def callback(self, data: TFMessage) -> None:
        super().callback(data)
        self.buffer.on_change()

    def static_callback(self, data: TFMessage) -> None:
        super().static_callback(data)
        self.buffer.on_change()


class ScannerMount(NamedTuple):
    """Mounting of a laser, projected to the floor."""

    laser_pose_in_base: Pose2D
    is_upside_down: bool
    lean_rad: float  # angle between the scanned plane and the floor

    def level(self, scan: Scan) -> Scan:
        """Return a scan with rays counter-clockwise in top view."""
        if not self.is_upside_down:
            return scan
        return scan._replace(angle_min_rad=-scan.angle_min_rad, angle_increment_rad=-scan.angle_increment_rad)


def scanner_mount(transform: TransformStamped) -> ScannerMount:
    """Compute the mounting from the transform between laser and base frame; InputFault if the transform is invalid."""
    pose = pose_from_transform(transform)
    rotation = transform.transform.rotation
    aside, upright = rotation.x**2 + rotation.y**2, rotation.z**2 + rotation.w**2
    up = (upright - aside) / (upright + aside)  # component of the laser's z axis along the base's
    return ScannerMount(pose, up < 0.0, math.acos(min(abs(up), 1.0)))


PATIENCE_NS = 2 * NANOSECONDS_PER_SECOND  # age relative to the newest scan at which a scan is dropped
LONGEST_QUEUE = 100
LEVEL_WITHIN_RAD = math.radians(5.0)  # ranges of a laser are used as if it were level, above this with a warning
UseScan = Callable[[Scan, Pose2D, Pose2D], None]


class _NoTransform(InputFault):
    """A transform is missing at a scan's stamp; if `is_too_late`, waiting will not help."""

    def __init__(self, parent: str, child: str, why: str, is_too_late: bool = False) -> None:
        super().__init__(f'no transform from {child!r} to {parent!r} at its stamp ({why})')
        self.is_too_late = is_too_late


class ScanQueue:
    """Delivers scans in order with the odometry at their stamps, and drops those that have none; not thread-safe."""

    def __init__(self, topic: str, buffer: tf2_ros.Buffer, base_frame: str, odom_frame: str, use: UseScan) -> None:
        """Create an empty queue; `use` is called with a scan, the base's pose in odom and the laser's in base."""
        self._topic, self._buffer, self._use = topic, buffer, use
        self._base_frame, self._odom_frame = base_frame, odom_frame
        self._waiting: Deque[LaserScan] = deque(maxlen=LONGEST_QUEUE)
        self._tilted: Set[str] = set()
        self.add, self.clear = self._waiting.append, self._waiting.clear

    def process(self) -> None:
        """Deliver the scans that have transforms, and drop those that timed out."""
        newest_ns = ns_from_stamp(self._waiting[-1].header.stamp) if self._waiting else 0
        held: List[LaserScan] = []
        for message in list(self._waiting):
            try:
                place = self._place(message)
            except InputFault as fault:
                may_come = isinstance(fault, _NoTransform) and not fault.is_too_late
                if may_come and newest_ns - ns_from_stamp(message.header.stamp) < PATIENCE_NS:
                    held.append(message)
                else:
                    self._warn(fault)
                continue
            for older in held:  # last attempt: /tf is received in another thread
                try:
                    self._deliver(older, *self._place(older))
                except InputFault as fault:
                    self._warn(fault)
            held.clear()
            self._deliver(message, *place)
        self._waiting.clear()
        self._waiting.extend(held)

    def _deliver(self, message: LaserScan, odom_pose: Pose2D, mount: ScannerMount) -> None:
        try:
            self._use(mount.level(scan_from_message(message)), odom_pose, mount.laser_pose_in_base)
        except InputFault as fault:
            self._warn(fault)

    def _warn(self, fault: InputFault) -> None:
        # Two formats, because repeats of each are throttled.
        if isinstance(fault, _NoTransform):
            log.warning('%s: scan dropped: %s', self._topic, fault)
        else:
            log.warning('%s: %s; scan dropped', self._topic, fault)

    def _place(self, message: LaserScan) -> Tuple[Pose2D, ScannerMount]:
        """Look up the base's pose in odom and the mounting of the laser."""
        laser_frame, frames = message.header.frame_id.lstrip('/'), (self._odom_frame, self._base_frame)
        try:
            mount = scanner_mount(self._buffer.lookup_transform(self._base_frame, laser_frame, rospy.Time(0)))
        except tf2_ros.TransformException as error:
            raise _NoTransform(self._base_frame, laser_frame, str(error)) from None
        if mount.lean_rad > LEVEL_WITHIN_RAD and laser_frame not in self._tilted:
            self._tilted.add(laser_frame)
            what = self._topic, laser_frame, math.degrees(mount.lean_rad)
            log.warning('%s: frame %r is tilted by %.0f degrees; used as if it were level', *what, extra=EVENT)
        try:
            newest = self._buffer.get_latest_common_time(*frames)
        except tf2_ros.TransformException as error:
            raise _NoTransform(*frames, str(error)) from None
        try:
            return pose_from_transform(self._buffer.lookup_transform(*frames, message.header.stamp)), mount
        except tf2_ros.TransformException:
            # The message of tf2 may be about map->odom, which has a future stamp.
            gap_s = (newest - message.header.stamp).to_sec()
            why = f'the newest is {-gap_s:.1f} s older' if gap_s < 0.0 else 'the buffer begins later'
            raise _NoTransform(*frames, why, is_too_late=gap_s > 0.0) from None


# Maximum clock difference within a robot: after a scan from further ahead the next would look like a restart.
SCANS_MOST_AHEAD_S = 2.0
SILENCE_S = 15.0


class ScanInput:
    """Subscribes to `scan`, and delivers each scan with the odometry at its stamp through a `ScanQueue`.

    Args:
        lock: held during delivery.
        use: called with a scan, the base's pose in odom and the laser's in base.
        on_restart: called with the stamp [ns] if time jumped back, before that scan is queued.
        is_ready: returns whether scans are delivered; otherwise they wait.
    """

    def __init__(
        self,
        buffer: TransformBuffer,
        lock: ContextManager[object],
        base_frame: str,
        odom_frame: str,
        use: UseScan,
        on_restart: Callable[[int], None],
        is_ready: Callable[[], bool] = lambda: True,
    ) -> None:
        self._lock, self._on_restart, self._is_ready = lock, on_restart, is_ready
        self._timeline = Timeline(tolerance_ns=NANOSECONDS_PER_SECOND // 10)
        self._queue = ScanQueue(rospy.resolve_name('scan'), buffer, base_frame, odom_frame, use)
        self.clear = self._queue.clear  # forgets the waiting scans
        self._has_had_scan = False
        self._scans = stamped_subscriber('scan', LaserScan, self._on_scan, SCANS_MOST_AHEAD_S)
        buffer.listen(self._process)  # the laser's transform may be received last
        self._silence = rospy.Timer(rospy.Duration(SILENCE_S), self._on_silence, reset=True)

    def _on_scan(self, message: LaserScan) -> None:
        self._has_had_scan = True
        with self._lock:
            stamp_ns = ns_from_stamp(message.header.stamp)
            step = self._timeline.advance(stamp_ns)
            if step is Step.RESTART:
                self._on_restart(stamp_ns)
            if step is not Step.STALE:
                self._queue.add(message)
        self._process()

    def _process(self) -> None:
        with self._lock:
            if self._is_ready():
                self._queue.process()

    def _on_silence(self, _: rospy.timer.TimerEvent) -> None:
        if not self._has_had_scan:
            log.warning('%s: no scan for %.0f s', self._scans.resolved_name, SILENCE_S, extra=EVENT)
        self._has_had_scan = False
