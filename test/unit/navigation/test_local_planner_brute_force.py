"""What the navigator computes in few steps, against the same in many plain ones."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.mapping.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation import critics
from diff_encoder_sim.navigation.costmap import INSCRIBED, LETHAL, Costmap
from diff_encoder_sim.navigation.costmap_params import CostmapParams, local_defaults
from diff_encoder_sim.navigation.dwa import DwaPlanner
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.local_planner import LocalPlanner, stretch_in_sight
from diff_encoder_sim.navigation.obstacle_layer import clear_and_mark
from diff_encoder_sim.navigation.plan_distances import plan_distance
from diff_encoder_sim.navigation.stop_rotate import Motion
from diff_encoder_sim.navigation.trajectory_rollout import roll_out, roll_out_all, step_count
from diff_encoder_sim.navigation.turn_to_path import LOOKAHEAD_M, bearing_ahead
from navigation_simulation import TABLE_2

PERIOD_S = 0.05
RAYS, RAY_STEP_RAD = 200, 2.0 * math.pi / 200


def seen_costmap(random, **params):
    """A window around (0, 0) that has seen a scan of obstacles at random distances."""
    costmap = Costmap(local_defaults(inflation_radius=0.8, cost_scaling_factor=3.0, **params))
    ranges_m = np.where(random.random(RAYS) < 0.03, random.uniform(0.45, 1.5, RAYS), math.inf)
    costmap.update(IDENTITY, Scan(0, 0.0, RAY_STEP_RAD, 0.15, 6.0, ranges_m), IDENTITY)
    return costmap


def winding_plan(random, points=60):
    """(n, 3) from near (0, 0) on, with turns."""
    yaws_rad = random.uniform(-3.0, 3.0) + np.cumsum(random.normal(0.0, 0.15, points))
    steps_m = 0.025 * np.column_stack([np.cos(yaws_rad), np.sin(yaws_rad)])
    return np.column_stack([random.uniform(-0.05, 0.05, 2) + np.cumsum(steps_m, axis=0), yaws_rad])


# ---- the search for the best sample


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
        scored, best = planner.score_all(*robot, costmap, plan), planner.find_best(*robot, costmap, plan)
        accepted = np.flatnonzero(scored.totals >= 0.0)
        assert (best is None) == (len(accepted) == 0)
        if best is not None:
            cheapest = accepted[np.argmin(scored.totals[accepted])]  # the first of equals
            assert scored.best == cheapest and best.cost == scored.totals[cheapest]
            assert params.use_dwa is False or (best.linear_mps, best.angular_radps) == tuple(scored.samples[cheapest])
            found += 1
    assert 20 < found < 60


def test_scores_are_those_of_every_point_on_its_own():
    random = np.random.default_rng(4)
    planner = DwaPlanner(DwaParams.from_mapping(TABLE_2, ''), PERIOD_S)
    rejected = 0
    for _ in range(12):
        costmap, plan, yaw_rad = seen_costmap(random), winding_plan(random), random.uniform(-3.0, 3.0)
        scored = planner.score_all(Pose2D(0.0, 0.0, yaw_rad), 0.3, 0.0, costmap, plan)
        distance = np.empty(costmap.shape, np.int32)
        plan_distance(costmap.costs, costmap.cells_per_m, plan[:, :2] - costmap.origin[:2], False, distance)
        for (v, w), scores, total in zip(scored.samples, scored.scores, scored.totals):
            points = np.empty((step_count(v, w, 1.7, 0.025, 0.1), 3))
            roll_out(
                np.array([0.0, 0.0, yaw_rad]),
                np.zeros(2),
                np.array([v, w]),
                len(points),
                1.7,
                np.ones(2),
                False,
                points,
            )
            poses = [Pose2D(*point) for point in points.tolist()]
            outlines = [costmap.footprint_cost(pose) for pose in poses]
            cells = [costmap.cell_at(*pose[:2]) for pose in poses]
            if min(outlines) < 0.0 or max(distance[cell] for cell in cells) >= distance.size:
                assert total < 0.0
                rejected += 1
            else:
                assert scores[critics.OBSTACLE] == max(outlines + [costmap.costs[cell] for cell in cells])
                assert scores[critics.PATH] == distance[cells[-1]]
    assert 50 < rejected < 700


def test_a_constant_velocity_is_free_of_collisions_if_every_point_is():
    random = np.random.default_rng(5)
    planner, answers = DwaPlanner(DwaParams.from_mapping(TABLE_2, ''), PERIOD_S), []
    for _ in range(100):
        costmap = seen_costmap(random)
        start, twist = np.array([0.0, 0.0, random.uniform(-3.0, 3.0)]), random.uniform((0, -1), (0.3, 1))
        points = np.empty((step_count(*twist, 1.7, 0.025, 0.1), 3))
        roll_out(start, twist, twist, len(points), 1.7, np.ones(2), False, points)
        answers.append(planner.is_collision_free(Pose2D(*start), *twist, costmap))
        assert answers[-1] is all(costmap.footprint_cost(Pose2D(*point)) >= 0.0 for point in points.tolist())
    assert 10 < sum(answers) < 90
    assert planner.is_collision_free(IDENTITY, 0.0, 0.0, costmap)  # it stays where it is


def test_all_samples_roll_out_as_each_does():
    samples = np.array([[0.4, 0.5], [0.0, 0.0], [0.0, -0.3], [0.05, 0.1], [0.46, 0.0], [0.3, 0.0]])
    pose, twist, accelerations = np.array([1.0, -2.0, 0.7]), np.array([0.2, -0.1]), np.array([0.7, 4.9])
    for accelerates in (False, True):
        points, steps = roll_out_all(
            pose, twist, samples, np.array([1.7, 0.025, 0.1]), np.array([0.1, 0.45, 0.2]), accelerations, accelerates
        )
        # Neither fast enough nor turning, then neither, then too fast.
        assert steps.tolist() == [28, 0, 6, 0, 0, 21]
        for index in np.flatnonzero(steps):
            alone = np.empty((steps[index], 3))
            roll_out(pose, twist, samples[index], steps[index], 1.7, accelerations, accelerates, alone)
            assert (points[index, : steps[index]] == alone).all()


# ---- distances


@pytest.mark.parametrize('seed', range(4))
def test_the_wave_equals_repeated_relaxation(seed):
    random = np.random.default_rng(seed)
    costs = random.choice([0, 100, INSCRIBED, LETHAL, 255], (25, 31), p=[0.6, 0.1, 0.1, 0.15, 0.05]).astype(np.uint8)
    plan = np.column_stack([np.linspace(-2.0, 20.0, 40), np.linspace(3.0, 18.0, 40)])
    distance = np.empty(costs.shape, np.int32)
    assert plan_distance(costs, 1.0, plan, False, distance)
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


# ---- the plan in sight


@pytest.mark.parametrize('prune_m', [0.0, 1.0])
def test_the_stretch_in_sight_is_that_of_all_distances(prune_m):
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
        assert stretch_in_sight(plan, x_m, y_m, 1.5, prune_m) == expected


def test_the_plan_in_odom_follows_robot_and_localization():
    """Kept between control periods, it is what a planner makes that has just got the plan."""
    params, costmap = DwaParams.from_mapping(TABLE_2, ''), Costmap(local_defaults())
    planner, plan = LocalPlanner(params, PERIOD_S), winding_plan(np.random.default_rng(12), 200)
    planner.set_plan(plan + 1.0)
    planner.is_goal_reached(Motion(IDENTITY, 0.0, 0.0), IDENTITY)
    planner.set_plan(plan)
    seen = set()
    for period in range(120):
        odom_in_map = Pose2D(0.01 * (period // 10), -0.02 * (period // 10), 0.03 * (period // 25))
        motion = Motion(Pose2D(*plan[period]).relative_to(odom_in_map), 0.3, 0.0)
        fresh = LocalPlanner(params, PERIOD_S)
        fresh.set_plan(plan)
        costmap.update(motion.base_pose)
        for each in (planner, fresh):
            each.compute(motion, odom_in_map, costmap)
        assert planner.plan_in_odom.tolist() == fresh.plan_in_odom.tolist()
        assert planner.is_goal_reached(motion, odom_in_map) == fresh.is_goal_reached(motion, odom_in_map)
        seen.add(len(planner.plan_in_odom))
    assert len(seen) > 5


def test_the_bearing_is_that_of_the_first_point_far_enough_from_the_nearest():
    random = np.random.default_rng(7)
    for points in (1, 2, 10, 60):
        plan = winding_plan(random, points)
        x_m, y_m = random.normal(0.0, 0.3, 2)
        nearest = int(np.argmin(np.hypot(plan[:, 0] - x_m, plan[:, 1] - y_m)))
        travelled_m = np.append(0.0, np.cumsum(np.hypot(*np.diff(plan[nearest:, :2], axis=0).T)))
        far = np.flatnonzero(travelled_m >= LOOKAHEAD_M)
        ahead = plan[nearest + far[0] if len(far) else -1]
        assert bearing_ahead(plan, x_m, y_m) == math.atan2(ahead[1] - y_m, ahead[0] - x_m)


# ---- costmaps


def enter(cells, ranges_m, x_m, y_m, clears, marks, yaw_rad=0.3, step_rad=RAY_STEP_RAD):
    """Cells of 0.05 m; rays clear up to 2.0 m, mark up to 1.8 m."""
    clear_and_mark(cells, 20.0, x_m, y_m, yaw_rad, 0.0, step_rad, ranges_m, 0.15, 6.0, 2.0, 1.8, True, clears, marks)


@pytest.mark.parametrize('place', [(1.5, 1.5), (0.02, 0.02), (2.9, 0.4), (-0.5, 1.0)])
def test_a_scan_is_entered_as_its_rays_one_by_one(place):
    random = np.random.default_rng(8)
    ranges_m = random.choice([math.inf, math.nan, 0.1, 0.2, 1.0, 1.0, 1.9, 2.5], RAYS) + random.normal(0, 0.03, RAYS)
    together = random.choice([0, LETHAL], (60, 60)).astype(np.uint8)
    one_by_one = together.copy()
    enter(together, ranges_m, *place, True, True)
    for clears in (True, False):
        for index in range(RAYS):
            alone = np.full(RAYS, math.nan)
            alone[index] = ranges_m[index]
            enter(one_by_one, alone, *place, clears, not clears)
    assert (together == one_by_one).all()


def test_rays_with_one_end_free_it_if_one_of_them_goes_on():
    for ranges_m in ([2.0, 2.5], [2.5, 2.0], [2.0, 2.5, 2.0]):
        cells = np.full((60, 60), LETHAL, np.uint8)
        enter(cells, np.array(ranges_m), 0.52, 1.52, True, False, 0.0, 0.0)
        assert np.flatnonzero(cells[30] == 0).tolist() == list(range(10, 51))
    cells = np.full((60, 60), LETHAL, np.uint8)
    enter(cells, np.array([2.0]), 0.52, 1.52, True, False, 0.0)
    assert np.flatnonzero(cells[30] == 0).tolist() == list(range(10, 50))


def test_a_ray_off_the_grid_at_once_frees_where_it_starts():
    cells = np.full((60, 60), LETHAL, np.uint8)
    enter(cells, np.array([0.2]), 0.12, 0.12, True, False, -0.75 * math.pi)
    assert np.argwhere(cells == 0).tolist() == [[0, 0], [1, 1], [2, 2]]


def test_a_ray_frees_the_cells_nearest_to_its_line():
    random = np.random.default_rng(9)
    for _ in range(100):
        range_m, index = random.uniform(0.2, 1.4), random.integers(RAYS)
        ranges_m, cells = np.full(RAYS, math.nan), np.full((60, 60), LETHAL, np.uint8)
        ranges_m[index] = range_m
        enter(cells, ranges_m, 1.5, 1.5, True, False)
        bearing_rad = 0.3 + index * RAY_STEP_RAD
        end = np.floor(20.0 * (1.5 + range_m * np.array([math.sin(bearing_rad), math.cos(bearing_rad)]))) - 30
        freed = np.argwhere(cells == 0) - 30
        major = int(np.argmax(np.abs(end)))
        # One cell a step, half a cell at most beside the line, the end left out.
        assert sorted(np.abs(freed[:, major])) == list(range(int(abs(end[major]))))
        on_line = freed[:, major] * end[1 - major] / end[major] if len(freed) else 0.0
        assert np.all(np.abs(freed[:, 1 - major] - on_line) <= 0.5)


def test_costs_do_not_depend_on_when_they_are_asked_for():
    random = np.random.default_rng(10)
    grid = OccupancyGrid(np.where(random.random((160, 200)) < 0.01, 100, 0).astype(np.int8), 0.05, Pose2D(1, 2, 0.3))
    often, once = (Costmap(CostmapParams(), grid) for _ in range(2))
    for step in range(8):
        pose = grid.origin.compose(Pose2D(1.0 + step, 4.0, 0.7 * step))
        scan = Scan(0, 0.0, RAY_STEP_RAD, 0.15, 6.0, random.uniform(0.3, 4.0, RAYS))
        for costmap in (often, once):
            costmap.update(pose, scan, pose)
            if step == 4:
                costmap.clear_obstacles(pose, 2.0)
        assert often.costs.any()
    assert (once.costs == often.costs).all()
