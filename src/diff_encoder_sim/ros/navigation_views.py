"""Topics of move_base for displays: plans, costmaps with footprints, and DWA samples."""

from __future__ import annotations

import math
from typing import Any, Callable, Optional, Sequence

import numpy as np
from geometry_msgs.msg import Point32, Polygon, PolygonStamped, PoseStamped
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Path
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.dwa import COST_FIELDS, TRAJECTORY_FIELDS, cost_cloud, trajectory_cloud
from diff_encoder_sim.navigation.dwa_kernels import ScoringTask
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.ros.messages import DisplayTopic, header, map_message, pose_message

PERIOD_NS = 200_000_000  # of plans, footprints and clouds
WAITING_UPDATES = 20  # of a costmap: a lost update would leave the display wrong

# Costs 0 to 255 as costmap_2d publishes them: 1 to 98 for inflation, 99 inscribed, 100 lethal.
_OCCUPANCY_OF_COST = np.concatenate([[0], np.linspace(1, 98, 252).astype(np.int64), [99, 100, -1]]).astype(np.int8)


class NavigationViews:
    """Publishes the topics that have subscribers, each at a low rate."""

    def __init__(self, map_frame: str, odom_frame: str) -> None:
        self._map_frame, self._odom_frame = map_frame, odom_frame
        dwa = '~DWAPlannerROS'
        plans = '~NavfnROS/plan', f'{dwa}/global_plan', f'{dwa}/local_plan'
        self._plans = [DisplayTopic(name, Path) for name in plans]
        self._footprints = [DisplayTopic(f'~{name}_costmap/footprint', PolygonStamped) for name in ('global', 'local')]
        self._clouds = [DisplayTopic(f'{dwa}/{name}_cloud', PointCloud2) for name in ('trajectory', 'cost')]
        self._costmaps = CostmapView('global_costmap', map_frame), CostmapView('local_costmap', odom_frame)
        self._task: Optional[ScoringTask] = None

    def show(self, navigator: Navigator, now_ns: int) -> None:
        """Publish the topics whose period has elapsed."""
        of_map, of_odom = header(now_ns, self._map_frame), header(now_ns, self._odom_frame)
        run, local = navigator.run, navigator.local_costmap

        def show(topic: DisplayTopic, build: Callable[[], Any]) -> None:
            if topic.is_due(PERIOD_NS, now_ns):
                topic.publish(build())

        show(self._plans[0], lambda: path_message(run.global_plan_in_map, of_map))
        show(self._plans[1], lambda: path_message(navigator.visible_plan_in_odom, of_odom))
        show(self._plans[2], lambda: path_message(run.local_plan_in_odom, of_odom))
        if navigator.has_pose:
            base_poses = navigator.base_pose_in_map, navigator.odometry.base_pose_in_odom
            show(self._footprints[0], lambda: footprint_message(navigator.global_costmap, base_poses[0], of_map))
            show(self._footprints[1], lambda: footprint_message(local, base_poses[1], of_odom))
        task, params, origin = navigator.scoring_task, navigator.params.DWAPlannerROS, local.origin
        if task is not None and task is not self._task:
            self._task = task
            if params.publish_traj_pc:
                show(self._clouds[0], lambda: cloud_message(trajectory_cloud(task, origin), TRAJECTORY_FIELDS, of_odom))
            if params.publish_cost_grid_pc:
                show(self._clouds[1], lambda: cloud_message(cost_cloud(task, origin), COST_FIELDS, of_odom))
        for costmap, view in zip((navigator.global_costmap, local), self._costmaps):
            view.show(costmap, now_ns)


def path_message(poses: np.ndarray, place: Header) -> Path:
    """Convert (n, 3) poses to a path."""
    return Path(place, [PoseStamped(place, pose_message(Pose2D(*row))) for row in poses.tolist()])


def footprint_message(costmap: Costmap, base_pose: Pose2D, place: Header) -> PolygonStamped:
    """Convert the robot's footprint; `base_pose` is in the costmap's frame."""
    corners = [base_pose.compose(Pose2D(x_m, y_m, 0.0)) for x_m, y_m in costmap.footprint.vertices_m.tolist()]
    return PolygonStamped(place, Polygon([Point32(corner.x_m, corner.y_m, 0.0) for corner in corners]))


class CostmapView:
    """Publishes a costmap as costmap_2d: updates if they have subscribers, whole for new ones and moved windows."""

    def __init__(self, name: str, frame: str) -> None:
        self._frame = frame
        self._grids = DisplayTopic(f'~{name}/costmap', OccupancyGridMessage)
        self._updates = DisplayTopic(f'~{name}/costmap_updates', OccupancyGridUpdate, WAITING_UPDATES)
        self._shown_costs, self._shown_origin = np.empty((0, 0), np.uint8), Pose2D(0.0, 0.0, 0.0)

    def show(self, costmap: Costmap, now_ns: int) -> None:
        """Publish due messages."""
        has_newcomers, frequency_hz = self._grids.has_newcomers(), costmap.params.publish_frequency
        period_ns = NANOSECONDS_PER_SECOND / frequency_hz if frequency_hz > 0.0 else math.inf
        if not (has_newcomers or self._grids.is_due(period_ns, now_ns)):
            return
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


def cloud_message(points: np.ndarray, names: Sequence[str], place: Header) -> PointCloud2:
    """Convert points (n, columns) to a cloud of one row, with a float32 field for each column."""
    fields = [PointField(name, 4 * index, PointField.FLOAT32, 1) for index, name in enumerate(names)]
    step, count = 4 * len(names), len(points)
    return PointCloud2(place, 1, count, fields, False, step, step * count, points.astype('<f4').tobytes(), True)
