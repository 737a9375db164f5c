"""Costmaps: layers and rays against their definitions, and updates of windows against whole ones."""

import itertools
import math

import numpy as np
import pytest

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation import costmap as layers
from diff_encoder_sim.navigation import costmap_params
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_params import FREE, INSCRIBED, LETHAL, NO_INFORMATION, local_defaults
from navigation_simulation import FEW_RAYS, FEW_STEP_RAD, scan_of, static_costmap


def local(*scans, **params):
    costmap = Costmap(local_defaults(**params))
    for ranges_by_degree in scans:
        costmap.update(IDENTITY, scan_of(ranges_by_degree), IDENTITY)
    return costmap


def walled(*columns, shape=(100, 100), **params):
    cells = np.zeros(shape)
    cells[:, columns] = 100
    return static_costmap(cells, **params)


def test_footprint_cost_depends_on_heading():
    costmap = walled(57, inflation_radius=0.3)  # at x = 2.85 to 2.90
    assert costmap.footprint_cost(Pose2D(2.55, 2.5, 0.0)) >= 0.0  # 0.26 m ahead: clear
    assert costmap.footprint_cost(Pose2D(2.55, 2.5, math.pi / 2)) == costmap_params.IN_OBSTACLE  # 0.31 m
    assert costmap.footprint_cost(Pose2D(0.2, 2.5, 0.0)) == costmap_params.OFF_MAP


@pytest.mark.parametrize(
    ('params', 'expected'),
    [
        ({}, [[0, 0, 254], [255, 0, 0]]),
        ({'lethal_cost_threshold': 65, 'track_unknown_space': False}, [[0, 0, 254], [0, 254, 254]]),
        ({'trinary_costmap': False}, [[0, 127, 254], [255, 251, 165]]),
    ],
)
def test_static_layer_reads_occupancy_as_upstream(params, expected):
    assert static_costmap([[0, 50, 100], [-1, 99, 65]], inflation_radius=0.0, **params).costs.tolist() == expected


def test_a_hit_is_marked_and_inflated_until_a_longer_range_clears_it():
    costmap = local({0: 1.02, 90: 2.6}, width=6.0, height=6.0)
    assert [costmap.cost_at(x, 0.0) for x in (1.02, 0.8)] == [LETHAL, INSCRIBED]
    assert costmap.cost_at(0.0, 2.6) == FREE  # farther than obstacle_range 2.5
    costmap.update(IDENTITY, scan_of({0: 0.72}), IDENTITY)
    assert costmap.cost_at(1.02, 0.0) == LETHAL  # behind the new hit: not seen, so kept
    costmap.update(IDENTITY, scan_of({0: 1.32}), IDENTITY)
    assert costmap.cost_at(0.72, 0.0) < INSCRIBED and costmap.cost_at(1.32, 0.0) == LETHAL


@pytest.mark.parametrize('inf_is_valid', [True, False])
def test_no_return_clears_only_if_it_is_valid(inf_is_valid):
    costmap = local({0: 1.02}, {0: math.inf}, scan={'inf_is_valid': inf_is_valid})
    assert (costmap.cost_at(1.02, 0.0) == FREE) is inf_is_valid


@pytest.mark.parametrize('range_m', [math.nan, 0.1, 6.5])
def test_ranges_that_say_nothing_change_nothing(range_m):
    costmap = local({0: 1.02}, dict.fromkeys(range(360), range_m))
    assert (costmap.costs == local({0: 1.02}).costs).all()


def test_the_robot_frees_where_it_stands():
    costmap, behind = Costmap(local_defaults()), Pose2D(-1.0, 0.0, 0.0)
    costmap.update(behind, scan_of({0: 1.02}), behind)
    assert costmap.cost_at(0.02, 0.0) == LETHAL
    costmap.update(Pose2D(0.0, 0.0, 0.4))
    assert costmap.cost_at(0.02, 0.0) == FREE


