"""The DWA: its window, trajectories, critics and directions, the command that it chooses, and its clouds."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.navigation import dwa
from diff_encoder_sim.navigation import dwa_kernels as kernels
from diff_encoder_sim.navigation.costmap_params import INSCRIBED, LETHAL
from diff_encoder_sim.navigation.dwa_kernels import TO_END, TO_FRONT, TO_PLAN, begin_waves, whole_grid
from diff_encoder_sim.navigation.navigator_inputs import STOP, Command, OdometrySample
from navigation_simulation import PERIOD_S, dwa_params, local_costmap, seen_costmap, straight_plan, winding_plan

ALL = 4 * (True,)  # directions
ONLY = {'occdist_scale': 0.0, 'path_distance_bias': 0.0, 'goal_distance_bias': 0.0}


def planner_of(**changes):
    return dwa.DwaPlanner(dwa_params(**changes), PERIOD_S)


def scored(planner, costmap, plan, twist=(0.3, 0.0), pose=IDENTITY):
    """Samples (n, 2) and costs (n,) of a cycle, each sample scored on its own."""
    task = planner.scoring_task(pose, *twist, costmap, plan)
    assert begin_waves(task, costmap.origin, plan)
    samples, _, _, totals = kernels.score_all(task)
    return samples, totals


def distances_from(points_m, costs, layer=TO_PLAN, nose_m=0.0):
    """Cells (rows, columns) of 1 m from a plan (n, 2) in the grid's own frame, None if it is not on that."""
    limits, plan = planner_of(forward_point_distance=nose_m)._limits, np.column_stack([points_m, 0.0 * points_m[:, 0]])
    places = costs, 1.0, np.zeros((3, 2)), *kernels.make_waves(*costs.shape), np.zeros(6)
    task = kernels.ScoringTask(limits, *places, IDENTITY, (0.0, 0.0), 1.0, ALL)
    return whole_grid(task, layer) if begin_waves(task, IDENTITY, plan) else None


def rolled_out(planner, pose, *twist):
    points = np.empty((kernels.sample_steps(planner._limits, twist, ALL), 5))
    kernels._roll_out(planner._limits, Pose2D(*map(float, pose)), twist, twist, points)
    return points


@pytest.mark.parametrize(
    ('changes', 'twist', 'goal_m', 'lowest', 'highest'),
    [
        ({}, (0.2, -0.3), 5.0, (0.165, -0.545), (0.235, -0.055)),  # what one period reaches
        ({'min_vel_x': -0.1}, (0.44, 0.9), 5.0, (0.405, 0.655), (0.45, 1.0)),
        ({'min_vel_x': -0.1}, (-0.09, -1.0), 5.0, (-0.1, -1.0), (-0.055, -0.755)),
        # 40 pulses: two pulses of each wheel in 50 ms are 0.63 m/s, of one wheel 1.57 rad/s.
        ({}, (0.628, 1.57), 5.0, (0.45, 1.0), (0.45, 1.0)),
        ({'use_dwa': False}, (0.1, 0.0), 0.34, (0.0, -1.0), (0.2, 1.0)),  # sim_time, without overshoot
    ],
)
def test_the_window_is_reachable_and_within_the_limits(changes, twist, goal_m, lowest, highest):
    samples = kernels.velocity_samples(planner_of(**changes)._limits, twist, goal_m)
    assert samples.min(axis=0) == pytest.approx(lowest) and samples.max(axis=0) == pytest.approx(highest)


def test_the_trajectory_is_upstreams():
    """Points no farther apart than the granularities, the start in and the end out."""
    points = rolled_out(planner_of(), IDENTITY, 0.4, 0.5)
    assert len(points) == 28  # 0.68 m / 0.025 m
    assert points[0].tolist() == [0.0, 0.0, 0.0, 1.0, 0.0]
    yaw = 0.5 * 1.7 * 27 / 28
    assert points[-1, :3] == pytest.approx((0.8 * math.sin(yaw), 0.8 * (1 - math.cos(yaw)), yaw), abs=0.02)
    assert points[:, 3:] == pytest.approx(np.column_stack([np.cos(points[:, 2]), np.sin(points[:, 2])]))
    points = np.empty((17, 5))  # without use_dwa it accelerates
    kernels._roll_out(planner_of(use_dwa=False, acc_lim_x=0.5)._limits, IDENTITY, (0.0, 0.0), (0.4, 0.0), points)
    assert points[3, 0] == pytest.approx((0.05 + 0.1 + 0.15) * 0.1)


