"""Topics of move_base for displays: plans, costmaps with footprints, and DWA samples."""

from __future__ import annotations

import math
from typing import Optional, Sequence

import numpy as np
from geometry_msgs.msg import Point32, Polygon, PolygonStamped
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Path
from sensor_msgs.msg import PointCloud2, PointField

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.dwa import COST_FIELDS, TRAJECTORY_FIELDS, cost_cloud, trajectory_cloud
from diff_encoder_sim.navigation.dwa_kernels import ScoringTask
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.ros.messages import DisplayTopic, header, map_message, pose_stamped_message

PERIOD_NS = 200_000_000  # of plans, footprints and clouds
WAITING_UPDATES = 20  # of a costmap: a lost update would leave the display wrong

# Costs 0 to 255 as costmap_2d publishes them: 1 to 98 for inflation, 99 inscribed, 100 lethal.
_OCCUPANCY_OF_COST = np.concatenate([[0], np.linspace(1, 98, 252).astype(np.int64), [99, 100, -1]]).astype(np.int8)


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
        """Publish the topics whose period has elapsed."""
        for topic, frame, poses in (
            (self._global_plans, self._map_frame, navigator.run.global_plan_in_map),
            (self._plans_in_sight, self._odom_frame, navigator.visible_plan_in_odom),
            (self._local_plans, self._odom_frame, navigator.run.local_plan_in_odom),
        ):
            if topic.is_due(PERIOD_NS, now_ns):
                topic.publish(path_message(poses, now_ns, frame))
        has_pose = navigator.has_pose
        self._global_costmap.show(navigator.global_costmap, navigator.base_pose_in_map if has_pose else None, now_ns)
        base_pose_in_odom = navigator.odometry.base_pose_in_odom if has_pose else None
        self._local_costmap.show(navigator.local_costmap, base_pose_in_odom, now_ns)
        self._dwa.show(navigator, now_ns)


def path_message(poses: np.ndarray, stamp_ns: int, frame: str) -> Path:
    """Convert (n, 3) poses to a path."""
    rows = poses.tolist()
    return Path(header(stamp_ns, frame), [pose_stamped_message(Pose2D(*row), stamp_ns, frame) for row in rows])


class CostmapView:
    """Publishes a costmap as costmap_2d: updates if they have subscribers, whole for new ones and moved windows."""

    def __init__(self, name: str, frame: str) -> None:
        self._frame = frame
        self._grids = DisplayTopic(f'~{name}/costmap', OccupancyGridMessage)
        self._updates = DisplayTopic(f'~{name}/costmap_updates', OccupancyGridUpdate, WAITING_UPDATES)
        self._footprints = DisplayTopic(f'~{name}/footprint', PolygonStamped)
        self._shown_costs, self._shown_origin = np.empty((0, 0), np.uint8), Pose2D(0.0, 0.0, 0.0)

    def show(self, costmap: Costmap, base_pose: Optional[Pose2D], now_ns: int) -> None:
        """Publish due messages; `base_pose` is the robot in the costmap's frame, None if unknown."""
        has_newcomers, frequency_hz = self._grids.has_newcomers(), costmap.params.publish_frequency
        period_ns = NANOSECONDS_PER_SECOND / frequency_hz if frequency_hz > 0.0 else math.inf
        if has_newcomers or self._grids.is_due(period_ns, now_ns):
            self._show_costs(costmap, has_newcomers, now_ns)
        if base_pose is not None and self._footprints.is_due(PERIOD_NS, now_ns):
            corners = [base_pose.compose(Pose2D(x_m, y_m, 0.0)) for x_m, y_m in costmap.footprint.vertices_m.tolist()]
            outline = Polygon([Point32(corner.x_m, corner.y_m, 0.0) for corner in corners])
            self._footprints.publish(PolygonStamped(header(now_ns, self._frame), outline))

    def _show_costs(self, costmap: Costmap, has_newcomers: bool, now_ns: int) -> None:
        is_moved = costmap.shape != self._shown_costs.shape or costmap.origin != self._shown_origin
        is_whole = costmap.params.always_send_full_costmap or not self._updates.subscriber_count()
        if has_newcomers or is_moved or is_whole:
            # The occupancy values that RViz colours as costs.
            grid = OccupancyGrid(_OCCUPANCY_OF_COST[costmap.costs], costmap.resolution_m, costmap.origin)
            self._grids.publish(map_message(grid, now_ns, self._frame))
        else:
            differs = self._shown_costs != costmap.costs
            if not differs.any():
                return
            # The smallest window with all changed cells.
            rows, columns = np.flatnonzero(differs.any(axis=1)), np.flatnonzero(differs.any(axis=0))
            top, left = int(rows[0]), int(columns[0])
            cells = _OCCUPANCY_OF_COST[costmap.costs[top : rows[-1] + 1, left : columns[-1] + 1]]
            height, width = cells.shape
            place = header(now_ns, self._frame), left, top, width, height
            self._updates.publish(OccupancyGridUpdate(*place, cells.ravel().tolist()))
        self._shown_costs, self._shown_origin = costmap.costs.copy(), costmap.origin


class DwaView:
    """Publishes the clouds enabled by publish_traj_pc and publish_cost_grid_pc, after periods with samples."""

    def __init__(self, frame: str) -> None:
        self._frame = frame
        self._trajectories = DisplayTopic('~DWAPlannerROS/trajectory_cloud', PointCloud2)
        self._costs = DisplayTopic('~DWAPlannerROS/cost_cloud', PointCloud2)
        self._shown: Optional[ScoringTask] = None

    def show(self, navigator: Navigator, now_ns: int) -> None:
        """Publish due messages."""
        task, params = navigator.scoring_task, navigator.params.DWAPlannerROS
        if task is None or task is self._shown:
            return
        self._shown, origin = task, navigator.local_costmap.origin
        if params.publish_traj_pc and self._trajectories.is_due(PERIOD_NS, now_ns):
            points = trajectory_cloud(task, origin)
            self._trajectories.publish(cloud_message(points, TRAJECTORY_FIELDS, now_ns, self._frame))
        if params.publish_cost_grid_pc and self._costs.is_due(PERIOD_NS, now_ns):
            points = cost_cloud(task, origin)
            self._costs.publish(cloud_message(points, COST_FIELDS, now_ns, self._frame))


def cloud_message(points: np.ndarray, names: Sequence[str], stamp_ns: int, frame: str) -> PointCloud2:
    """Convert points (n, columns) to a cloud of one row, with a float32 field for each column."""
    fields = [PointField(name, 4 * index, PointField.FLOAT32, 1) for index, name in enumerate(names)]
    step, count = 4 * len(names), len(points)
    data = points.astype('<f4').tobytes()
    return PointCloud2(header(stamp_ns, frame), 1, count, fields, False, step, step * count, data, True)
