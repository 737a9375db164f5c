"""Each critic by a case made by hand, and all scores against those of single points."""

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.navigation import dwa_kernels as critics
from diff_encoder_sim.navigation.dwa import DwaPlanner
from diff_encoder_sim.navigation.dwa_params import DwaParams
from distance_grids import distances_from
from dwa_scoring import score_all, scored
from navigation_scenes import PERIOD_S, dwa_params, local_costmap, seen_costmap, straight_plan, winding_plan
from navigation_simulation import TABLE_2
from rolled_out import rolled_out


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


def test_samples_slower_than_both_minima_are_no_trajectories():
    result = scored(
        DwaPlanner(dwa_params(min_vel_trans=0.1, min_vel_theta=0.4), PERIOD_S),
        local_costmap(),
        straight_plan(),
        twist=(0.0, 0.0),
    )
    assert (result.totals == critics.NO_TRAJECTORY).all()


def test_off_the_window_is_rejected():
    result = scored(
        DwaPlanner(dwa_params(), PERIOD_S), local_costmap(width=1.0, height=1.0), straight_plan(0.4), twist=(0.4, 0.0)
    )
    assert result.best == -1


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
