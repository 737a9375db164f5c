"""The part of the plan that is followed, and the motion that control begins with."""

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_params import local_defaults
from diff_encoder_sim.navigation.dwa import LocalPlanner, limited_motion, visible_stretch
from diff_encoder_sim.navigation.navigator_inputs import STOP, Command, OdometrySample
from navigation_scenes import PERIOD_S, dwa_params, straight_plan, winding_plan


@pytest.mark.parametrize('prune_m', [0.0, 1.0])
def test_the_visible_stretch_is_that_of_all_distances(prune_m):
    random = np.random.default_rng(6)
    for _ in range(200):
        plan = np.column_stack([np.cumsum(random.normal(0.0, 0.3, (40, 2)), axis=0), np.zeros(40)])
        x_m, y_m = random.normal(0.0, 2.0, 2)
        distance_m = np.hypot(plan[:, 0] - x_m, plan[:, 1] - y_m)
        visible = np.flatnonzero(distance_m <= 1.5)
        expected = 0, 0
        if len(visible):
            near = [index for index in range(visible[0], 40) if distance_m[index] < prune_m]
            first = near[0] if near else visible[0]
            leaves = [index for index in range(first, 40) if distance_m[index] > 1.5]
            expected = first, min(leaves[0] + 1 if leaves else 40, 40)
        assert visible_stretch(plan, x_m, y_m, 1.5, prune_m) == expected


def test_the_plan_in_odom_follows_robot_and_localization():
    """Kept between control periods, it is what a planner makes that has just got the plan."""
    params, costmap = dwa_params(), Costmap(local_defaults())
    planner, plan = LocalPlanner(params, PERIOD_S), winding_plan(np.random.default_rng(12), 200)
    planner.set_plan(plan + 1.0)
    planner.is_goal_reached(OdometrySample(0, IDENTITY, 0.0, 0.0), IDENTITY)
    planner.set_plan(plan)
    seen = set()
    for period in range(120):
        odom_in_map = Pose2D(0.01 * (period // 10), -0.02 * (period // 10), 0.03 * (period // 25))
        odometry = OdometrySample(period, Pose2D(*plan[period]).relative_to(odom_in_map), 0.3, 0.0)
        fresh = LocalPlanner(params, PERIOD_S)
        fresh.set_plan(plan)
        costmap.update(odometry.base_pose_in_odom)
        for each in (planner, fresh):
            each.compute(odometry, STOP, odom_in_map, costmap)
        assert planner.plan_in_odom.tolist() == fresh.plan_in_odom.tolist()
        assert planner.is_goal_reached(odometry, odom_in_map) == fresh.is_goal_reached(odometry, odom_in_map)
        seen.add(len(planner.plan_in_odom))
    assert len(seen) > 5


@pytest.mark.parametrize(
    ('commanded', 'measured', 'used'),
    [
        ((0.40, 0.0), (0.31, 0.3), (0.40, 0.0)),  # within 2 sigma: the command
        ((0.40, 0.0), (0.16, 0.9), (0.36, 0.1)),  # farther off: the nearest within 2 sigma
        ((0.00, -0.5), (0.30, 0.5), (0.10, -0.3)),
    ],
)
def test_control_begins_with_the_last_command_as_far_as_odometry_allows(commanded, measured, used):
    motion = limited_motion(OdometrySample(0, IDENTITY, *measured, 0.1, 0.4), Command(*commanded), 2.0)
    assert motion == (IDENTITY, pytest.approx(used[0]), pytest.approx(used[1]))


def test_a_plan_outside_the_costmap_is_a_problem():
    planner = LocalPlanner(dwa_params(), PERIOD_S)
    planner.set_plan(straight_plan() + np.array([50.0, 0.0, 0.0]))
    assert planner.compute(OdometrySample(0, IDENTITY, 0.0, 0.0), STOP, IDENTITY, Costmap(local_defaults())) is None
    assert planner.problem == 'the plan is outside the local costmap'
