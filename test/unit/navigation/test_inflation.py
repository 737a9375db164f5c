"""Inflation against brute force and upstream's formula."""

import numpy as np
import pytest

from diff_encoder_sim.navigation.costmap_layers import FREE, INSCRIBED, LETHAL, NO_INFORMATION, squared_distances
from navigation_scenes import static_costmap

INSCRIBED_M = 0.26  # of 0.5 x 0.6 m and 0.01 m of padding


@pytest.mark.parametrize('seed', range(5))
def test_distance_transform_equals_brute_force_up_to_the_limit(seed):
    random = np.random.default_rng(seed)
    is_obstacle = random.random((40, 55)) < random.choice([0.002, 0.02, 0.3])
    limit = int(random.integers(1, 25))
    squared = squared_distances(is_obstacle, limit)
    rows, columns = np.nonzero(is_obstacle)
    row, column = np.indices(is_obstacle.shape)
    exact = ((row[..., None] - rows) ** 2 + (column[..., None] - columns) ** 2).min(axis=-1, initial=10**6)
    within = exact <= limit * limit
    assert (squared[within] == exact[within]).all()
    assert (squared[~within] > limit * limit).all()


def test_inflation_follows_upstreams_formula():
    cells = np.zeros((81, 81))
    cells[40, 40] = 100
    costmap = static_costmap(cells, inflation_radius=0.8, cost_scaling_factor=4.0)
    row, column = np.indices(cells.shape)
    distance_m = np.hypot(row - 40, column - 40) * 0.05
    expected = np.floor(252.0 * np.exp(-4.0 * (distance_m - INSCRIBED_M)))
    expected[distance_m <= INSCRIBED_M] = INSCRIBED
    expected[distance_m > 0.8 + 1e-9] = FREE
    expected[40, 40] = LETHAL
    assert (costmap.costs == expected).all()


def test_inflation_enters_the_unknown_only_where_the_robot_would_touch():
    cells = np.full((41, 41), -1)
    cells[20, 20] = 100
    costs = static_costmap(cells).costs
    assert costs[20, 20] == LETHAL and costs[20, 25] == INSCRIBED
    assert costs[20, 26] == NO_INFORMATION