def test_slow_and_fast_samples_and_locked_directions_have_no_trajectory():
    planner = planner_of(min_vel_trans=0.1, min_vel_theta=0.2)
    limits = planner._limits
    samples = [(0.4, 0.5), (0.0, 0.0), (0.0, -0.3), (0.05, 0.1), (0.46, 0.0), (0.3, 0.0)]
    assert [kernels.sample_steps(limits, sample, ALL) for sample in samples] == [28, 0, 6, 0, 0, 21]
    planner.oscillation.update(IDENTITY, 0.0, 0.3)
    planner.oscillation.update(IDENTITY, 0.0, -0.3)  # turned back: only right from here
    only_right = planner.scoring_task(IDENTITY, 0.0, 0.0, local_costmap(), straight_plan()).allowed
    assert [kernels.sample_steps(limits, sample, only_right) for sample in samples] == [0, 0, 6, 0, 0, 21]


def test_local_goal_is_the_last_point_before_the_plan_leaves():
    costs = np.zeros((5, 5), np.uint8)
    plan = np.array([[-3.0, 2.5], [0.5, 2.5], [9.0, 2.5], [4.5, 4.5]])
    assert np.argwhere(distances_from(plan, costs, layer=TO_END) == 0).tolist() == [[2, 4]]
    assert np.argwhere(distances_from(plan, costs) == 0).tolist() == [[2, column] for column in range(5)]
    assert distances_from(plan[:1], costs) is None


def test_the_nose_goal_is_beyond_the_end_as_seen_from_the_robot():
    costs, plan = np.zeros((9, 9), np.uint8), np.array([[2.5, 2.5], [4.5, 4.5]])
    beyond = distances_from(plan, costs, layer=TO_FRONT, nose_m=2.0 * math.sqrt(2.0))
    assert np.argwhere(beyond == 0).tolist() == [[6, 6]]
    assert np.argwhere(distances_from(plan[1:], costs, layer=TO_FRONT, nose_m=3.0) == 0).tolist() == [[6, 6]]


def test_the_wave_equals_repeated_relaxation():
    random = np.random.default_rng(0)
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
    """Without a nose, its critics count the same cells once more."""
    plan = straight_plan(1.0) + (0.0, 0.3, 0.0)
    for bias in ('path_distance_bias', 'goal_distance_bias'):
        planner = planner_of(**{**ONLY, bias: 20.0, 'forward_point_distance': 0.0})
        for sample, total in zip(*scored(planner, local_costmap(), plan)):
            cell = np.floor((rolled_out(planner, IDENTITY, *sample)[-1, :2] + 1.5) / 0.05)
            aside = np.abs(np.floor((np.array([1.0, 0.3]) + 1.5) / 0.05 + 1e-9) - cell)
            assert total == pytest.approx(2 * (aside[1] if bias == 'path_distance_bias' else aside.sum()))


def test_alignment_looks_at_the_nose():
    planner = planner_of(**{**ONLY, 'path_distance_bias': 20.0, 'vth_samples': 2, 'forward_point_distance': 0.325})
    samples, totals = scored(planner, local_costmap(), straight_plan(1.0), twist=(0.0, 0.0))
    is_ahead = samples[:, 0] > 0.0
    aligned, turning = (totals[is_ahead & (np.sign(samples[:, 1]) == side)][0] for side in (0, 1))
    # After 1.4 s of the turn the nose is 0.325 sin(0.39) = 0.12 m off the plan, the centre hardly.
    assert aligned == 0.0 and turning in (2.0, 3.0)


def test_weights_sum_up_and_biases_are_per_metre():
    plan, costmap = straight_plan() + (0.0, 0.2, 0.0), local_costmap([(0.8, 0.6)])
    weights = {'occdist_scale': 0.3, 'path_distance_bias': 32.0, 'goal_distance_bias': 24.0, 'twirling_scale': 2.0}
    task = planner_of(**weights).scoring_task(IDENTITY, 0.3, 0.0, costmap, plan)
    assert task.scales.tolist() == pytest.approx([0.3, 1.2, 1.6, 1.6, 1.2, 2.0])
    alone = [scored(planner_of(**{**ONLY, name: weight}), costmap, plan)[1] for name, weight in weights.items()]
    samples, together = scored(planner_of(**weights), costmap, plan)
    assert alone[3] == pytest.approx(2.0 * np.abs(samples[:, 1]))
    is_accepted = together >= 0.0
    assert is_accepted.any() and together[is_accepted] == pytest.approx(sum(alone)[is_accepted])


