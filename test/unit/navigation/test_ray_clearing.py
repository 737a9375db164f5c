"""Rays that clear and mark, one by one and all together."""

import math

import numpy as np
import pytest

from diff_encoder_sim.navigation.costmap_layers import FREE, LETHAL, clear_and_mark, clear_outline
from navigation_scenes import RAY_STEP_RAD
from navigation_simulation import RAYS


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


def bresenham(row, column, to_row, to_column):
    """Yield the cells of a line without its end, step by step."""
    down, right = abs(to_row - row), abs(to_column - column)
    error = right - down
    for _ in range(max(down, right)):
        yield row, column
        doubled = 2 * error
        if doubled > -down:
            error -= down
            column += 1 if to_column > column else -1
        if doubled < right:
            error += right
            row += 1 if to_row > row else -1


@pytest.mark.parametrize('place', [(0, 0), (5, 9), (12, 3), (14, 19)])
def test_every_line_is_bresenhams_up_to_the_edge(place):
    rows, columns = 15, 20
    for to_row in range(-25, 40):
        for to_column in range(-25, 45):
            cells = np.full((rows, columns), LETHAL, np.uint8)
            outline = np.array([place, (to_row, to_column)])[:, ::-1] + 0.5
            clear_outline(cells, 1.0, outline[[1, 0]])
            line = [*bresenham(*place, to_row, to_column), (to_row, to_column)]
            back = [*bresenham(to_row, to_column, *place), place]
            is_inside = 0 <= to_row < rows and 0 <= to_column < columns
            freed = set(line) | set(back if is_inside else [])
            expected = {(r, c) for r, c in freed if 0 <= r < rows and 0 <= c < columns}
            assert {(int(r), int(c)) for r, c in np.argwhere(cells == FREE)} == expected
