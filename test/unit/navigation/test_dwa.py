"""The DWA: its window and samples, each critic by a case made by hand, and its memory."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.navigation import critics
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_params import local_defaults
from diff_encoder_sim.navigation.dwa import DwaPlanner
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.dynamic_window import dynamic_window, samples_between, velocity_samples
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.navigation.oscillation import OscillationMemory
from diff_encoder_sim.navigation.plan_distances import plan_distance
from diff_encoder_sim.navigation.stop_rotate import Motion
from diff_encoder_sim.navigation.trajectory_rollout import roll_out, step_count
from diff_encoder_sim.navigation.turn_to_path import TurnToPath
from navigation_simulation import TABLE_2

PERIOD_S = 0.05


def dwa_params(**changes):
    return DwaParams.from_mapping({**TABLE_2, **changes}, '')


def local_costmap(marked=(), **params):
    """A window around (0, 0), with lethal cells at points (x, y) [m]."""
    costmap = Costmap(local_defaults(**params))
    for x, y in marked:
        costmap._obstacles[costmap.cell_at(x, y)] = 254
    costmap._refresh(costmap._everything())
    return costmap


def straight_plan(length_m=1.4, bearing_rad=0.0):
    distance = np.arange(0.0, length_m + 1e-9, 0.025)
    return np.column_stack(
        [distance * math.cos(bearing_rad), distance * math.sin(bearing_rad), np.full_like(distance, bearing_rad)]
    )


def scored(planner, costmap, plan, twist=(0.3, 0.0), pose=IDENTITY):
    return planner.score_all(pose, *twist, costmap, plan)


# ---- window and samples


def test_window_is_what_one_period_reaches():
    window = dynamic_window(dwa_params(), 0.2, -0.3, PERIOD_S, 5.0)
    assert window == pytest.approx((0.165, 0.235, -0.545, -0.055))


def test_window_stays_within_the_limits():
    params = dwa_params(min_vel_x=-0.1)
    assert dynamic_window(params, 0.44, 0.9, PERIOD_S, 5.0) == pytest.approx((0.405, 0.45, 0.655, 1.0))
    assert dynamic_window(params, -0.09, -1.0, PERIOD_S, 5.0)[:2] == pytest.approx((-0.1, -0.055))


def test_a_quantised_twist_above_the_limits_leaves_the_limits():
    """40 pulses: two pulses of each wheel in 50 ms are 0.63 m/s, of one wheel 1.57 rad/s."""
    assert dynamic_window(dwa_params(), 0.628, 1.57, PERIOD_S, 5.0) == (0.45, 0.45, 1.0, 1.0)
    assert velocity_samples(dynamic_window(dwa_params(), 0.628, 1.57, PERIOD_S, 5.0), 3, 20).tolist() == [[0.45, 1.0]]


def test_without_dwa_the_window_spans_sim_time_and_does_not_overshoot():
    window = dynamic_window(dwa_params(use_dwa=False), 0.1, 0.0, PERIOD_S, 0.34)
    assert window == pytest.approx((0.0, 0.2, -1.0, 1.0))


def test_samples_hold_both_ends_and_zero():
    assert samples_between(-0.245, 0.245, 4) == pytest.approx([-0.245, -0.0816667, 0.0, 0.0816667, 0.245])
    assert samples_between(0.1, 0.3, 3) == pytest.approx([0.1, 0.2, 0.3])
    assert samples_between(0.1, 0.3, 1).tolist() == [0.1, 0.3]
    assert samples_between(0.2, 0.2, 20).tolist() == [0.2]
    assert samples_between(-0.2, 0.2, 3).tolist() == [-0.2, 0.0, 0.2]  # it is there already


def test_default_sample_count_is_upstreams():
    """3 x 20, and one more turn of 0 where the window spans it."""
    window = dynamic_window(dwa_params(), 0.2, 0.0, PERIOD_S, 5.0)
    assert len(velocity_samples(window, 3, 20)) == 63


def test_the_trajectory_is_upstreams():
    """Points no farther apart than the granularities, the start in and the end out."""
    steps = step_count(0.4, 0.5, 1.7, 0.025, 0.1)
    assert steps == 28  # 0.68 m / 0.025 m
    points = np.empty((steps, 3))
    roll_out(np.zeros(3), np.zeros(2), np.array([0.4, 0.5]), steps, 1.7, np.ones(2), False, points)
    assert points[0].tolist() == [0.0, 0.0, 0.0]
    assert points[-1, 2] == pytest.approx(0.5 * 1.7 * 27 / 28)
    radius_m = 0.4 / 0.5
    assert points[-1, :2] == pytest.approx(
        (radius_m * math.sin(points[-1, 2]), radius_m * (1 - math.cos(points[-1, 2]))), abs=0.02
    )


def test_without_dwa_the_trajectory_accelerates():
    points = np.empty((17, 3))
    roll_out(np.zeros(3), np.array([0.0, 0.0]), np.array([0.4, 0.0]), 17, 1.7, np.array([0.5, 3.0]), True, points)
    assert points[3, 0] == pytest.approx((0.05 + 0.1 + 0.15) * 0.1)


# ---- map grid


def test_distances_go_around_obstacles():
    costs = np.zeros((7, 7), np.uint8)
    costs[0:6, 3] = 253
    costs[6, 6] = 255
    distance = np.empty((7, 7), np.int32)
    assert plan_distance(costs, 1.0, np.array([[0.5, 0.5], [1.5, 0.5]]), False, distance)
    assert distance[0, :3].tolist() == [0, 0, 1]
    assert distance[0, 4] == 6 + 3 + 6  # down to row 6, past the wall, up again
    assert distance[2, 3] == 49 and distance[6, 6] == 49  # blocked, unknown
    costs[6, 3] = 254
    plan_distance(costs, 1.0, np.array([[0.5, 0.5], [1.5, 0.5]]), False, distance)
    assert distance[0, 4] == 50  # no way


def test_local_goal_is_the_last_point_before_the_plan_leaves():
    costs = np.zeros((5, 5), np.uint8)
    distance = np.empty((5, 5), np.int32)
    plan = np.array([[-3.0, 2.5], [0.5, 2.5], [9.0, 2.5], [4.5, 4.5]])
    assert plan_distance(costs, 1.0, plan, True, distance)
    assert np.argwhere(distance == 0).tolist() == [[2, 4]]
    assert plan_distance(costs, 1.0, plan, False, distance)
    assert np.argwhere(distance == 0).tolist() == [[2, column] for column in range(5)]
    assert not plan_distance(costs, 1.0, plan[:1], False, distance)


# ---- critics


def test_the_best_command_follows_a_straight_plan_at_the_highest_speed():
    best = DwaPlanner(dwa_params(), PERIOD_S).find_best(IDENTITY, 0.3, 0.0, local_costmap(), straight_plan())
    assert best.linear_mps == pytest.approx(0.335) and best.angular_radps == 0.0
    assert best.poses[-1, 0] == pytest.approx(0.335 * 1.7, abs=0.03)


def test_obstacle_critic_rejects_collisions_and_takes_the_highest_cost():
    planner = DwaPlanner(dwa_params(), PERIOD_S)
    free = scored(planner, local_costmap(), straight_plan())
    assert (free.scores[:, critics.OBSTACLE] == 0.0).all()
    # Within 0.265 m of travel the front would be in it: at 0.265 m/s for 1.7 s all collide.
    alone = DwaPlanner(dwa_params(path_distance_bias=0.0, goal_distance_bias=0.0), PERIOD_S)
    blocked = scored(alone, local_costmap([(0.52, 0.0)]), straight_plan())
    assert (blocked.totals == critics.COLLIDES).all() and blocked.best == -1
    assert scored(planner, local_costmap([(0.52, 0.0)]), straight_plan()).best == -1
    costmap = local_costmap([(0.3, 0.62)])
    beside = scored(planner, costmap, straight_plan())
    index = next(i for i, (v, w) in enumerate(beside.samples) if w == 0.0 and v == max(beside.samples[:, 0]))
    assert 0.0 < beside.scores[index, critics.OBSTACLE] <= 253


def test_path_and_goal_critics_count_cells_from_the_last_point():
    planner = DwaPlanner(dwa_params(), PERIOD_S)
    result = scored(planner, local_costmap(), straight_plan(1.0) + (0.0, 0.3, 0.0))
    for (v, w), scores in zip(result.samples, result.scores):
        steps = step_count(v, w, 1.7, 0.025, 0.1)
        points = np.empty((steps, 3))
        roll_out(np.zeros(3), np.zeros(2), np.array([v, w]), steps, 1.7, np.ones(2), False, points)
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


def test_samples_slower_than_both_minima_are_no_trajectories():
    result = scored(
        DwaPlanner(dwa_params(min_vel_trans=0.1, min_vel_theta=0.4), PERIOD_S),
        local_costmap(),
        straight_plan(),
        twist=(0.0, 0.0),
    )
    assert (result.totals == critics.NO_TRAJECTORY).all()


def test_a_robot_that_could_never_start_is_a_config_error():
    """0.7 m/s^2 in 50 ms is 0.035 m/s: below upstream's default min_vel_trans of 0.1."""
    with pytest.raises(ConfigError, match='min_vel_trans'):
        NavigatorParams.from_mapping(
            {'DWAPlannerROS': {**TABLE_2, 'min_vel_trans': 0.1, 'min_vel_theta': 0.4}}, 'x.yaml'
        )
    NavigatorParams()  # upstream's own defaults can


