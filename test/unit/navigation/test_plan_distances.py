"""Distances to the plan over free cells."""

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.navigation.costmap_layers import INSCRIBED, LETHAL
from diff_encoder_sim.navigation.dwa_kernels import (
    TO_END,
    TO_FRONT,
    TO_PLAN,
    begin_waves,
    distance_to,
    make_waves,
    whole_grid,
)
from distance_grids import distances_from


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


@pytest.mark.parametrize('seed', range(4))
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
