"""Whether a robot fits through a test and can be done in its time: asked before the trial, not after 600 s of it."""

from __future__ import annotations

import math
from typing import Iterable, Iterator, NamedTuple, Optional

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.footprint import IN_OBSTACLE
from diff_encoder_sim.navigation.global_planner import GlobalPlanner, PlanError, PlanProblem
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.simulation.simulator import DriveParams
from diff_encoder_sim.trials.route_driver import Turn, stages_of

# Between two places at which the robot's outline is compared with the walls.
STEP_M, STEP_RAD = 0.1, math.radians(10.0)


class _RouteEffort(NamedTuple):
    """The least that a route asks of any robot that follows it."""

    length_m: float
    turned_rad: float  # in place, on purpose


def misfit(test: TestDefinition, navigator: NavigatorParams, drive: DriveParams, grid: OccupancyGrid) -> Optional[str]:
    """Return why a robot cannot navigate a test's route, in one line; None where nothing speaks against it.

    Args:
        test: to be driven in the map.
        navigator: with the robot's outline and speeds.
        drive: its motors.
        grid: the map.
    """
    costmap = Costmap(navigator.global_costmap, grid)
    try:
        effort = _plan_route(test, navigator, costmap)
    except PlanError as error:
        return f'test {test.name}: not for this robot: {error}'
    return _too_slow(test, effort, navigator, drive)


def _plan_route(test: TestDefinition, navigator: NavigatorParams, costmap: Costmap) -> _RouteEffort:
    """Plan each leg as the navigator will.

    Raises:
        PlanError: there is no way for the robot's outline.
    """
    planner = GlobalPlanner(navigator.NavfnROS, costmap)
    pose, length_m, turned_rad = test.start.pose(), 0.0, 0.0
    for stage in stages_of(test):
        if isinstance(stage, Turn):
            _check_poses(costmap, _turned_poses(pose, stage.angle_rad))
            turned_rad += abs(stage.angle_rad)
            continue
        plan = planner.make_plan(pose, stage.pose_in_map)
        _check_poses(
            costmap, [Pose2D(*point) for point in plan[:: max(1, round(STEP_M * costmap.cells_per_m))].tolist()]
        )
        length_m += float(np.hypot(*np.diff(plan[:, :2], axis=0).T).sum())
        pose = stage.pose_in_map
    return _RouteEffort(length_m, turned_rad)


def _check_poses(costmap: Costmap, poses: Iterable[Pose2D]) -> None:
    """Check that the robot's outline is free of walls at each pose.

    Raises:
        PlanError: it is not.
    """
    for pose in poses:
        if costmap.footprint_cost(pose) == IN_OBSTACLE:
            raise PlanError(PlanProblem.BLOCKED, f'at ({pose.x_m:.2f}, {pose.y_m:.2f}) {_size(costmap)} touches a wall')


def _size(costmap: Costmap) -> str:
    length_m, width_m = np.ptp(costmap.footprint.vertices_m, axis=0).tolist()
    return f'its outline of {length_m:.2f} x {width_m:.2f} m'


def _turned_poses(pose: Pose2D, angle_rad: float) -> Iterator[Pose2D]:
    # From one full turn on, all headings have been seen.
    angle_rad = math.copysign(min(abs(angle_rad), 2.0 * math.pi), angle_rad)
    for angle in np.linspace(0.0, angle_rad, 1 + math.ceil(abs(angle_rad) / STEP_RAD)).tolist():
        yield pose._replace(yaw_rad=pose.yaw_rad + angle)


def _too_slow(
    test: TestDefinition, effort: _RouteEffort, navigator: NavigatorParams, drive: DriveParams
) -> Optional[str]:
    planner = navigator.DWAPlannerROS
    speed_mps = min(planner.max_vel_x, planner.max_vel_trans, drive.max_linear_speed)
    turning_radps = min(test.limits.angular_speed, drive.max_angular_speed)
    least_s = effort.length_m / speed_mps + effort.turned_rad / turning_radps
    if least_s <= test.time_limit:
        return None
    return (
        f'test {test.name}: not for this robot: its {effort.length_m:.0f} m take it at least {least_s:.0f} s at '
        f'{speed_mps:g} m/s; time_limit is {test.time_limit:g} s'
    )