def test_scores_are_those_of_every_point_on_its_own():
    random, planner = np.random.default_rng(4), planner_of(**{**ONLY, 'occdist_scale': 1.0, 'path_distance_bias': 1e-6})
    rejected = 0
    for _ in range(12):
        costmap, plan, pose = seen_costmap(random), winding_plan(random), Pose2D(0.0, 0.0, random.uniform(-3.0, 3.0))
        samples, totals = scored(planner, costmap, plan, pose=pose)
        distance = whole_grid(planner.scoring_task(pose, 0.3, 0.0, costmap, plan), TO_PLAN)
        for sample, total in zip(samples, totals):
            poses = [Pose2D(*point) for point in rolled_out(planner, pose, *sample)[:, :3].tolist()]
            outlines = [costmap.footprint_cost(pose) for pose in poses]
            cells = [costmap.cell_at(*pose[:2]) for pose in poses]
            if min(outlines) < 0.0 or max(distance[cell] for cell in cells) >= distance.size:
                assert total < 0.0
                rejected += 1
            else:
                assert total == pytest.approx(max(outlines + [costmap.costs[cell] for cell in cells]), abs=0.01)
    assert 50 < rejected < 700


def test_turning_back_and_reversing_lock_until_the_robot_has_got_away():
    memory = dwa.OscillationMemory(dwa_params(min_vel_x=-0.2))
    memory.update(IDENTITY, 0.0, 0.3)
    assert all(memory.allowed())
    memory.update(IDENTITY, 0.0, -0.3)  # turned back: only right from here
    assert memory.allowed() == (True, True, False, True)
    memory.update(Pose2D(0.04, 0.0, -0.15), 0.0, -0.3)  # neither 0.05 m nor 0.2 rad
    assert not all(memory.allowed())
    memory.update(Pose2D(0.04, 0.0, -0.25), 0.0, -0.3)
    assert all(memory.allowed())
    memory.update(IDENTITY, 0.1, 0.0)
    memory.update(IDENTITY, -0.1, 0.0)
    assert memory.allowed() == (False, True, True, True)
    memory.update(Pose2D(-0.06, 0.0, 0.0), -0.1, 0.0)
    assert all(memory.allowed())
    for angular in (0.3, -0.3, 0.3, -0.3):  # turns count only on the spot
        memory.update(IDENTITY, 0.2, angular)
    assert all(memory.allowed()[2:])


def test_the_best_command_follows_a_straight_plan_at_the_highest_speed():
    best = planner_of().find_best(IDENTITY, 0.3, 0.0, local_costmap(), straight_plan())
    assert best.linear_mps == pytest.approx(0.335) and best.angular_radps == 0.0
    assert best.poses[-1, 0] == pytest.approx(0.335 * 1.7, abs=0.03)
    beyond = straight_plan() + (5.0, 0.0, 0.0)
    assert planner_of().find_best(IDENTITY, 0.0, 0.0, local_costmap(), beyond) is None


def test_a_costmap_of_another_shape_is_scored_as_by_a_new_planner():
    """As many cells, in other rows: its waves have more places around them."""
    turned, used, fresh = local_costmap(width=9.0, height=1.0), planner_of(), planner_of()
    used.find_best(IDENTITY, 0.3, 0.0, local_costmap(), straight_plan())
    best, expected = (each.find_best(IDENTITY, 0.3, 0.0, turned, straight_plan()) for each in (used, fresh))
    assert best[:3] == expected[:3]
    for layer in range(3):
        assert np.array_equal(*(whole_grid(each.last_task, layer) for each in (used, fresh)))


@pytest.mark.parametrize(
    'changes', [{}, {'twirling_scale': 3.0, 'sum_scores': True}, {'use_dwa': False}, {'path_distance_bias': 0.0}]
)
def test_best_first_finds_what_scoring_all_finds(changes):
    random, found = np.random.default_rng(3), 0
    for _ in range(60):
        costmap, plan, planner = seen_costmap(random), winding_plan(random), planner_of(**changes)
        pose = Pose2D(*random.uniform(-0.1, 0.1, 2), random.uniform(-3.0, 3.0))
        twist = tuple(random.uniform((0, -1), (0.45, 1)).tolist())
        samples, totals = scored(planner, costmap, plan, twist, pose)
        best, accepted = planner.find_best(pose, *twist, costmap, plan), np.flatnonzero(totals >= 0.0)
        assert (best is None) == (len(accepted) == 0)
        if best is not None:
            cheapest = accepted[np.argmin(totals[accepted])]  # the first of equals
            assert best.cost == totals[cheapest]
            assert changes.get('use_dwa') is False or best[:2] == tuple(samples[cheapest])
            found += 1
    assert 20 < found < 60


