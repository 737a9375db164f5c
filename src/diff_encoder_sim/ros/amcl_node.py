"""amcl_node: localization on upstream amcl's topics, services, parameters and transform."""
from __future__ import annotations

import threading
from collections import deque
from typing import Deque, Optional

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.srv import SetMap, SetMapRequest, SetMapResponse
from pydantic import Field
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.errors import InputFault
from diff_encoder_sim.localization.amcl import Amcl, AmclEstimate
from diff_encoder_sim.localization.params import AmclParams
from diff_encoder_sim.ros.conversions import (ns_from_stamp, pose_covariance_from_message,
                                              pose_from_message, pose_from_transform,
                                              pose_message, pose_with_covariance_message,
                                              scan_from_message, stamp_from_ns, transform_message)
from diff_encoder_sim.ros.map_client import fetch_map
from diff_encoder_sim.ros.map_conversions import grid_from_message
from diff_encoder_sim.ros.node import log, node_params, publisher, run_node, subscriber
from diff_encoder_sim.ros.trial_plan import trial_plan
from diff_encoder_sim.scan import Scan
from diff_encoder_sim.se2 import Pose2D
from diff_encoder_sim.seeds import generator
from diff_encoder_sim.timeline import NANOSECONDS_PER_SECOND, Step, Timeline

# Scans that may wait for the odometry of their time: ten seconds of them at 10 Hz.
LONGEST_QUEUE = 100


class AmclNodeParams(AmclParams):
    """Parameters of amcl_node: upstream's, and the seed of all random draws."""

    seed: int = Field(0, ge=0)


