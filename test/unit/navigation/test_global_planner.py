"""Global plans: optimal against references, free of collisions, and clear about failure."""

import heapq
import itertools
import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_params import CostmapParams
from diff_encoder_sim.navigation.global_planner import GlobalPlanner, PlanError
from diff_encoder_sim.navigation.navigator_params import NavfnParams

RESOLUTION_M, START = 0.05, Pose2D(1.0, 2.5, 0.0)


def planner(cells, origin=Pose2D(0.0, 0.0, 0.0), costmap_params=None, **params):
    grid = OccupancyGrid(np.asarray(cells, np.int8), RESOLUTION_M, origin)
    costmap = Costmap(CostmapParams.from_mapping(costmap_params or {}, ''), grid)
    return GlobalPlanner(NavfnParams.from_mapping(params, ''), costmap)


def random_cells(seed, shape=(120, 160)):
    random = np.random.default_rng(seed)
    cells = np.zeros(shape, np.int8)
    for _ in range(12):
        row, column = random.integers(15, shape[0] - 25), random.integers(25, shape[1] - 35)
        cells[row : row + random.integers(2, 12), column : column + random.integers(2, 12)] = 100
    return cells


def dijkstra(weights, start):
    """Cheapest costs over the eight neighbours: a step costs its length times the mean weight of its ends."""
    costs, heap = np.full(weights.shape, np.inf), [(0.0, start)]
    costs[start] = 0.0
    while heap:
        cost, (row, column) = heapq.heappop(heap)
        for down, right in itertools.product((-1, 0, 1), repeat=2) if cost == costs[row, column] else ():
            to = row + down, column + right
            if min(to) < 0 or not np.isfinite(weights[to] + weights[row, to[1]] + weights[to[0], column]):
                continue
            new = cost + 0.5 * math.hypot(down, right) * (weights[row, column] + weights[to])
            if new < costs[to]:
                costs[to] = new
                heapq.heappush(heap, (new, to))
    return costs


def cost_along(plan, weights):
    """Cost of a plan: weight integrated over its length in cells."""
    points = plan[:, :2] / RESOLUTION_M
    steps = np.diff(points, axis=0)
    total = 0.0
    for fraction in (0.1, 0.3, 0.5, 0.7, 0.9):
        cells = np.floor(points[:-1] + fraction * steps).astype(int)
        total += 0.2 * (np.hypot(*steps.T) * weights[cells[:, 1], cells[:, 0]]).sum()
    return total


@pytest.mark.parametrize('seed', range(2))
@pytest.mark.parametrize('use_dijkstra', [True, False])
def test_plans_cost_no_more_than_a_reference_dijkstras(seed, use_dijkstra):
    """A grid path bends by 45 degrees only and is up to 8 % longer than a plan."""
    made_by = planner(random_cells(seed), use_dijkstra=use_dijkstra)
    start, goal = Pose2D(0.52, 0.52, 0.0), Pose2D(7.43, 5.33, 1.0)
    plan = made_by.make_plan(start, goal)
    weights = made_by._weight_of_cost[made_by.costmap.costs]
    weights[[0, -1]] = weights[:, [0, -1]] = np.inf
    reference = dijkstra(weights, made_by.costmap.cell_at(*start[:2]))
    best = reference[made_by.costmap.cell_at(*goal[:2])]
    assert 0.90 * best < cost_along(plan, weights) < 1.01 * best
    cells = [made_by.costmap.cell_at(x, y) for x, y, _ in plan]
    assert all(np.isfinite(weights[cell]) for cell in cells)


def test_a_plan_in_the_open_is_straight_and_looks_along_itself():
    plan = planner(np.zeros((100, 200))).make_plan(Pose2D(1.0, 1.0, 2.0), Pose2D(9.0, 4.0, -1.0))
    assert tuple(plan[0, :2]) == (1.0, 1.0) and tuple(plan[-1]) == (9.0, 4.0, -1.0)
    steps = np.diff(plan[:, :2], axis=0)
    assert np.hypot(*steps.T).sum() == pytest.approx(math.hypot(8.0, 3.0), rel=0.01)
    assert np.hypot(*steps.T).max() < 2.0 * RESOLUTION_M
    assert plan[:-1, 2] == pytest.approx(np.arctan2(steps[:, 1], steps[:, 0]))


def test_the_map_may_be_turned_and_shifted():
    origin, start, goal = Pose2D(-3.0, 2.0, 0.7), Pose2D(0.52, 0.52, 0.0), Pose2D(7.43, 5.33, 0.2)
    straight = planner(random_cells(1)).make_plan(start, goal)
    turned = planner(random_cells(1), origin).make_plan(origin.compose(start), origin.compose(goal))
    expected = [origin.compose(Pose2D(*pose))[:2] for pose in straight.tolist()]
    assert turned[:, :2] == pytest.approx(np.array(expected), abs=1e-9)


def walled():
    cells = np.zeros((100, 120), np.int8)
    cells[:, 60] = 100
    return cells


@pytest.mark.parametrize(
    ('goal', 'reason', 'is_lasting'),
    [
        (Pose2D(math.nan, 1.0, 0.0), 'not finite', True),
        (Pose2D(7.0, 1.0, 0.0), 'outside the map', True),
        (Pose2D(3.02, 2.5, 0.0), 'in a wall', True),
        (Pose2D(2.9, 2.5, 0.0), 'close to a wall', True),  # the robot would touch it
        (Pose2D(5.0, 2.5, 0.0), 'no path', False),
    ],
)
def test_failures_have_their_reason(goal, reason, is_lasting):
    with pytest.raises(PlanError) as caught:
        planner(walled()).make_plan(START, goal)
    assert reason in str(caught.value) and caught.value.is_lasting == is_lasting


def test_unknown_space_is_a_way_only_if_allowed():
    cells = np.zeros((60, 120), np.int8)
    cells[:, 50:60] = -1
    goal = Pose2D(5.0, 1.5, 0.0)
    assert len(planner(cells).make_plan(Pose2D(1.0, 1.5, 0.0), goal)) > 2
    for blocked in (goal, Pose2D(2.7, 1.5, 0.0)):  # beyond and inside
        with pytest.raises(PlanError):
            planner(cells, allow_unknown=False).make_plan(Pose2D(1.0, 1.5, 0.0), blocked)


def test_tolerance_takes_the_nearest_free_point():
    made_by = planner(walled())
    plan = made_by.make_plan(START, Pose2D(2.95, 2.5, 0.5), tolerance_m=0.4)
    assert plan[-1, 2] == 0.5
    assert math.hypot(plan[-1, 0] - 2.95, plan[-1, 1] - 2.5) <= 0.4
    assert made_by.costmap.cost_at(plan[-1, 0], plan[-1, 1]) < 253
    with pytest.raises(PlanError):
        made_by.make_plan(START, Pose2D(2.95, 2.5, 0.5), tolerance_m=0.1)


def test_a_robot_pressed_to_a_wall_may_leave_and_go_to_its_own_cell():
    """Localization is off by centimetres: inscribed cells under the robot must not lock it in."""
    made_by = planner(walled())
    assert tuple(made_by.make_plan(Pose2D(2.85, 2.5, 0.0), START)[0, :2]) == (2.85, 2.5)
    plan = made_by.make_plan(START, Pose2D(1.01, 2.51, 3.0))
    assert plan.tolist() == [[1.0, 2.5, pytest.approx(math.pi / 4)], [1.01, 2.51, 3.0]]
