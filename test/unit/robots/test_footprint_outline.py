import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.contacts import footprint_outline
from diff_encoder_sim.robots.description import Box, Cylinder, Shape, Sphere
from diff_encoder_sim.robots.solids import reach_m
from robot_parts import random_pose, shape

WHEEL = Cylinder(0.033, 0.02)
ON_ITS_RIM = (math.pi / 2, 0, 0)


def outline_of(*shapes, floor_z_m=-10.0):
    return footprint_outline(shapes, floor_z_m, 'my.urdf')


def outside_m(outline, shapes):
    """How far shapes reach over each side of an outline."""
    corners_m = np.array(outline)
    sides_m = np.roll(corners_m, -1, axis=0) - corners_m
    normals = np.stack([sides_m[:, 1], -sides_m[:, 0], np.zeros(len(sides_m))], axis=1)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return max(reach_m(shapes, normal) - normal[:2] @ corner_m for normal, corner_m in zip(normals, corners_m))


def turns_left(outline):
    corners_m = np.array(outline)
    sides_m = np.roll(corners_m, -1, axis=0) - corners_m
    after_m = np.roll(sides_m, -1, axis=0)
    return (sides_m[:, 0] * after_m[:, 1] - sides_m[:, 1] * after_m[:, 0] > 0).all()


def test_a_box_has_its_own_four_corners():
    outline = outline_of(shape(Box((0.3, 0.2, 0.1)), (0.05, 0, 0)))
    assert sorted(outline) == [(-0.1, -0.1), (-0.1, 0.1), (0.2, -0.1), (0.2, 0.1)]


def test_wheels_beside_a_body_are_inside():
    body = shape(Box((0.3, 0.2, 0.1)))
    wheels = [shape(WHEEL, (0, y_m, 0), ON_ITS_RIM) for y_m in (0.12, -0.12)]
    corners = [(-0.15, -0.1), (-0.15, 0.1), (-0.033, -0.13), (-0.033, 0.13)]
    assert sorted(outline_of(body, *wheels)) == sorted(corners + [(-x, y) for x, y in corners])


def test_a_round_robot_has_16_corners_less_than_2_percent_farther_out():
    outline = np.array(outline_of(shape(Cylinder(0.18, 0.1))))
    assert len(outline) == 16
    assert np.hypot(*outline.T).max() < 1.02 * 0.18 + 0.001
    assert set(map(tuple, outline)) == {(x, -y) for x, y in outline} == {(-x, y) for x, y in outline}


def test_what_is_below_the_floor_does_not_count():
    body, buried = shape(Box((0.3, 0.2, 0.1)), (0, 0, 0.1)), shape(Box((9, 9, 0.1)), (0, 0, -0.06))
    assert outline_of(body, buried, floor_z_m=0.0) == outline_of(body)


def test_a_robot_without_shapes_is_one_line():
    with pytest.raises(ConfigError, match='^my.urdf: given no collision shape above the floor; allowed: [^\n]*$'):
        outline_of(shape(Sphere(0.1)), floor_z_m=0.2)


@pytest.mark.parametrize('roll_rad', [1.57, 1.5708, -1.5708])
def test_a_rounded_angle_costs_no_corner(roll_rad):
    assert len(outline_of(shape(Box((0.3, 0.1, 0.2)), rpy_rad=(roll_rad, 0, 0)))) == 4


def test_random_robots_are_held_by_few_corners_close_to_them():
    rng = np.random.default_rng(10)
    for _ in range(60):
        shapes = [
            Shape(make(*rng.uniform(0.02, 0.4, 3)), random_pose(rng))
            for make in (lambda *size: Box(size), lambda r, h, _: Cylinder(r, h), lambda r, _, __: Sphere(r))
            for _ in range(rng.integers(0, 4))
        ] or [shape(WHEEL)]
        outline = outline_of(*shapes)
        assert 3 <= len(outline) <= 16
        assert turns_left(outline)
        assert outside_m(outline, shapes) <= 1.0001e-4
        for bearing_rad in rng.uniform(0, 2 * math.pi, 20):
            direction = np.array([math.cos(bearing_rad), math.sin(bearing_rad), 0])
            reach = max(direction[:2] @ corner for corner in np.array(outline))
            assert reach < reach_m(shapes, direction) + 0.06 * np.ptp(np.array(outline), axis=0).max()