def test_a_window_may_keep_apart_what_no_ray_has_seen():
    costmap = local({0: 1.02}, track_unknown_space=True)
    assert [costmap.cost_at(x, 0.0) for x in (0.0, 0.4, 1.02, 1.4)] == [FREE, FREE, LETHAL, NO_INFORMATION]
    costmap.clear_obstacles(IDENTITY)
    assert costmap.cost_at(0.5, 0.0) == NO_INFORMATION
    costmap.update(Pose2D(0.5, 0.0, 0.0))
    assert costmap.cost_at(1.9, 0.0) == NO_INFORMATION


def test_costs_do_not_depend_on_when_they_are_asked_for():
    random = np.random.default_rng(10)
    walls = np.where(np.random.default_rng(1).random((160, 200)) < 0.01, 100, 0)
    grid = OccupancyGrid(walls.astype(np.int8), 0.05, Pose2D(1, 2, 0.3))
    often, once = (Costmap(costmap_params.CostmapParams(), grid) for _ in range(2))
    for step in range(8):
        pose = grid.origin.compose(Pose2D(1.0 + step, 4.0, 0.7 * step))
        scan = Scan(0, 0.0, FEW_STEP_RAD, 0.15, 6.0, random.uniform(0.3, 4.0, FEW_RAYS))
        for costmap in (often, once):
            costmap.update(pose, scan, pose)
            if step == 4:
                costmap.clear_obstacles(pose, 2.0)
        assert often.costs.any()
    assert (once.costs == often.costs).all()


def test_scans_overrule_the_map_only_upwards_and_static_obstacles_are_distinguished():
    costmap, pose = walled(70), Pose2D(2.5, 2.5, 0.0)
    costmap.update(pose, scan_of({0: 2.2, 90: 1.0}), pose)
    assert costmap.cost_at(3.52, 2.5) == LETHAL  # the wall stays although a ray went through
    assert costmap.cost_at(2.5, 3.5) == LETHAL  # what the map does not show is added
    points = (3.3, 2.5), (3.2, 2.5), (2.5, 3.5)
    assert [costmap.is_static_obstacle(*point) for point in points] == [True, False, False]


def test_clearing_keeps_a_square_around_the_robot():
    costmap = local({0: 1.02, 90: 2.02}, width=6.0, height=6.0)
    costmap.clear_obstacles(IDENTITY, 3.0)
    assert costmap.cost_at(1.02, 0.0) == LETHAL and costmap.cost_at(0.0, 2.02) == FREE
    costmap.clear_obstacles(IDENTITY)
    assert (costmap.costs == FREE).all()


def test_a_window_of_another_size_begins_empty_around_the_robot():
    window, here = Costmap(local_defaults()), Pose2D(5.0, 2.0, 0.0)
    window.update(here, scan_of({0: 0.6}), here)
    assert window.reconfigured(local_defaults(inflation_radius=0.2)).origin == window.origin
    larger = window.reconfigured(local_defaults(width=4.0))
    larger.update(here)
    assert larger.shape == (60, 80) and (larger.costs == FREE).all() and larger.cost_at(*here[:2]) == FREE


def test_inflation_follows_upstreams_formula():
    cells = np.zeros((81, 81))
    cells[40, 40] = 100
    costmap = static_costmap(cells, inflation_radius=0.8, cost_scaling_factor=4.0)
    row, column = np.indices(cells.shape)
    distance_m, inscribed_m = np.hypot(row - 40, column - 40) * 0.05, 0.26  # of 0.5 x 0.6 m and 0.01 m of padding
    expected = np.floor(252.0 * np.exp(-4.0 * (distance_m - inscribed_m)))
    expected[distance_m <= inscribed_m] = INSCRIBED
    expected[distance_m > 0.8 + 1e-9] = FREE
    expected[40, 40] = LETHAL
    assert (costmap.costs == expected).all()


