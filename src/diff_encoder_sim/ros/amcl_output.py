"""What amcl_node publishes: topics, the transform map->odom, the saved pose, and warnings about its state."""

from __future__ import annotations

import math
from typing import NamedTuple, Optional, Tuple

import numpy as np
import rospy
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped

from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.pose_messages import encode_pose_array
from diff_encoder_sim.drives.topics import DIAGNOSTICS
from diff_encoder_sim.localization.amcl import Amcl, AmclEstimate
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.particles import check_covariance, check_pose
from diff_encoder_sim.ros.conversions import (
    pose_covariance_from_message,
    pose_from_message,
    pose_from_transform,
    pose_with_covariance_message,
    stamp_from_ns,
    transform_message,
)
from diff_encoder_sim.ros.encoded_topics import DisplayTopic, EncodedPublisher
from diff_encoder_sim.ros.node import log, publisher


class AmclOutput:
    """Publishes the state of the filter after each scan."""

    def __init__(self, params: AmclParams, diagnostic_period_s: float) -> None:
        self.params = params
        self._broadcaster = tf2_ros.TransformBroadcaster()
        self._poses = publisher('amcl_pose', PoseWithCovarianceStamped, latch=True)
        self._clouds = EncodedPublisher('particlecloud', PoseArray, latch=True)
        # The newest that can be saved, and the one that was saved: pose in the map, covariance.
        self._to_save: Optional[Tuple[Pose2D, np.ndarray]] = None
        self.saved: Optional[Tuple[Pose2D, np.ndarray]] = None
        self._spread = AmclSpread(diagnostic_period_s)
        self.restart()

    def restart(self) -> None:
        """Start anew with localization: warn again of what was warned of before."""
        self._was_lost = False
        self._spread.restart()
        self._seen_updates = 0
        self._saved_ns: Optional[int] = None

    def expect_lost(self, amcl: Amcl) -> None:
        """Do not warn that the robot is lost, where the user has requested it (global_localization)."""
        self._was_lost = amcl.is_lost

    def report(self, amcl: Amcl, stamp_ns: int, odom_pose: Pose2D, estimate: Optional[AmclEstimate]) -> None:
        """Publish the result of a scan that was taken at `odom_pose`; `estimate` if there is a new one."""
        if amcl.update_count != self._seen_updates:
            self._seen_updates = amcl.update_count
            self._publish_cloud(amcl, stamp_ns)
        if estimate is not None:
            self._poses.publish(
                pose_with_covariance_message(
                    estimate.base_pose_in_map, estimate.covariance, stamp_ns, self.params.global_frame_id
                )
            )
            self._spread.warn(estimate, self.params)
        self._warn_of_loss(amcl)
        if amcl.last_estimate is not None:
            self._spread.diagnose(amcl.last_estimate, self.params, stamp_ns)
        if amcl.last_estimate is not None and not amcl.is_lost:
            odom_pose_in_map = amcl.last_estimate.odom_pose_in_map
            self._broadcast(odom_pose_in_map, stamp_ns)
            self._to_save = odom_pose_in_map.compose(odom_pose), amcl.last_estimate.covariance
            self._save_when_due(stamp_ns)

    def _publish_cloud(self, amcl: Amcl, stamp_ns: int) -> None:
        self._clouds.publish(encode_pose_array(amcl.particles, stamp_ns, self.params.global_frame_id))

    def _broadcast(self, odom_pose_in_map: Pose2D, stamp_ns: int) -> None:
        if not self.params.tf_broadcast:
            return
        # Dated ahead, so that until the next scan lookups at the time of newer odometry succeed.
        ahead_ns = round(self.params.transform_tolerance * NANOSECONDS_PER_SECOND)
        self._broadcaster.sendTransform(
            transform_message(
                odom_pose_in_map, stamp_ns + ahead_ns, self.params.global_frame_id, self.params.odom_frame_id
            )
        )

    # ---- warnings

    def _warn_of_loss(self, amcl: Amcl) -> None:
        fit_percent = 100.0 * (amcl.fit_fraction or 0.0)
        if amcl.is_lost and not self._was_lost:
            log.warning(
                'localization lost: %.0f %% of the rays agree with the map (lost_fraction: %.0f %%); map -> odom is '
                'not published until enough do. Carry the robot back, set its pose by /initialpose, or call '
                'global_localization and drive it by hand',
                fit_percent,
                100.0 * self.params.lost_fraction,
                extra=EVENT,
            )
        elif self._was_lost and not amcl.is_lost:
            log.info('localized again: %.0f %% of the rays agree with the map', fit_percent, extra=EVENT)
        self._was_lost = amcl.is_lost

    # ---- the saved pose

    def _save_when_due(self, stamp_ns: int) -> None:
        rate = self.params.save_pose_rate
        if rate > 0.0 and (self._saved_ns is None or stamp_ns - self._saved_ns >= NANOSECONDS_PER_SECOND / rate):
            self._saved_ns = stamp_ns
            self.save()

    def save(self) -> None:
        """Write the pose into the initial_* parameters, where a restarted node starts from."""
        if self._to_save is None or self.params.save_pose_rate <= 0.0:
            return
        pose, covariance = self._to_save
        try:
            for name, value in (
                ('pose_x', pose.x_m),
                ('pose_y', pose.y_m),
                ('pose_a', pose.yaw_rad),
                ('cov_xx', covariance[0, 0]),
                ('cov_yy', covariance[1, 1]),
                ('cov_aa', covariance[2, 2]),
            ):
                rospy.set_param(f'~initial_{name}', float(value))
        except (rospy.ROSException, OSError) as error:
            log.warning('the pose could not be saved in the initial_* parameters: %s', error)
            return
        self.saved = pose, np.diag(np.diag(covariance))


