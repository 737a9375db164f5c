"""Distances to the plan over free cells."""

import numpy as np
import pytest

from diff_encoder_sim.navigation.cost_values import INSCRIBED, LETHAL
from diff_encoder_sim.navigation.plan_distances import fill_distance_grid


def test_distances_go_around_obstacles():
    costs = np.zeros((7, 7), np.uint8)
    costs[0:6, 3] = 253
    costs[6, 6] = 255
    distance = np.empty((7, 7), np.int32)
    assert fill_distance_grid(costs, 1.0, np.array([[0.5, 0.5], [1.5, 0.5]]), False, distance)
    assert distance[0, :3].tolist() == [0, 0, 1]
    assert distance[0, 4] == 6 + 3 + 6  # down to row 6, past the wall, up again
    assert distance[2, 3] == 49 and distance[6, 6] == 49  # blocked, unknown
    costs[6, 3] = 254
    fill_distance_grid(costs, 1.0, np.array([[0.5, 0.5], [1.5, 0.5]]), False, distance)
    assert distance[0, 4] == 50  # no way


def test_local_goal_is_the_last_point_before_the_plan_leaves():
    costs = np.zeros((5, 5), np.uint8)
    distance = np.empty((5, 5), np.int32)
    plan = np.array([[-3.0, 2.5], [0.5, 2.5], [9.0, 2.5], [4.5, 4.5]])
    assert fill_distance_grid(costs, 1.0, plan, True, distance)
    assert np.argwhere(distance == 0).tolist() == [[2, 4]]
    assert fill_distance_grid(costs, 1.0, plan, False, distance)
    assert np.argwhere(distance == 0).tolist() == [[2, column] for column in range(5)]
    assert not fill_distance_grid(costs, 1.0, plan[:1], False, distance)


@pytest.mark.parametrize('seed', range(4))
def test_the_wave_equals_repeated_relaxation(seed):
    random = np.random.default_rng(seed)
    costs = random.choice([0, 100, INSCRIBED, LETHAL, 255], (25, 31), p=[0.6, 0.1, 0.1, 0.15, 0.05]).astype(np.uint8)
    plan = np.column_stack([np.linspace(-2.0, 20.0, 40), np.linspace(3.0, 18.0, 40)])
    distance = np.empty(costs.shape, np.int32)
    assert fill_distance_grid(costs, 1.0, plan, False, distance)
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