def test_inflation_enters_the_unknown_only_where_the_robot_would_touch():
    cells = np.full((41, 41), -1)
    cells[20, 20] = 100
    assert static_costmap(cells).costs[20, [20, 25, 26]].tolist() == [LETHAL, INSCRIBED, NO_INFORMATION]


@pytest.mark.parametrize(('x_m', 'y_m'), [(0.15, 0.0), (-0.35, 0.25), (0.0, 3.0), (-3.1, 0.0)])
def test_the_window_keeps_what_stays_in_sight(x_m, y_m):
    costmap = local(inflation_radius=0.0, track_unknown_space=True, footprint_clearing_enabled=False)
    before = np.random.default_rng(1).choice([FREE, LETHAL], costmap.shape).astype(np.uint8)
    costmap._obstacles = before.copy()
    costmap.update(Pose2D(x_m + 0.01, y_m + 0.01, 0.0))
    down, right = round(y_m / 0.05), round(x_m / 0.05)
    padded = np.pad(before, 100, constant_values=NO_INFORMATION)
    assert (costmap.costs == padded[100 + down : 160 + down, 100 + right : 160 + right]).all()


def test_a_polygon_clears_its_inside_and_its_sides():
    cells = np.full((20, 30), LETHAL, np.uint8)
    layers.clear_polygon(cells, 20.0, np.array([[0.51, 0.26], [0.51, 0.49], [0.29, 0.49], [0.29, 0.26]]))
    assert np.argwhere(cells == FREE).tolist() == [[row, column] for row in range(5, 10) for column in range(5, 11)]


def enter(cells, ranges_m, x_m, y_m, clears, marks):
    """Cells of 0.05 m; rays clear up to 2.0 m, mark up to 1.8 m."""
    scan = Scan(0, 0.0, FEW_STEP_RAD, 0.15, 6.0, ranges_m)
    layers.clear_and_mark(cells, 20.0, Pose2D(x_m, y_m, 0.3), scan, layers.RayRules(2.0, 1.8, True, clears, marks))


@pytest.mark.parametrize('place', [(1.5, 1.5), (2.9, 0.4), (-0.5, 1.0)])
def test_a_scan_is_entered_as_its_rays_one_by_one(place):
    random = np.random.default_rng(8)
    ranges_m = random.choice([math.inf, math.nan, 0.1, 0.2, 1.0, 1.0, 1.9, 2.5], FEW_RAYS)
    ranges_m += random.normal(0, 0.03, FEW_RAYS)
    together = random.choice([0, LETHAL], (60, 60)).astype(np.uint8)
    one_by_one = together.copy()
    enter(together, ranges_m, *place, True, True)
    for clears in (True, False):
        for index in range(FEW_RAYS):
            alone = np.where(np.arange(FEW_RAYS) == index, ranges_m, math.nan)
            enter(one_by_one, alone, *place, clears, not clears)
    assert (together == one_by_one).all()


@pytest.mark.parametrize('place', [(0, 0), (5, 9)])
def test_every_line_has_a_cell_within_half_a_cell_at_each_step_up_to_the_edge(place):
    """A polygon of two corners is a line and back; what is not freed lies off the line."""
    shape, start = (15, 20), np.array(place)
    for end in itertools.product(range(-25, 40, 3), range(-25, 45, 2)):
        cells = np.full(shape, LETHAL, np.uint8)
        layers.clear_polygon(cells, 1.0, np.array([end, place])[:, ::-1] + 0.5)
        steps = np.abs(end - start).max()
        line = start + np.linspace(0.0, 1.0, steps + 1)[:, None] * (end - start)
        apart = np.abs(np.argwhere(cells == FREE)[:, None] - line).max(axis=2)
        assert (apart.min(axis=1) <= 0.5 + 1e-9).all()
        is_inside = ((line >= 0) & (line <= np.subtract(shape, 1))).all(axis=1)
        assert (apart.min(axis=0)[is_inside] <= 0.5 + 1e-9).all()
