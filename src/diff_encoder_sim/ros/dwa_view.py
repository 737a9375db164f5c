"""Topics of the DWA for displays: the trajectories that it has chosen from, and the costs of the cells around."""

from __future__ import annotations

from typing import Optional, Sequence

import numpy as np
from sensor_msgs.msg import PointCloud2, PointField

from diff_encoder_sim.navigation.dwa_clouds import COST_FIELDS, TRAJECTORY_FIELDS, cost_cloud, trajectory_cloud
from diff_encoder_sim.navigation.dwa_search import ScoringTask
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.ros.conversions import stamp_from_ns
from diff_encoder_sim.ros.display_topic import DisplayTopic

PERIOD_NS = 200_000_000
_FLOAT_BYTES = 4


class DwaView:
    """Publishes the clouds that publish_traj_pc and publish_cost_grid_pc switch on, after periods with a choice."""

    def __init__(self, frame: str) -> None:
        self._frame = frame
        self._trajectories = DisplayTopic('~DWAPlannerROS/trajectory_cloud', PointCloud2)
        self._costs = DisplayTopic('~DWAPlannerROS/cost_cloud', PointCloud2)
        self._shown: Optional[ScoringTask] = None

    def show(self, navigator: Navigator, now_ns: int) -> None:
        """Publish what is due."""
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
    fields = [PointField(name, _FLOAT_BYTES * index, PointField.FLOAT32, 1) for index, name in enumerate(names)]
    step, count = _FLOAT_BYTES * len(names), len(points)
    message = PointCloud2(
        height=1, width=count, fields=fields, is_bigendian=False, point_step=step, row_step=step * count, is_dense=True
    )
    message.data = points.astype('<f4').tobytes()
    message.header.stamp, message.header.frame_id = stamp_from_ns(stamp_ns), frame
    return message