def test_a_constant_velocity_is_free_of_collisions_if_every_point_is():
    random, planner, answers = np.random.default_rng(5), planner_of(), []
    for _ in range(100):
        costmap, pose = seen_costmap(random), Pose2D(0.0, 0.0, random.uniform(-3.0, 3.0))
        twist = tuple(random.uniform((0, -1), (0.3, 1)).tolist())
        points = rolled_out(planner, pose, *twist)
        answers.append(planner.is_collision_free(pose, *twist, costmap))
        assert answers[-1] is all(costmap.footprint_cost(Pose2D(*point)) >= 0.0 for point in points[:, :3].tolist())
    assert 10 < sum(answers) < 90
    assert planner.is_collision_free(IDENTITY, 0.0, 0.0, costmap)  # it stays where it is


def test_clouds_show_what_the_command_was_chosen_from():
    """A wall to the left: accepted trajectories with their costs, and the cells that can be reached."""
    planner, costmap, plan = planner_of(), local_costmap([(0.75, 0.3)]), straight_plan()
    best = planner.find_best(IDENTITY, 0.3, 0.0, costmap, plan)
    cloud = dwa.trajectory_cloud(planner.last_task, costmap.origin)
    samples, totals = scored(planner_of(), costmap, plan)
    accepted = np.flatnonzero(totals >= 0.0)
    assert 0 < len(accepted) < len(samples), 'the wall rejects some'
    steps = [len(rolled_out(planner, IDENTITY, *sample)) for sample in samples[accepted]]
    assert cloud.shape == (sum(steps), len(dwa.TRAJECTORY_FIELDS))
    assert cloud[:, 4] == pytest.approx(np.repeat(totals[accepted], steps))
    cheapest = cloud[cloud[:, 4] == cloud[:, 4].min()]
    assert cheapest[0, 4] == best.cost and cheapest[: len(best.poses), [0, 1, 3]] == pytest.approx(best.poses)
    cells = dwa.cost_cloud(planner.last_task, costmap.origin)
    assert cells.shape[1] == len(dwa.COST_FIELDS) and 0 < len(cells) < costmap.costs.size
    assert cells[:, 5].tolist() == [costmap.cost_at(x, y) for x, y in cells[:, :2]] and cells[:, 5].max() < INSCRIBED
    assert cells[(np.abs(cells[:, 1]) < 0.05) & (cells[:, 0] > 0.0), 3].min() == 0.0, 'the plan is at its own distance'
    # Table 2 of the paper, in cells of 5 cm.
    assert cells[:, 6] == pytest.approx(1.0 * cells[:, 3] + 0.75 * cells[:, 4] + 0.01 * cells[:, 5])


@pytest.mark.parametrize('prune_m', [0.0, 1.0])
def test_the_visible_stretch_is_that_of_all_distances(prune_m):
    random = np.random.default_rng(6)
    for _ in range(200):
        plan = np.column_stack([np.cumsum(random.normal(0.0, 0.3, (40, 2)), axis=0), np.zeros(40)])
        place = random.normal(0.0, 2.0, 2)
        distance_m = np.hypot(*(plan[:, :2] - place).T)
        visible, expected = np.flatnonzero(distance_m <= 1.5), (0, 0)
        if len(visible):
            first = next((index for index in range(visible[0], 40) if distance_m[index] < prune_m), visible[0])
            leaves = next((index for index in range(first, 40) if distance_m[index] > 1.5), 39)
            expected = first, leaves + 1
        assert dwa.visible_stretch(plan, *place, 1.5, prune_m) == expected


def test_the_plan_in_odom_follows_robot_and_localization():
    params, costmap, seen = dwa_params(), local_costmap(), set()
    planner, plan = dwa.LocalPlanner(params, PERIOD_S), winding_plan(np.random.default_rng(12), 200)
    planner.set_plan(plan + 1.0)
    planner.is_goal_reached(OdometrySample(0, IDENTITY, 0.0, 0.0), IDENTITY)
    planner.set_plan(plan)
    for period in range(120):
        odom_in_map = Pose2D(0.01 * (period // 10), -0.02 * (period // 10), 0.03 * (period // 25))
        odometry = OdometrySample(period, Pose2D(*plan[period]).relative_to(odom_in_map), 0.3, 0.0)
        fresh = dwa.LocalPlanner(params, PERIOD_S)
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
    motion = dwa.limited_motion(OdometrySample(0, IDENTITY, *measured, 0.1, 0.4), Command(*commanded), 2.0)
    assert motion == (IDENTITY, pytest.approx(used[0]), pytest.approx(used[1]))
