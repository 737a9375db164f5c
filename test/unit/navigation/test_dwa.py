"""The DWA: its window, trajectories, critics and directions, the command that it chooses, and its clouds."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.navigation import dwa_kernels as critics
from diff_encoder_sim.navigation.costmap_layers import INSCRIBED, LETHAL
from diff_encoder_sim.navigation.dwa import (
    COST_FIELDS,
    TRAJECTORY_FIELDS,
    DwaPlanner,
    OscillationMemory,
    cost_cloud,
    trajectory_cloud,
)
from diff_encoder_sim.navigation.dwa_kernels import (
    TO_END,
    TO_FRONT,
    TO_PLAN,
    begin_waves,
    distance_to,
    dynamic_window,
    last_point,
    make_waves,
    roll_out,
    rollout_params,
    sample_step_count,
    samples_between,
    step_count,
    velocity_samples,
    whole_grid,
    window_params,
)
from diff_encoder_sim.navigation.dwa_params import DwaParams
from dwa_scoring import score_all, scored
from navigation_scenes import PERIOD_S, dwa_params, local_costmap, seen_costmap, straight_plan, winding_plan
from navigation_simulation import TABLE_2


def distances_from(points_m, costs, per_m=1.0, layer=TO_PLAN, nose_m=0.0):
    """Return the cells (rows, columns) from a plan (n, 2) in the grid's own frame, None if it is not on that."""
    plan, waves = np.column_stack([points_m, np.zeros(len(points_m))]), make_waves(costs.shape)
    has_begun = begin_waves(costs, per_m, IDENTITY, plan, IDENTITY, nose_m, waves)
    return whole_grid(waves, layer, *costs.shape) if has_begun else None


def rolled_out(params, pose, linear_mps, angular_radps):
    """Return the points (n, 5) of a DWA's trajectory."""
    rollout, twist = rollout_params(params), (linear_mps, angular_radps)
    steps = step_count(rollout, *twist)
    points = np.empty((steps, 5))
    roll_out(rollout, Pose2D(*map(float, pose)), twist, twist, steps, points)
    return points


def limits(**changes):
    return window_params(dwa_params(**changes), PERIOD_S)


def test_window_is_what_one_period_reaches():
    window = dynamic_window(limits(), 0.2, -0.3, 5.0)
    assert window == pytest.approx((0.165, 0.235, -0.545, -0.055))


def test_window_stays_within_the_limits():
    params = limits(min_vel_x=-0.1)
    assert dynamic_window(params, 0.44, 0.9, 5.0) == pytest.approx((0.405, 0.45, 0.655, 1.0))
    assert dynamic_window(params, -0.09, -1.0, 5.0)[:2] == pytest.approx((-0.1, -0.055))


def test_a_quantised_twist_above_the_limits_leaves_the_limits():
    """40 pulses: two pulses of each wheel in 50 ms are 0.63 m/s, of one wheel 1.57 rad/s."""
    assert dynamic_window(limits(), 0.628, 1.57, 5.0) == (0.45, 0.45, 1.0, 1.0)
    assert velocity_samples(limits(), 0.628, 1.57, 5.0).tolist() == [[0.45, 1.0]]


def test_without_dwa_the_window_spans_sim_time_and_does_not_overshoot():
    window = dynamic_window(limits(use_dwa=False), 0.1, 0.0, 0.34)
    assert window == pytest.approx((0.0, 0.2, -1.0, 1.0))


def test_samples_hold_both_ends_and_zero():
    assert samples_between(-0.245, 0.245, 4) == pytest.approx([-0.245, -0.0816667, 0.0, 0.0816667, 0.245])
    assert samples_between(0.1, 0.3, 3) == pytest.approx([0.1, 0.2, 0.3])
    assert samples_between(0.1, 0.3, 1).tolist() == [0.1, 0.3]
    assert samples_between(0.2, 0.2, 20).tolist() == [0.2]
    assert samples_between(-0.2, 0.2, 3).tolist() == [-0.2, 0.0, 0.2]  # it is there already