class AmclNode:
    """Waits for a map, then feeds each scan to the filter with the odometry of its time."""

    def __init__(self) -> None:
        self._params = node_params(AmclNodeParams, defaults=_trial_defaults())
        self._lock = threading.RLock()  # scans, transforms and services come in threads
        self._amcl: Optional[Amcl] = None
        self._rng = generator(self._params.seed, 'amcl')
        self._waiting: Deque[LaserScan] = deque(maxlen=LONGEST_QUEUE)
        self._timeline = Timeline(tolerance_ns=NANOSECONDS_PER_SECOND // 10)
        self._buffer = tf2_ros.Buffer(rospy.Duration(30.0))
        self._listener = tf2_ros.TransformListener(self._buffer, tcp_nodelay=True)
        self._undelayed = publisher('/tf', TFMessage)
        self._broadcaster = tf2_ros.TransformBroadcaster()
        self._poses = publisher('amcl_pose', PoseWithCovarianceStamped, latch=True)
        self._clouds = publisher('particlecloud', PoseArray)
        self._subscribe()

    def _subscribe(self) -> None:
        self._services = [
            rospy.Service('global_localization', Empty, self._on_global_localization),
            rospy.Service('request_nomotion_update', Empty, self._on_nomotion_update),
            rospy.Service('set_map', SetMap, self._on_set_map)]
        self._initial_poses = subscriber('initialpose', PoseWithCovarianceStamped,
                                         self._on_initial_pose)
        self._scans = subscriber('scan', LaserScan, self._on_scan)
        self._transforms = subscriber('/tf', TFMessage, lambda _: self._process())
        if self._params.use_map_topic:
            self._maps = subscriber('map', OccupancyGridMessage, self._on_map)
        else:
            fetch_map(self._use_map)

    def _on_map(self, message: OccupancyGridMessage) -> None:
        if self._amcl is None or not self._params.first_map_only:
            self._use_map(message)

    def _use_map(self, message: OccupancyGridMessage, pose: Optional[Pose2D] = None,
                 covariance: Optional[np.ndarray] = None) -> bool:
        try:
            grid = grid_from_message(message)
            with self._lock:
                if self._amcl is None:
                    self._amcl = Amcl(self._params, grid, self._rng)
                else:
                    self._amcl.set_map(grid, pose, covariance)
        except InputFault as fault:
            log.warning('map: %s; not used', fault)
            return False
        return True

    def _on_scan(self, message: LaserScan) -> None:
        with self._lock:
            step = self._timeline.advance(ns_from_stamp(message.header.stamp))
            if step is Step.RESTART:
                log.warning('scan stamps went back: localization begins again')
                self._waiting.clear()
                self._buffer.clear()
                if self._amcl is not None:
                    self._amcl.set_map(self._amcl.grid)
            if step is not Step.STALE:
                self._waiting.append(message)
        self._process()

    def _process(self) -> None:
        """Take the waiting scans in order, as far as transforms have come."""
        with self._lock:
            while self._waiting and self._amcl is not None:
                message = self._waiting[0]
                try:
                    laser_pose = self._lookup(self._params.base_frame_id, message.header.frame_id,
                                              rospy.Time(0))
                    odom_pose = self._lookup(self._params.odom_frame_id,
                                             self._params.base_frame_id, message.header.stamp)
                except tf2_ros.TransformException as error:
                    if 'past' not in str(error):
                        log.debug('waiting for %s', error)
                        return
                    log.warning('%s: %s; scan dropped', self._scans.resolved_name, error)
                    self._waiting.popleft()
                    continue
                self._waiting.popleft()
                self._localize(message, odom_pose, laser_pose)

    def _lookup(self, parent: str, child: str, stamp: rospy.Time) -> Pose2D:
        return pose_from_transform(self._buffer.lookup_transform(parent, child, stamp))

    def _localize(self, message: LaserScan, odom_pose: Pose2D, laser_pose: Pose2D) -> None:
        try:
            scan = scan_from_message(message)
            estimate = self._amcl.update(odom_pose, scan, laser_pose)
        except InputFault as fault:
            log.warning('%s: %s; scan dropped', self._scans.resolved_name, fault)
            return
        if estimate is not None:
            self._report(estimate)
        self._broadcast(scan)

    def _report(self, estimate: AmclEstimate) -> None:
        frame = self._params.global_frame_id
        self._poses.publish(pose_with_covariance_message(
            estimate.base_pose_in_map, estimate.covariance, estimate.stamp_ns, frame))
        if self._clouds.get_num_connections():
            cloud = PoseArray(poses=[pose_message(Pose2D(*row))
                                     for row in estimate.particles.tolist()])
            cloud.header.stamp = stamp_from_ns(estimate.stamp_ns)
            cloud.header.frame_id = frame
            self._clouds.publish(cloud)

    def _broadcast(self, scan: Scan) -> None:
        odom_pose_in_map = self._amcl.odom_pose_in_map
        if odom_pose_in_map is None or not self._params.tf_broadcast:
            return
        # Dated ahead: until the next scan, transforms of newer odometry find this one.
        ahead_ns = round(self._params.transform_tolerance * NANOSECONDS_PER_SECOND)
        self._broadcaster.sendTransform(transform_message(
            odom_pose_in_map, scan.stamp_ns + ahead_ns, self._params.global_frame_id,
            self._params.odom_frame_id))

    def _on_initial_pose(self, message: PoseWithCovarianceStamped) -> None:
        frame = message.header.frame_id
        if frame.lstrip('/') != self._params.global_frame_id:
            log.warning('%s: pose in frame %r; expected %r; ignored',
                        self._initial_poses.resolved_name, frame, self._params.global_frame_id)
            return
        try:
            with self._lock:
                if self._amcl is None:
                    raise InputFault('there is no map yet')
                self._amcl.set_pose(pose_from_message(message.pose.pose),
                                    pose_covariance_from_message(message.pose.covariance))
        except InputFault as fault:
            log.warning('%s: %s; ignored', self._initial_poses.resolved_name, fault)

    def _on_global_localization(self, _: EmptyRequest) -> EmptyResponse:
        with self._lock:
            if self._amcl is not None:
                self._amcl.global_localization()
        return EmptyResponse()

    def _on_nomotion_update(self, _: EmptyRequest) -> EmptyResponse:
        with self._lock:
            if self._amcl is not None:
                self._amcl.request_nomotion_update()
        return EmptyResponse()

    def _on_set_map(self, request: SetMapRequest) -> SetMapResponse:
        initial = request.initial_pose.pose
        try:
            pose = pose_from_message(initial.pose)
            covariance = pose_covariance_from_message(initial.covariance)
        except InputFault as fault:
            log.warning('set_map: %s; ignored', fault)
            return SetMapResponse(success=False)
        return SetMapResponse(success=self._use_map(request.map, pose, covariance))


def _trial_defaults() -> dict:
    plan = trial_plan()
    if plan is None:
        return {}
    start = plan.trial.test.start
    return {'initial_pose_x': start.x, 'initial_pose_y': start.y, 'initial_pose_a': start.yaw,
            'seed': plan.trial.number}


def main() -> None:
    """Entry point of the executable."""
    run_node('amcl', AmclNode)
