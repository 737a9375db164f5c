"""Windows of a grid's cells."""

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.costmap_layers import GridWindow, changed_window, window_around

SHAPE = (20, 30)


@pytest.mark.parametrize(
    ('x_m', 'y_m', 'window'),
    [
        (1.0, 0.6, (7, 18, 15, 26)),  # 0.25 m are 5 cells to either side
        (0.02, 0.98, (14, 20, 0, 6)),
        (-3.0, 0.5, (5, 16, 0, 0)),
        (1.0, 1e6, (20, 20, 15, 26)),
    ],
)
def test_a_window_around_a_place_ends_at_the_grid(x_m, y_m, window):
    assert window_around(Pose2D(x_m, y_m, 0.0), 0.25, 20.0, SHAPE) == window


def test_every_cell_within_reach_is_in_the_window():
    random = np.random.default_rng(1)
    centres_m = (np.indices(SHAPE) + 0.5) / 20.0
    for _ in range(100):
        x_m, y_m, reach_m = random.uniform(-0.5, 2.0), random.uniform(-0.5, 1.5), random.uniform(0.0, 1.0)
        is_near = (np.abs(centres_m[0] - y_m) <= reach_m) & (np.abs(centres_m[1] - x_m) <= reach_m)
        is_inside = np.zeros(SHAPE, bool)
        is_inside[window_around(Pose2D(x_m, y_m, 0.0), reach_m, 20.0, SHAPE).cells] = True
        assert not (is_near & ~is_inside).any()


def test_a_margin_ends_at_the_grid():
    assert GridWindow(3, 5, 10, 28).with_margin(4, SHAPE) == (0, 9, 6, 30)


def test_the_window_around_two_holds_both():
    assert GridWindow(3, 5, 10, 28).around_both(GridWindow(1, 4, 12, 29)) == (1, 5, 10, 29)


@pytest.mark.parametrize(('window', 'is_empty'), [((2, 2, 0, 9), True), ((0, 9, 5, 4), True), ((2, 3, 4, 5), False)])
def test_a_window_without_rows_or_columns_is_empty(window, is_empty):
    assert GridWindow(*window).is_empty is is_empty


def test_the_window_of_a_change_holds_all_cells_that_differ_and_no_more():
    before = np.zeros(SHAPE, np.uint8)
    after = before.copy()
    after[3, 20] = after[7, 4] = after[5, 29] = 1
    assert changed_window(before, after) == (3, 8, 4, 30)
    assert changed_window(after, before) == (3, 8, 4, 30)
    assert changed_window(before, before.copy()).is_empty