def test_the_trajectory_is_upstreams():
    """Points no farther apart than the granularities, the start in and the end out."""
    points = rolled_out(dwa_params(), IDENTITY, 0.4, 0.5)
    assert len(points) == 28  # 0.68 m / 0.025 m
    assert points[0].tolist() == [0.0, 0.0, 0.0, 1.0, 0.0]
    assert points[-1, 2] == pytest.approx(0.5 * 1.7 * 27 / 28)
    radius_m = 0.4 / 0.5
    assert points[-1, :2] == pytest.approx(
        (radius_m * math.sin(points[-1, 2]), radius_m * (1 - math.cos(points[-1, 2]))), abs=0.02
    )
    assert points[:, 3:] == pytest.approx(np.column_stack([np.cos(points[:, 2]), np.sin(points[:, 2])]))


def test_without_dwa_the_trajectory_accelerates():
    params = rollout_params(dwa_params(use_dwa=False, acc_lim_x=0.5))
    points = np.empty((17, 5))
    roll_out(params, IDENTITY, (0.0, 0.0), (0.4, 0.0), 17, points)
    assert points[3, 0] == pytest.approx((0.05 + 0.1 + 0.15) * 0.1)


def test_slow_and_fast_samples_have_no_trajectory():
    params = rollout_params(dwa_params(min_vel_trans=0.1, min_vel_theta=0.2))
    samples = [(0.4, 0.5), (0.0, 0.0), (0.0, -0.3), (0.05, 0.1), (0.46, 0.0), (0.3, 0.0)]
    # Neither fast enough nor turning, then neither, then too fast.
    assert [sample_step_count(params, *sample) for sample in samples] == [28, 0, 6, 0, 0, 21]


@pytest.mark.parametrize('sample', [(0.4, 0.5), (0.0, -0.9), (-0.2, 1e-9)])
def test_the_last_point_in_closed_form_is_that_of_the_rollout(sample):
    pose, params = Pose2D(1.0, -2.0, 0.7), dwa_params()
    points = rolled_out(params, pose, *sample)
    assert last_point(rollout_params(params), pose, *sample, len(points)) == pytest.approx(points[-1, :3], abs=1e-13)


def test_distances_go_around_obstacles():
    costs = np.zeros((7, 7), np.uint8)
    costs[0:6, 3] = 253
    costs[6, 6] = 255
    plan = np.array([[0.5, 0.5], [1.5, 0.5]])
    distance = distances_from(plan, costs)
    assert distance[0, :3].tolist() == [0, 0, 1]
    assert distance[0, 4] == 6 + 3 + 6  # down to row 6, past the wall, up again
    assert distance[2, 3] == 49 and distance[6, 6] == 49  # blocked, unknown
    costs[6, 3] = 254
    assert distances_from(plan, costs)[0, 4] == 50  # no way


def test_local_goal_is_the_last_point_before_the_plan_leaves():
    costs = np.zeros((5, 5), np.uint8)
    plan = np.array([[-3.0, 2.5], [0.5, 2.5], [9.0, 2.5], [4.5, 4.5]])
    assert np.argwhere(distances_from(plan, costs, layer=TO_END) == 0).tolist() == [[2, 4]]
    assert np.argwhere(distances_from(plan, costs) == 0).tolist() == [[2, column] for column in range(5)]
    assert distances_from(plan[:1], costs) is None


def test_the_nose_goal_is_beyond_the_end_as_seen_from_the_robot():
    costs, plan = np.zeros((9, 9), np.uint8), np.array([[2.5, 2.5], [4.5, 4.5]])
    beyond = distances_from(plan, costs, layer=TO_FRONT, nose_m=2.0 * np.sqrt(2.0))
    assert np.argwhere(beyond == 0).tolist() == [[6, 6]]
    assert np.argwhere(distances_from(plan[1:], costs, layer=TO_FRONT, nose_m=3.0) == 0).tolist() == [[6, 6]]


