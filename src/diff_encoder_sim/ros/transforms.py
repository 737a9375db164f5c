"""Transform buffer, and scans with the odometry at their stamps."""

from __future__ import annotations

import math
from collections import deque
from typing import Callable, Deque, Set, Tuple

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.drives.message_decoders import decode_scan
from diff_encoder_sim.ros.messages import encoded_subscriber, ns_from_stamp, pose_from_transform, stamp_from_ns
from diff_encoder_sim.ros.node import CALLBACKS, log, timer


class TransformBuffer(tf2_ros.Buffer):  # type: ignore[misc]  # tf2 has no types
    """Buffer of /tf and /tf_static for `cache_s`; `on_change` is called after each message."""

    def __init__(self, cache_s: float = 10.0) -> None:
        super().__init__(rospy.Duration(cache_s))
        self.on_change: Callable[[], None] = lambda: None
        self._listener = _Listener(self, tcp_nodelay=True)


class _Listener(tf2_ros.TransformListener):  # type: ignore[misc]
    def callback(self, data: TFMessage) -> None:
        with CALLBACKS:
            super().callback(data)
            self.buffer.on_change()

    def static_callback(self, data: TFMessage) -> None:
        with CALLBACKS:
            super().static_callback(data)
            self.buffer.on_change()


class NoTransform(InputFault):
    """A transform is missing, and may still be received."""


def lookup(buffer: tf2_ros.BufferCore, parent: str, child: str) -> TransformStamped:
    """Return the latest transform between two frames, whose names may begin with '/'; NoTransform if there is none."""
    try:
        return buffer.lookup_transform(parent.lstrip('/'), child.lstrip('/'), rospy.Time(0))
    except tf2_ros.TransformException as error:
        raise NoTransform(f'no transform from {child!r} to {parent!r}: {str(error).rstrip(". ")}') from None


def mounted(scan: Scan, transform: TransformStamped) -> Tuple[Scan, Pose2D, float]:
    """Return a scan counter-clockwise in top view, and its laser's pose in the base and tilt [rad]; or InputFault."""
    pose = pose_from_transform(transform)
    rotation = transform.transform.rotation
    aside, upright = rotation.x**2 + rotation.y**2, rotation.z**2 + rotation.w**2
    up = (upright - aside) / (upright + aside)  # component of the laser's z axis along the base's
    if up < 0.0:
        scan = scan._replace(angle_min_rad=-scan.angle_min_rad, angle_increment_rad=-scan.angle_increment_rad)
    return scan, pose, math.acos(min(abs(up), 1.0))


# Maximum clock difference within a robot: after a scan from further ahead the next would look like a restart.
SCANS_MOST_AHEAD_S = 2.0
SILENCE_S = 15.0
PATIENCE_NS = 2 * NANOSECONDS_PER_SECOND  # age relative to the newest scan at which a scan is dropped
LONGEST_QUEUE = 100
LEVEL_WITHIN_RAD = math.radians(5.0)  # ranges of a laser are used as if it were level, above this with a warning


class ScanInput:
    """Subscribes to `scan`, delivers scans in order with the odometry at their stamps, and drops those that have none.

    `use` is called with a scan, the base's pose in odom and the laser's in base; `on_restart` with the stamp [ns] if
    time jumped back, before that scan is queued. Scans wait until `is_ready`.
    """

    def __init__(
        self,
        buffer: TransformBuffer,
        base_frame: str,
        odom_frame: str,
        use: Callable[[Scan, Pose2D, Pose2D], None],
        on_restart: Callable[[int], None],
        is_ready: Callable[[], bool] = lambda: True,
    ) -> None:
        self._buffer, self._base_frame, self._odom_frame = buffer, base_frame, odom_frame
        self._use, self._on_restart, self._is_ready = use, on_restart, is_ready
        self._timeline = Timeline(tolerance_ns=NANOSECONDS_PER_SECOND // 10)
        self._waiting: Deque[Tuple[Scan, str]] = deque(maxlen=LONGEST_QUEUE)  # with the frame of the laser
        self._tilted: Set[str] = set()
        self._has_had_scan = False
        self._scans = encoded_subscriber('scan', LaserScan, self._on_scan, SCANS_MOST_AHEAD_S)
        buffer.on_change = self._process  # the laser's transform may be received last
        timer(SILENCE_S, self._on_silence)

    def _on_scan(self, content: bytes) -> None:
        self._has_had_scan = True
        scan, frame = decode_scan(content)
        step = self._timeline.advance(scan.stamp_ns)
        if step is Step.RESTART:
            self._waiting.clear()
            self._on_restart(scan.stamp_ns)
        if step is not Step.STALE:
            self._waiting.append((scan, frame))
        self._process()

    def _process(self) -> None:
        """Deliver the scans that have transforms; drop older ones, and those that timed out."""
        if not self._is_ready():
            return
        held: Deque[Tuple[Scan, str]] = deque(maxlen=LONGEST_QUEUE)
        why_held = InputFault()
        for scan, frame in self._waiting:
            try:
                self._use(*self._placed(scan, frame))
            except NoTransform as fault:
                if self._waiting[-1][0].stamp_ns - scan.stamp_ns < PATIENCE_NS:
                    held.append((scan, frame))
                    why_held = fault
                    continue
                self._warn(fault)
            except InputFault as fault:
                self._warn(fault)
            if held:
                self._warn(why_held)
                held.clear()
        self._waiting = held

    def _warn(self, fault: InputFault) -> None:
        log.warning('%s: %s; scan dropped', self._scans.resolved_name, fault)

    def _placed(self, scan: Scan, frame: str) -> Tuple[Scan, Pose2D, Pose2D]:
        """Return the scan in top view, the base's pose in odom at its stamp, and the laser's pose in base."""
        level_scan, laser_pose, tilt_rad = mounted(scan, lookup(self._buffer, self._base_frame, frame))
        if tilt_rad > LEVEL_WITHIN_RAD and frame not in self._tilted:
            self._tilted.add(frame)
            what = self._scans.resolved_name, frame, math.degrees(tilt_rad)
            log.warning('%s: frame %r is tilted by %.0f degrees; used as if it were level', *what, extra=EVENT)
        frames = self._odom_frame, self._base_frame
        try:
            transform = self._buffer.lookup_transform(*frames, stamp_from_ns(scan.stamp_ns))
        except tf2_ros.TransformException:
            # The message of tf2 may be about map->odom, which has a future stamp.
            newest_ns = ns_from_stamp(lookup(self._buffer, *frames).header.stamp)
            ahead_s = (scan.stamp_ns - newest_ns) / NANOSECONDS_PER_SECOND
            missing = f'no transform from {self._base_frame!r} to {self._odom_frame!r} at its stamp'
            if ahead_s > 0.0:
                raise NoTransform(f'{missing} (the newest is {ahead_s:.1f} s older)') from None
            raise InputFault(f'{missing} (the buffer begins later)') from None
        return level_scan, pose_from_transform(transform), laser_pose

    def _on_silence(self) -> None:
        if not self._has_had_scan:
            log.warning('%s: no scan for %.0f s', self._scans.resolved_name, SILENCE_S, extra=EVENT)
        self._has_had_scan = False