def test_off_the_window_is_rejected():
    result = scored(
        DwaPlanner(dwa_params(), PERIOD_S), local_costmap(width=1.0, height=1.0), straight_plan(0.4), twist=(0.4, 0.0)
    )
    assert result.best == -1


def test_no_plan_in_the_window_gives_no_command():
    assert (
        DwaPlanner(dwa_params(), PERIOD_S).find_best(
            IDENTITY, 0.0, 0.0, local_costmap(), straight_plan() + (5.0, 0.0, 0.0)
        )
        is None
    )


# ---- oscillation


def test_turning_back_binds_until_the_robot_has_got_away():
    memory = OscillationMemory(dwa_params())
    memory.update(IDENTITY, 0.0, 0.3)
    assert memory.allowed().all()
    memory.update(IDENTITY, 0.0, -0.3)  # turned back: only right from here
    assert memory.allowed().tolist() == [True, True, False, True]
    memory.update(Pose2D(0.04, 0.0, -0.15), 0.0, -0.3)  # neither 0.05 m nor 0.2 rad
    assert not memory.allowed().all()
    memory.update(Pose2D(0.04, 0.0, -0.25), 0.0, -0.3)
    assert memory.allowed().all()


def test_forward_and_backward_bind_too():
    memory = OscillationMemory(dwa_params(min_vel_x=-0.2))
    memory.update(IDENTITY, 0.1, 0.0)
    memory.update(IDENTITY, -0.1, 0.0)
    assert memory.allowed().tolist() == [False, True, True, True]
    memory.update(Pose2D(-0.06, 0.0, 0.0), -0.1, 0.0)
    assert memory.allowed().all()


