"""What displays see of a DWA cycle."""

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.navigation.costmap_layers import INSCRIBED
from diff_encoder_sim.navigation.dwa import COST_FIELDS, TRAJECTORY_FIELDS, DwaPlanner, cost_cloud, trajectory_cloud
from dwa_scoring import score_all
from navigation_scenes import PERIOD_S, dwa_params, local_costmap, straight_plan
from rolled_out import rolled_out


@pytest.fixture
def cycle():
    """Planner, costmap with a wall to the left, and the trajectory that was chosen."""
    planner, costmap = DwaPlanner(dwa_params(), PERIOD_S), local_costmap([(0.75, 0.3)])
    assert planner.last_task is None
    best = planner.find_best(IDENTITY, 0.3, 0.0, costmap, straight_plan())
    return planner, costmap, best


def test_every_accepted_trajectory_is_in_the_cloud_with_its_full_cost(cycle):
    planner, costmap, best = cycle
    cloud = trajectory_cloud(planner.last_task, costmap.origin)
    expected = score_all(DwaPlanner(dwa_params(), PERIOD_S), IDENTITY, 0.3, 0.0, costmap, straight_plan())
    accepted = np.flatnonzero(expected.totals >= 0.0)
    assert 0 < len(accepted) < len(expected.samples), 'the wall rejects some'
    steps = [len(rolled_out(planner.params, IDENTITY, *sample)) for sample in expected.samples[accepted]]
    assert cloud.shape == (sum(steps), len(TRAJECTORY_FIELDS))
    assert cloud[:, 4] == pytest.approx(np.repeat(expected.totals[accepted], steps))
    assert cloud[:, 4].min() == pytest.approx(best.cost)
    cheapest = cloud[cloud[:, 4] == cloud[:, 4].min()]
    assert cheapest[: len(best.poses), [0, 1, 3]] == pytest.approx(best.poses)


def test_the_clouds_leave_the_cycle_as_it_was(cycle):
    planner, costmap, _ = cycle
    task = planner.last_task
    first, second = ([cloud(task, costmap.origin) for cloud in (trajectory_cloud, cost_cloud)] for _ in range(2))
    assert all((a == b).all() for a, b in zip(first, second))


def test_the_cost_cloud_has_the_cells_that_can_be_reached(cycle):
    planner, costmap, _ = cycle
    cloud = cost_cloud(planner.last_task, costmap.origin)
    assert cloud.shape[1] == len(COST_FIELDS) and 0 < len(cloud) < costmap.costs.size
    costs = [costmap.cost_at(x, y) for x, y in cloud[:, :2]]
    assert cloud[:, 5].tolist() == costs and max(costs) < INSCRIBED
    on_plan = cloud[(np.abs(cloud[:, 1]) < 0.05) & (cloud[:, 0] > 0.0)]
    assert on_plan[:, 3].min() == 0.0, 'the plan is at distance zero from itself'
    scales = planner._scales(costmap, 2.0)
    assert cloud[:, 6] == pytest.approx(scales[4] * cloud[:, 3] + scales[5] * cloud[:, 4] + scales[1] * cloud[:, 5])


def test_a_window_that_is_turned_turns_the_clouds(cycle):
    planner, costmap, _ = cycle
    origin, task = costmap.origin, planner.last_task
    turned = Pose2D(origin.x_m, origin.y_m, np.pi / 2.0)
    straight, around = trajectory_cloud(task, origin), trajectory_cloud(task, turned)
    assert around[:, 3] == pytest.approx(straight[:, 3] + np.pi / 2.0)
    assert around[:, 0] - origin.x_m == pytest.approx(-(straight[:, 1] - origin.y_m))


def test_where_all_are_rejected_the_cloud_is_empty(cycle):
    planner, costmap, _ = cycle
    task = planner.last_task._replace(allowed=(False, False, False, False))
    assert trajectory_cloud(task, costmap.origin).shape == (0, len(TRAJECTORY_FIELDS))