class Spread(NamedTuple):
    """Standard deviations of an estimate, or limits of them."""

    x: float  # [m]
    y: float  # [m]
    yaw: float  # [rad]

    def exceeds(self, limits: Spread) -> bool:
        """Return whether one of them is above its limit."""
        return any(value > limit for value, limit in zip(self, limits))


class AmclSpread:
    """Compares each estimate with std_warn_level_*, as upstream's diagnostics."""

    def __init__(self, diagnostic_period_s: float) -> None:
        self._period_ns = diagnostic_period_s * NANOSECONDS_PER_SECOND
        self._diagnostics = DisplayTopic(DIAGNOSTICS, DiagnosticArray, queue_size=10)
        self.restart()

    def restart(self) -> None:
        """Start anew with localization: at the start the particles are far apart, which is no reason for a warning."""
        self._was_exceeded = True

    def warn(self, estimate: AmclEstimate, params: AmclParams) -> None:
        """Log a warning where the estimate begins to exceed a limit."""
        spread, limits = _spread(estimate), _limits(params)
        is_exceeded = spread.exceeds(limits)
        if is_exceeded and not self._was_exceeded:
            log.warning(
                'uncertain pose: standard deviations %.2f m (x), %.2f m (y), %.0f degrees; above std_warn_level_* '
                '(%.2f m, %.2f m, %.0f degrees)',
                *spread[:2],
                math.degrees(spread.yaw),
                *limits[:2],
                math.degrees(limits.yaw),
            )
        self._was_exceeded = is_exceeded

    def diagnose(self, estimate: AmclEstimate, params: AmclParams, now_ns: int) -> None:
        """Publish the status of the newest estimate, once a period and to subscribers."""
        if self._diagnostics.is_due(self._period_ns, now_ns):
            message = DiagnosticArray(status=[spread_status(_spread(estimate), _limits(params))])
            message.header.stamp = stamp_from_ns(now_ns)
            self._diagnostics.publish(message)


def spread_status(spread: Spread, limits: Spread) -> DiagnosticStatus:
    """Return the status that upstream's amcl has, with its name, words and keys."""
    is_exceeded = spread.exceeds(limits)
    values = {
        **{f'std_{name}': value for name, value in spread._asdict().items()},
        **{f'std_warn_level_{name}': value for name, value in limits._asdict().items()},
    }
    return DiagnosticStatus(
        level=DiagnosticStatus.WARN if is_exceeded else DiagnosticStatus.OK,
        name=f'{rospy.get_name().lstrip("/")}: Standard deviation',
        message='Too large' if is_exceeded else 'OK',
        hardware_id='None',
        values=[KeyValue(key, f'{value:g}') for key, value in values.items()],
    )


def _spread(estimate: AmclEstimate) -> Spread:
    return Spread(*np.sqrt(np.diag(estimate.covariance)).tolist())


def _limits(params: AmclParams) -> Spread:
    return Spread(params.std_warn_level_x, params.std_warn_level_y, params.std_warn_level_yaw)


# A base pose in the map with its 3x3 covariance over (x [m], y [m], yaw [rad]).
PoseGuess = Tuple[Pose2D, np.ndarray]


class InitialPoseReader:
    """Reads messages with a pose in the map; the frames are those of the parameters."""

    def __init__(self, params: AmclParams, buffer: tf2_ros.Buffer) -> None:
        self._global_frame = params.global_frame_id
        self._odom_to_base = params.odom_frame_id, params.base_frame_id
        self._buffer = buffer

    def read(self, message: PoseWithCovarianceStamped) -> PoseGuess:
        """Return the pose that a message gives, moved by odometry from the message's stamp to now.

        Raises:
            InputFault: it is no valid pose, or in another frame than the map's.
        """
        frame = message.header.frame_id.lstrip('/')
        if not frame:
            log.warning('initial pose: header.frame_id is empty; used as if it were %r', self._global_frame)
        elif frame != self._global_frame:
            raise InputFault(f'header.frame_id is {frame!r}; expected {self._global_frame!r}')
        pose = pose_from_message(message.pose.pose)
        covariance = pose_covariance_from_message(message.pose.covariance)
        check_pose(pose, 'initial pose')
        check_covariance(covariance)
        return pose.compose(self._moved_since(message.header.stamp)), covariance

    def _moved_since(self, stamp: rospy.Time) -> Pose2D:
        """Return the base's pose now in the base frame at a stamp, by odometry; a stamp of 0 means now."""
        try:
            now = self._buffer.lookup_transform(*self._odom_to_base, rospy.Time(0))
            if stamp.is_zero() or stamp >= now.header.stamp:
                return IDENTITY
            then = self._buffer.lookup_transform(*self._odom_to_base, stamp)
        except tf2_ros.TransformException as error:
            if not stamp.is_zero():
                log.warning('initial pose: not corrected for the motion since its stamp: %s', error)
            return IDENTITY
        return pose_from_transform(now).relative_to(pose_from_transform(then))
