import itertools

import numpy as np
import pytest

from diff_encoder_sim.robots.solids import smallest_ball


@pytest.mark.parametrize('dimensions', [2, 3])
def test_a_ball_around_a_cube_goes_through_its_corners(dimensions):
    corners_m = np.array(list(itertools.product((1.0, 3.0), repeat=dimensions)))
    ball = smallest_ball(corners_m)
    assert ball.centre_m == pytest.approx(np.full(dimensions, 2.0))
    assert ball.radius_m == pytest.approx(np.sqrt(dimensions))


def test_an_obtuse_triangle_is_held_by_its_longest_side():
    assert smallest_ball(np.array([[-1.0, 0], [1, 0], [0.5, 0.1]])).radius_m == pytest.approx(1)


def test_one_point_and_equal_points_have_no_radius():
    assert smallest_ball(np.array([[1.0, 2, 3]])).radius_m == 0
    assert smallest_ball(np.ones((5, 2))).radius_m == 0


def test_points_on_a_line_are_held_by_their_ends():
    points_m = np.outer(np.linspace(-1, 1, 7), [3.0, 0, 4])
    ball = smallest_ball(points_m)
    assert (ball.radius_m, *ball.centre_m) == pytest.approx((5, 0, 0, 0))


@pytest.mark.parametrize('dimensions', [2, 3])
def test_no_ball_around_random_points_is_smaller(dimensions):
    """A smaller one would have its centre elsewhere: the radius about a point is convex in the point."""
    rng = np.random.default_rng(dimensions)
    for _ in range(20):
        points_m = rng.normal(size=(8, dimensions))
        ball = smallest_ball(points_m)
        assert np.linalg.norm(points_m - ball.centre_m, axis=1).max() <= ball.radius_m * (1 + 1e-9)
        nearby_m = ball.centre_m + rng.normal(scale=0.05, size=(200, dimensions))
        reaches_m = np.linalg.norm(points_m[None] - nearby_m[:, None], axis=2).max(axis=1)
        assert reaches_m.min() >= ball.radius_m * (1 - 1e-9)


def test_many_points_of_a_rim_take_no_time_and_give_its_radius():
    bearings_rad = np.linspace(0, 2 * np.pi, 100_001)
    rim_m = 0.033 * np.stack([np.cos(bearings_rad), np.sin(bearings_rad)], axis=1) + [5, -7]
    assert smallest_ball(rim_m).radius_m == pytest.approx(0.033, rel=1e-7)
