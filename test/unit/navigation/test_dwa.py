"""The DWA: the command that it chooses."""

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.navigation import dwa_kernels as critics
from diff_encoder_sim.navigation.dwa import DwaPlanner
from diff_encoder_sim.navigation.dwa_kernels import whole_grid
from diff_encoder_sim.navigation.dwa_params import DwaParams
from dwa_scoring import score_all, scored
from navigation_scenes import PERIOD_S, dwa_params, local_costmap, seen_costmap, straight_plan, winding_plan
from navigation_simulation import TABLE_2
from rolled_out import rolled_out


def test_the_best_command_follows_a_straight_plan_at_the_highest_speed():
    best = DwaPlanner(dwa_params(), PERIOD_S).find_best(IDENTITY, 0.3, 0.0, local_costmap(), straight_plan())
    assert best.linear_mps == pytest.approx(0.335) and best.angular_radps == 0.0
    assert best.poses[-1, 0] == pytest.approx(0.335 * 1.7, abs=0.03)


def test_alignment_is_off_within_a_nose_of_the_goal():
    planner = DwaPlanner(dwa_params(), PERIOD_S)
    assert planner._scales(local_costmap(), 0.33)[critics.ALIGNMENT] > 0.0
    assert planner._scales(local_costmap(), 0.32)[critics.ALIGNMENT] == 0.0


def test_scales_are_per_metre_and_sum_up():
    planner = DwaPlanner(dwa_params(path_distance_bias=32.0, goal_distance_bias=24.0), PERIOD_S)
    scales = planner._scales(local_costmap(), 1.0)
    assert scales.tolist() == pytest.approx([1.0, 0.01, 1.2, 1.6, 1.6, 1.2, 0.0])
    result = scored(planner, local_costmap(), straight_plan())
    assert result.totals == pytest.approx(result.scores @ scales)
    assert result.best == int(np.argmin(result.totals))


def test_a_costmap_of_another_shape_is_scored_as_by_a_planner_that_knows_no_other():
    """As many cells, in other rows: its waves have more places around them."""
    turned, used, fresh = local_costmap(width=9.0, height=1.0), *(DwaPlanner(dwa_params(), PERIOD_S) for _ in 'ab')
    used.find_best(IDENTITY, 0.3, 0.0, local_costmap(), straight_plan())
    assert turned.costs.size == local_costmap().costs.size
    best, expected = (each.find_best(IDENTITY, 0.3, 0.0, turned, straight_plan()) for each in (used, fresh))
    assert best[:3] == expected[:3]
    for layer in range(3):
        grids = [whole_grid(each.last_task.scene.waves, layer, *turned.shape) for each in (used, fresh)]
        assert np.array_equal(*grids)


def test_no_plan_in_the_window_gives_no_command():
    assert (
        DwaPlanner(dwa_params(), PERIOD_S).find_best(
            IDENTITY, 0.0, 0.0, local_costmap(), straight_plan() + (5.0, 0.0, 0.0)
        )
        is None
    )


@pytest.mark.parametrize(
    'changes',
    [
        {},
        {'sum_scores': True},
        {'twirling_scale': 3.0},
        {'use_dwa': False},
        {'occdist_scale': 0.5},
        {'goal_distance_bias': 0.0, 'path_distance_bias': 0.0},
    ],
)
def test_best_first_finds_what_scoring_all_finds(changes):
    random, params = np.random.default_rng(3), DwaParams.from_mapping({**TABLE_2, **changes}, '')
    found = 0
    for _ in range(60):
        costmap, plan = seen_costmap(random), winding_plan(random)
        robot = Pose2D(*random.uniform(-0.1, 0.1, 2), random.uniform(-3.0, 3.0)), *random.uniform((0, -1), (0.45, 1))
        planner = DwaPlanner(params, PERIOD_S)
        scored, best = score_all(planner, *robot, costmap, plan), planner.find_best(*robot, costmap, plan)
        accepted = np.flatnonzero(scored.totals >= 0.0)
        assert (best is None) == (len(accepted) == 0)
        if best is not None:
            cheapest = accepted[np.argmin(scored.totals[accepted])]  # the first of equals
            assert scored.best == cheapest and best.cost == scored.totals[cheapest]
            assert params.use_dwa is False or (best.linear_mps, best.angular_radps) == tuple(scored.samples[cheapest])
            found += 1
    assert 20 < found < 60


def test_a_constant_velocity_is_free_of_collisions_if_every_point_is():
    random = np.random.default_rng(5)
    planner, answers = DwaPlanner(DwaParams.from_mapping(TABLE_2, ''), PERIOD_S), []
    for _ in range(100):
        costmap = seen_costmap(random)
        start, twist = np.array([0.0, 0.0, random.uniform(-3.0, 3.0)]), random.uniform((0, -1), (0.3, 1))
        points = rolled_out(planner.params, start, *twist)
        answers.append(planner.is_collision_free(Pose2D(*start), *twist, costmap))
        assert answers[-1] is all(costmap.footprint_cost(Pose2D(*point)) >= 0.0 for point in points[:, :3].tolist())
    assert 10 < sum(answers) < 90
    assert planner.is_collision_free(IDENTITY, 0.0, 0.0, costmap)  # it stays where it is