def test_turning_counts_only_on_the_spot():
    memory = OscillationMemory(dwa_params())
    for angular in (0.3, -0.3, 0.3, -0.3):
        memory.update(IDENTITY, 0.2, angular)
    assert memory.allowed().all()


def test_a_bound_direction_is_rejected():
    planner = DwaPlanner(dwa_params(), PERIOD_S)
    planner.oscillation.update(IDENTITY, 0.0, 0.3)
    planner.oscillation.update(IDENTITY, 0.0, -0.3)
    result = scored(planner, local_costmap(), straight_plan(), twist=(0.0, 0.0))
    left = result.samples[:, 1] > 0.0
    assert (result.totals[left] == critics.OSCILLATES).all() and result.best >= 0


# ---- a plan that leads off behind


def test_the_dwa_alone_does_not_turn_round_but_turn_to_path_does():
    plan = straight_plan(1.4, math.pi)
    planner = DwaPlanner(dwa_params(), PERIOD_S)
    result = scored(planner, local_costmap(), plan, twist=(0.0, 0.0))
    on_the_spot = result.samples[:, 0] == 0.0
    fastest = on_the_spot & (np.abs(result.samples[:, 1]) > 0.24)
    slowest = on_the_spot & (np.abs(result.samples[:, 1]) < 0.05) & (result.totals >= 0.0)
    assert result.totals[fastest].min() > result.totals[slowest].min()
    turn = TurnToPath(dwa_params(), PERIOD_S)
    still = Motion(Pose2D(0.0, 0.0, 0.1), 0.0, 0.0)
    assert turn.command(still, plan, lambda *_: True) == (0.0, pytest.approx(0.245))
    assert turn.command(still, plan, lambda *_: False) is None
    turned = Motion(Pose2D(0.0, 0.0, math.pi - 0.9), 0.0, 1.0)
    assert turn.command(turned, plan, lambda *_: True) is None
    assert TurnToPath(dwa_params(turn_to_path_angle=0.0), PERIOD_S).command(still, plan, lambda *_: True) is None
