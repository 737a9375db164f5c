"""Topics of move_base for displays: plans, footprints and costmaps."""

from __future__ import annotations

from typing import Dict, Type

import genpy
import numpy as np
import rospy
from geometry_msgs.msg import Point32, PolygonStamped
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Path

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.mapping.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.footprint import Footprint
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.ros.conversions import pose_stamped_message, stamp_from_ns
from diff_encoder_sim.ros.map_conversions import map_message

LINES_PERIOD_NS = 200_000_000  # of plans and footprints

# Costs 0 to 255 as costmap_2d publishes them: 1 to 98 for inflation, 99 inscribed, 100 lethal.
_OCCUPANCY_OF_COST = np.concatenate([[0], np.linspace(1, 98, 252).astype(np.int64), [99, 100, -1]]).astype(np.int8)


class NavigationViews:
    """Publishes the topics that have subscribers, each at a low rate."""

    def __init__(self, map_frame: str, odom_frame: str) -> None:
        self._map_frame, self._odom_frame = map_frame, odom_frame
        self._global_plans = display_publisher('~NavfnROS/plan', Path)
        self._plans_in_sight = display_publisher('~DWAPlannerROS/global_plan', Path)
        self._local_plans = display_publisher('~DWAPlannerROS/local_plan', Path)
        self._global_footprints = display_publisher('~global_costmap/footprint', PolygonStamped)
        self._local_footprints = display_publisher('~local_costmap/footprint', PolygonStamped)
        self._global_costmaps = display_publisher('~global_costmap/costmap', OccupancyGridMessage)
        self._local_costmaps = display_publisher('~local_costmap/costmap', OccupancyGridMessage)
        self._shown_ns: Dict[rospy.Publisher, int] = {}

    def show(self, navigator: Navigator, now_ns: int) -> None:
        """Publish the topics whose period is over."""
        plans = (
            (self._global_plans, self._map_frame, navigator.global_plan_in_map),
            (self._plans_in_sight, self._odom_frame, navigator.visible_plan_in_odom),
            (self._local_plans, self._odom_frame, navigator.local_plan_in_odom),
        )
        for plan_publisher, frame, poses in plans:
            if self._is_due(plan_publisher, LINES_PERIOD_NS, now_ns):
                plan_publisher.publish(path_message(poses, now_ns, frame))
        if navigator.inputs.has_pose:
            self._show_footprints(navigator, now_ns)
        self._show_costmaps(navigator, now_ns)

    def _show_footprints(self, navigator: Navigator, now_ns: int) -> None:
        inputs = navigator.inputs
        for footprint_publisher, frame, costmap, base_pose in (
            (self._global_footprints, self._map_frame, navigator.global_costmap, inputs.base_pose_in_map),
            (self._local_footprints, self._odom_frame, navigator.local_costmap, inputs.odometry.base_pose_in_odom),
        ):
            if self._is_due(footprint_publisher, LINES_PERIOD_NS, now_ns):
                footprint_publisher.publish(footprint_message(costmap.footprint, base_pose, now_ns, frame))

    def _show_costmaps(self, navigator: Navigator, now_ns: int) -> None:
        for costmap_publisher, frame, costmap in (
            (self._global_costmaps, self._map_frame, navigator.global_costmap),
            (self._local_costmaps, self._odom_frame, navigator.local_costmap),
        ):
            frequency_hz = costmap.params.publish_frequency
            if frequency_hz > 0 and self._is_due(
                costmap_publisher, round(NANOSECONDS_PER_SECOND / frequency_hz), now_ns
            ):
                costmap_publisher.publish(costmap_message(costmap, now_ns, frame))

    def _is_due(self, view: rospy.Publisher, period_ns: int, now_ns: int) -> bool:
        last_ns = self._shown_ns.get(view)
        if not view.get_num_connections() or (last_ns is not None and 0 <= now_ns - last_ns < period_ns):
            return False
        self._shown_ns[view] = now_ns
        return True


def display_publisher(topic: str, message_class: Type[genpy.Message]) -> rospy.Publisher:
    """Advertise a topic that drops messages rather than wait for a slow display: the robot must not wait."""
    return rospy.Publisher(topic, message_class, queue_size=1)


def path_message(poses: np.ndarray, stamp_ns: int, frame: str) -> Path:
    """Convert (n, 3) poses to a path."""
    message = Path(poses=[pose_stamped_message(Pose2D(*row), stamp_ns, frame) for row in poses.tolist()])
    message.header.stamp = stamp_from_ns(stamp_ns)
    message.header.frame_id = frame
    return message


def footprint_message(footprint: Footprint, base_pose: Pose2D, stamp_ns: int, frame: str) -> PolygonStamped:
    """Convert the robot's footprint at its pose."""
    message = PolygonStamped()
    for x_m, y_m in footprint.vertices_m.tolist():
        corner = base_pose.compose(Pose2D(x_m, y_m, 0.0))
        message.polygon.points.append(Point32(corner.x_m, corner.y_m, 0.0))
    message.header.stamp = stamp_from_ns(stamp_ns)
    message.header.frame_id = frame
    return message


def costmap_message(costmap: Costmap, stamp_ns: int, frame: str) -> OccupancyGridMessage:
    """Convert a costmap to the occupancy values that RViz colours as costs."""
    grid = OccupancyGrid(_OCCUPANCY_OF_COST[costmap.costs], costmap.resolution_m, costmap.origin)
    return map_message(grid, stamp_ns, frame)
