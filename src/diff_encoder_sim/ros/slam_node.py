"""slam_node: grid SLAM with the topics, service, parameters and transform of slam_gmapping."""

from __future__ import annotations

from typing import Optional

import rospy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, GetMapRequest, GetMapResponse
from pydantic import Field
from std_msgs.msg import Float64
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.base.bounds import Seed
from diff_encoder_sim.base.errors import EVENT
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives import message_encoders as encoders
from diff_encoder_sim.localization.grid_slam import GridSlam, warm_up
from diff_encoder_sim.localization.slam_params import GridSlamParams
from diff_encoder_sim.ros.messages import Publisher, clock_ns, map_message
from diff_encoder_sim.ros.node import compile_first, executable, log, node_params, service, timer, trial_plan
from diff_encoder_sim.ros.transforms import ScanInput, TransformBuffer


class SlamNodeParams(GridSlamParams):
    """Parameters of slam_node: those of slam_gmapping, and the seed."""

    seed: Seed = Field(0, description='of all random draws; default: the number of /trial')


class SlamNode:
    """Updates the map with each scan and the odometry at its stamp; publishes map, pose and transform."""

    def __init__(self) -> None:
        plan = trial_plan()
        self._params = node_params(SlamNodeParams, part='slam', defaults={'seed': plan.trial.number} if plan else {})
        compile_first(lambda: warm_up(self._params))
        # In a trial the map frame is the world frame, because the start pose is known.
        start = plan.trial.test.start.pose() if plan else None
        self._slam = GridSlam(self._params, generator(self._params.seed, 'slam'), start)
        self._scan_count = 0
        self._mapped_ns: Optional[int] = None
        self._broadcast_ns: Optional[int] = None
        self._transforms = Publisher('/tf', TFMessage)
        self._maps = Publisher('map', OccupancyGrid, latch=True)
        self._metadata = Publisher('map_metadata', MapMetaData, latch=True)
        self._entropies = Publisher('~entropy', Float64)
        self._poses = Publisher('~pose', PoseStamped)
        service('dynamic_map', GetMap, self._on_dynamic_map)
        frames = self._params.base_frame, self._params.odom_frame
        self._scans = ScanInput(TransformBuffer(30.0), *frames, self._use_scan, self._on_restart)
        if self._params.transform_publish_period > 0.0:
            timer(self._params.transform_publish_period, self._broadcast)

    def _on_restart(self, stamp_ns: int) -> None:
        at_s = stamp_ns / NANOSECONDS_PER_SECOND
        log.warning('scan stamps went back to %.3f s: keeping the map; ignored until a new maximum', at_s, extra=EVENT)

    def _use_scan(self, scan: Scan, odom_pose: Pose2D, laser_pose: Pose2D) -> None:
        self._scan_count += 1
        if (self._scan_count - 1) % self._params.throttle_scans == 0:
            estimate = self._slam.update(odom_pose, scan, laser_pose)
            if estimate is not None:
                self._entropies.publish(Float64(estimate.entropy))
                interval_ns = self._params.map_update_interval * NANOSECONDS_PER_SECOND
                if self._mapped_ns is None or scan.stamp_ns - self._mapped_ns >= interval_ns:
                    self._mapped_ns, grid = scan.stamp_ns, self._slam.map()
                    self._maps.publish(encoders.encode_map(grid, scan.stamp_ns, self._params.map_frame))
                    self._metadata.publish(encoders.encode_map_metadata(grid, scan.stamp_ns))
        if self._slam.odom_pose_in_map is not None:  # for every scan, because the simulator waits for it
            pose = self._slam.odom_pose_in_map.compose(odom_pose)
            self._poses.publish(encoders.encode_pose_stamped(pose, scan.stamp_ns, self._params.map_frame))

    def _broadcast(self) -> None:
        """Broadcast map->odom with a future stamp, so that lookups succeed until the next scan."""
        pose, params = self._slam.odom_pose_in_map, self._params
        delay_s = params.tf_delay if params.tf_delay >= 0.0 else params.transform_publish_period
        stamp_ns = clock_ns() + round(delay_s * NANOSECONDS_PER_SECOND)
        # Not without a map, nor at an equal time: tf2 warns of repeated stamps.
        if pose is not None and stamp_ns != self._broadcast_ns:
            self._broadcast_ns = stamp_ns
            self._transforms.publish(encoders.encode_planar_tf(pose, stamp_ns, params.map_frame, params.odom_frame))

    def _on_dynamic_map(self, _: GetMapRequest) -> GetMapResponse:
        if self._slam.last_estimate is None:
            raise rospy.ServiceException('there is no map yet')
        return GetMapResponse(map=map_message(self._slam.map(), clock_ns(), self._params.map_frame))


main = executable('slam_gmapping', SlamNode)