def test_a_wave_that_is_asked_cell_by_cell_is_the_whole_wave():
    random = np.random.default_rng(1)
    costs = random.choice([0, INSCRIBED, 255], (12, 15), p=[0.7, 0.25, 0.05]).astype(np.uint8)
    plan = np.column_stack([np.linspace(1.5, 12.5, 20), np.linspace(2.5, 9.5, 20), np.zeros(20)])
    for layer in (TO_PLAN, TO_END, TO_FRONT):
        waves = make_waves(costs.shape)
        assert begin_waves(costs, 1.0, IDENTITY, plan, IDENTITY, 1.0, waves)
        cells = random.permutation(costs.size)
        asked = [distance_to(*waves, layer, costs.size, 15, cell // 15, cell % 15) for cell in cells.tolist()]
        assert asked == whole_grid(waves, layer, *costs.shape).ravel()[cells].tolist()


@pytest.mark.parametrize('seed', range(2))
def test_the_wave_equals_repeated_relaxation(seed):
    random = np.random.default_rng(seed)
    costs = random.choice([0, 100, INSCRIBED, LETHAL, 255], (25, 31), p=[0.6, 0.1, 0.1, 0.15, 0.05]).astype(np.uint8)
    plan = np.column_stack([np.linspace(-2.0, 20.0, 40), np.linspace(3.0, 18.0, 40)])
    distance = distances_from(plan, costs)
    expected = np.full((27, 33), costs.size + 1)
    expected[1:-1, 1:-1][distance == 0] = 0
    is_free = np.pad(costs < INSCRIBED, 1)
    for _ in range(costs.size):
        nearest = 1 + np.min([np.roll(expected, shift, axis) for shift in (-1, 1) for axis in (0, 1)], axis=0)
        expected = np.where(is_free, np.minimum(expected, nearest), expected)
    reached = expected < costs.size
    beside = np.any([np.roll(reached, shift, axis) for shift in (-1, 1) for axis in (0, 1)], axis=0)
    expected[~is_free & beside & ~reached] = costs.size
    assert (distance == expected[1:-1, 1:-1]).all()


def test_path_and_goal_critics_count_cells_from_the_last_point():
    planner = DwaPlanner(dwa_params(), PERIOD_S)
    result = scored(planner, local_costmap(), straight_plan(1.0) + (0.0, 0.3, 0.0))
    for (v, w), scores in zip(result.samples, result.scores):
        points = rolled_out(planner.params, IDENTITY, v, w)
        cell = np.floor((points[-1, :2] + 1.5) / 0.05)
        goal = np.floor((np.array([1.0, 0.3]) + 1.5) / 0.05 + 1e-9)
        assert scores[critics.GOAL] == np.abs(goal - cell).sum()
        assert scores[critics.PATH] == abs(goal[1] - cell[1])


def test_alignment_and_goal_front_look_at_the_nose():
    planner = DwaPlanner(dwa_params(vth_samples=2), PERIOD_S)
    result = scored(planner, local_costmap(), straight_plan(1.0), twist=(0.0, 0.0))
    straight = next(i for i, (v, w) in enumerate(result.samples) if v > 0.0 and w == 0.0)
    turning = next(i for i, (v, w) in enumerate(result.samples) if v > 0.0 and w > 0.0)
    assert result.scores[straight, critics.ALIGNMENT] == 0.0
    # After 1.4 s of the turn the nose is 0.325 sin(0.39) = 0.12 m off the plan.
    assert result.scores[turning, critics.ALIGNMENT] in (2.0, 3.0)
    # The nose's goal is 0.325 m behind the goal, the nose as far before the centre.
    assert result.scores[straight, critics.GOAL_FRONT] == pytest.approx(result.scores[straight, critics.GOAL], abs=1)


def test_twirling_critic_punishes_turning():
    planner = DwaPlanner(dwa_params(twirling_scale=5.0), PERIOD_S)
    result = scored(planner, local_costmap(), straight_plan())
    assert result.scores[:, critics.TWIRLING] == pytest.approx(np.abs(result.samples[:, 1]))


def test_path_critic_rejects_ways_through_inscribed_cells():
    """The outline alone would pass: with a robot of a few centimetres it sees no lethal cell."""
    tiny = [[0.01, 0.01], [-0.01, 0.01], [-0.01, -0.01], [0.01, -0.01]]
    costmap = local_costmap(footprint=tiny, footprint_padding=0.0)
    costmap.costs[20:40, 36] = 253
    result = scored(DwaPlanner(dwa_params(), PERIOD_S), costmap, straight_plan())
    assert set(result.totals) == {critics.BLOCKED}


def test_a_bound_direction_is_rejected():
    planner = DwaPlanner(dwa_params(), PERIOD_S)
    planner.oscillation.update(IDENTITY, 0.0, 0.3)
    planner.oscillation.update(IDENTITY, 0.0, -0.3)
    result = scored(planner, local_costmap(), straight_plan(), twist=(0.0, 0.0))
    left = result.samples[:, 1] > 0.0
    assert (result.totals[left] == critics.OSCILLATES).all() and result.best >= 0


def test_scores_are_those_of_every_point_on_its_own():
    random = np.random.default_rng(4)
    planner = DwaPlanner(DwaParams.from_mapping(TABLE_2, ''), PERIOD_S)
    rejected = 0
    for _ in range(12):
        costmap, plan, yaw_rad = seen_costmap(random), winding_plan(random), random.uniform(-3.0, 3.0)
        scored = score_all(planner, Pose2D(0.0, 0.0, yaw_rad), 0.3, 0.0, costmap, plan)
        distance = distances_from(plan[:, :2] - costmap.origin[:2], costmap.costs, costmap.cells_per_m)
        for (v, w), scores, total in zip(scored.samples, scored.scores, scored.totals):
            points = rolled_out(planner.params, (0.0, 0.0, yaw_rad), v, w)
            poses = [Pose2D(*point) for point in points[:, :3].tolist()]
            outlines = [costmap.footprint_cost(pose) for pose in poses]
            cells = [costmap.cell_at(*pose[:2]) for pose in poses]
            if min(outlines) < 0.0 or max(distance[cell] for cell in cells) >= distance.size:
                assert total < 0.0
                rejected += 1
            else:
                assert scores[critics.OBSTACLE] == max(outlines + [costmap.costs[cell] for cell in cells])
                assert scores[critics.PATH] == distance[cells[-1]]
    assert 50 < rejected < 700


def test_turning_back_binds_until_the_robot_has_got_away():
    memory = OscillationMemory(dwa_params())
    memory.update(IDENTITY, 0.0, 0.3)
    assert all(memory.allowed())
    memory.update(IDENTITY, 0.0, -0.3)  # turned back: only right from here
    assert memory.allowed() == (True, True, False, True)
    memory.update(Pose2D(0.04, 0.0, -0.15), 0.0, -0.3)  # neither 0.05 m nor 0.2 rad
    assert not all(memory.allowed())
    memory.update(Pose2D(0.04, 0.0, -0.25), 0.0, -0.3)
    assert all(memory.allowed())


def test_forward_and_backward_bind_too():
    memory = OscillationMemory(dwa_params(min_vel_x=-0.2))
    memory.update(IDENTITY, 0.1, 0.0)
    memory.update(IDENTITY, -0.1, 0.0)
    assert memory.allowed() == (False, True, True, True)
    memory.update(Pose2D(-0.06, 0.0, 0.0), -0.1, 0.0)
    assert all(memory.allowed())


def test_turning_counts_only_on_the_spot():
    memory = OscillationMemory(dwa_params())
    for angular in (0.3, -0.3, 0.3, -0.3):
        memory.update(IDENTITY, 0.2, angular)
    assert all(memory.allowed())


def test_the_best_command_follows_a_straight_plan_at_the_highest_speed():
    best = DwaPlanner(dwa_params(), PERIOD_S).find_best(IDENTITY, 0.3, 0.0, local_costmap(), straight_plan())
    assert best.linear_mps == pytest.approx(0.335) and best.angular_radps == 0.0
    assert best.poses[-1, 0] == pytest.approx(0.335 * 1.7, abs=0.03)


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
    'changes', [{}, {'twirling_scale': 3.0}, {'use_dwa': False}, {'goal_distance_bias': 0.0, 'path_distance_bias': 0.0}]
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
