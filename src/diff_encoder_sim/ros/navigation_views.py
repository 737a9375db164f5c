"""Topics of move_base for displays: plans, costmaps with footprints, and what the DWA has chosen from."""

from __future__ import annotations

import numpy as np
from nav_msgs.msg import Path

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.ros.conversions import pose_stamped_message, stamp_from_ns
from diff_encoder_sim.ros.costmap_view import CostmapView
from diff_encoder_sim.ros.display_topic import DisplayTopic
from diff_encoder_sim.ros.dwa_view import DwaView

PLANS_PERIOD_NS = 200_000_000


class NavigationViews:
    """Publishes the topics that have subscribers, each at a low rate."""

    def __init__(self, map_frame: str, odom_frame: str) -> None:
        self._map_frame, self._odom_frame = map_frame, odom_frame
        self._global_plans = DisplayTopic('~NavfnROS/plan', Path)
        self._plans_in_sight = DisplayTopic('~DWAPlannerROS/global_plan', Path)
        self._local_plans = DisplayTopic('~DWAPlannerROS/local_plan', Path)
        self._global_costmap = CostmapView('global_costmap', map_frame)
        self._local_costmap = CostmapView('local_costmap', odom_frame)
        self._dwa = DwaView(odom_frame)

    def show(self, navigator: Navigator, now_ns: int) -> None:
        """Publish the topics whose period is over."""
        plans = (
            (self._global_plans, self._map_frame, navigator.global_plan_in_map),
            (self._plans_in_sight, self._odom_frame, navigator.visible_plan_in_odom),
            (self._local_plans, self._odom_frame, navigator.local_plan_in_odom),
        )
        for topic, frame, poses in plans:
            if topic.is_due(PLANS_PERIOD_NS, now_ns):
                topic.publish(path_message(poses, now_ns, frame))
        inputs = navigator.inputs
        base_poses = (inputs.base_pose_in_map, inputs.odometry.base_pose_in_odom) if inputs.has_pose else (None, None)
        self._global_costmap.show(navigator.global_costmap, base_poses[0], now_ns)
        self._local_costmap.show(navigator.local_costmap, base_poses[1], now_ns)
        self._dwa.show(navigator, now_ns)


def path_message(poses: np.ndarray, stamp_ns: int, frame: str) -> Path:
    """Convert (n, 3) poses to a path."""
    message = Path(poses=[pose_stamped_message(Pose2D(*row), stamp_ns, frame) for row in poses.tolist()])
    message.header.stamp = stamp_from_ns(stamp_ns)
    message.header.frame_id = frame
    return message
