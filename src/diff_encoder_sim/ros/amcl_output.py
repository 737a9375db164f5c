"""What amcl_node publishes: topics, the transform map->odom, the saved pose, and warnings about its state."""

from __future__ import annotations

from typing import Optional, Tuple

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped

from diff_encoder_sim.base.errors import EVENT
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.pose_messages import encode_pose_array
from diff_encoder_sim.localization.amcl import Amcl, AmclEstimate
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.ros.amcl_spread import AmclSpread
from diff_encoder_sim.ros.conversions import pose_with_covariance_message, transform_message
from diff_encoder_sim.ros.encoded_topics import EncodedPublisher
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
