"""slam_node: grid SLAM on slam_gmapping's topics, service, parameters and transform."""

from __future__ import annotations

import threading
from typing import Optional

import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import MapMetaData
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.srv import GetMap, GetMapRequest, GetMapResponse
from pydantic import Field
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float64

from diff_encoder_sim.base.bounds import Seed
from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline, check_stamp
from diff_encoder_sim.localization.grid_slam import GridSlam, warm_up
from diff_encoder_sim.localization.slam_params import GridSlamParams
from diff_encoder_sim.ros.conversions import ns_from_stamp, pose_stamped_message, transform_message
from diff_encoder_sim.ros.encoded_topics import stamped_subscriber
from diff_encoder_sim.ros.maps import map_message
from diff_encoder_sim.ros.node import compile_first, log, node_params, publisher, run_node, trial_plan
from diff_encoder_sim.ros.transforms import SCANS_MOST_AHEAD_S, ScanQueue, TransformBuffer

SILENCE_S = 15.0


class SlamNodeParams(GridSlamParams):
    """Parameters of slam_node: slam_gmapping's, and the seed of all random draws."""

    seed: Seed = Field(0, description='of all random draws; default: the number of /trial')


class SlamNode:
    """Updates the map with each scan and the odometry at its stamp; publishes map, pose and transform."""

    def __init__(self) -> None:
        plan = trial_plan()
        self._params = node_params(SlamNodeParams, part='slam', defaults={'seed': plan.trial.number} if plan else {})
        compile_first(lambda: warm_up(self._params))
        # In a trial the map's frame is the world's, because the start is surveyed.
        start = plan.trial.test.start.pose() if plan else None
        self._slam = GridSlam(self._params, generator(self._params.seed, 'slam'), start)
        self._lock = threading.RLock()  # scans, transforms, timers and the service come in threads
        self._scan_count = 0
        self._timeline = Timeline(tolerance_ns=NANOSECONDS_PER_SECOND // 10)
        self._mapped_ns: Optional[int] = None
        self._broadcast_ns: Optional[int] = None
        self._buffer = TransformBuffer(cache_s=30.0)
        self._broadcaster = tf2_ros.TransformBroadcaster()
        self._maps = publisher('map', OccupancyGridMessage, latch=True)
        self._metadata = publisher('map_metadata', MapMetaData, latch=True)
        self._entropies = publisher('~entropy', Float64)
        self._poses = publisher('~pose', PoseStamped)
        self._service = rospy.Service('dynamic_map', GetMap, self._on_dynamic_map)
        self._queue = ScanQueue(
            rospy.resolve_name('scan'), self._buffer, self._params.base_frame, self._params.odom_frame, self._take
        )
        self._scans = stamped_subscriber('scan', LaserScan, self._on_scan, SCANS_MOST_AHEAD_S)
        # The laser's transform may come last, after the scan and its odometry.
        self._buffer.listen(self._process)
        self._has_had_scan = False
        self._silence = rospy.Timer(rospy.Duration(SILENCE_S), self._on_silence, reset=True)
        if self._params.transform_publish_period > 0.0:
            self._timer = rospy.Timer(
                rospy.Duration(self._params.transform_publish_period), self._broadcast, reset=True
            )

    # ---- scans

    def _on_scan(self, message: LaserScan) -> None:
        self._has_had_scan = True
        with self._lock:
            stamp_ns = ns_from_stamp(message.header.stamp)
            if self._timeline.advance(stamp_ns) is Step.RESTART:
                log.warning(
                    'scan stamps went back to %.3f s: the map so far is kept, and nothing is added to it until the '
                    'stamps are past where they were',
                    stamp_ns / NANOSECONDS_PER_SECOND,
                    extra=EVENT,
                )
            self._queue.add(message)
        self._process()

    def _process(self) -> None:
        with self._lock:
            self._queue.process()

    def _take(self, scan: Scan, odom_pose: Pose2D, laser_pose: Pose2D) -> None:
        self._scan_count += 1
        if (self._scan_count - 1) % self._params.throttle_scans == 0:
            self._map(scan, odom_pose, laser_pose)
        # For every scan, so that the simulator can wait for it.
        if self._slam.odom_pose_in_map is not None:
            self._poses.publish(
                pose_stamped_message(
                    self._slam.odom_pose_in_map.compose(odom_pose), scan.stamp_ns, self._params.map_frame
                )
            )

    def _map(self, scan: Scan, odom_pose: Pose2D, laser_pose: Pose2D) -> None:
        estimate = self._slam.update(odom_pose, scan, laser_pose)
        if estimate is None:
            return
        self._entropies.publish(Float64(estimate.entropy))
        interval_ns = self._params.map_update_interval * NANOSECONDS_PER_SECOND
        if self._mapped_ns is None or scan.stamp_ns - self._mapped_ns >= interval_ns:
            self._mapped_ns = scan.stamp_ns
            self._publish_map(scan.stamp_ns)

    def _on_silence(self, _: rospy.timer.TimerEvent) -> None:
        if not self._has_had_scan:
            log.warning(
                '%s: no scan for %.0f s: nothing is added to the map', self._scans.resolved_name, SILENCE_S, extra=EVENT
            )
        self._has_had_scan = False

    # ---- outputs

    def _publish_map(self, stamp_ns: int) -> None:
        message = map_message(self._slam.map(), stamp_ns, self._params.map_frame)
        self._maps.publish(message)
        self._metadata.publish(message.info)

    def _broadcast(self, _: rospy.timer.TimerEvent) -> None:
        """Broadcast map->odom, dated ahead, so that lookups at the time of newer odometry succeed."""
        with self._lock:
            odom_pose_in_map = self._slam.odom_pose_in_map
        if odom_pose_in_map is None:
            return
        delay_s = self._params.tf_delay
        if delay_s < 0.0:
            delay_s = self._params.transform_publish_period
        stamp_ns = ns_from_stamp(rospy.Time.now()) + round(delay_s * NANOSECONDS_PER_SECOND)
        if stamp_ns == self._broadcast_ns:
            return  # the clock has not moved: tf2 warns of repeated stamps
        try:
            check_stamp(stamp_ns)
        except InputFault as fault:
            log.warning('/clock: %s; map -> odom not published', fault)
            return
        self._broadcast_ns = stamp_ns
        self._broadcaster.sendTransform(
            transform_message(odom_pose_in_map, stamp_ns, self._params.map_frame, self._params.odom_frame)
        )

    def _on_dynamic_map(self, _: GetMapRequest) -> GetMapResponse:
        """Respond with the current map."""
        with self._lock:
            if self._slam.last_estimate is None:
                raise rospy.ServiceException('there is no map yet')
            return GetMapResponse(
                map=map_message(self._slam.map(), ns_from_stamp(rospy.Time.now()), self._params.map_frame)
            )


def main() -> None:
    """Run the node."""
    run_node('slam_gmapping', SlamNode)
