"""The outline of the footprint."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.contacts import footprint_outline
from diff_encoder_sim.robots.solids import Box, Cylinder, Shape, Sphere, reach_m
from robot_parts import random_pose, shape

WHEEL = Cylinder(0.033, 0.02)
BODY = shape(Box((0.3, 0.2, 0.1)), (0, 0, 0.1))
ON_ITS_RIM = (math.pi / 2, 0, 0)
WHEELS = [shape(WHEEL, (0, y_m, 0), ON_ITS_RIM) for y_m in (0.12, -0.12)]


def outline_of(*shapes, floor_z_m=-10.0):
    return footprint_outline(shapes, floor_z_m, 'my.urdf')


def mirrored(*corners):
    return sorted({(sign * x, side * y) for x, y in corners for sign in (1, -1) for side in (1, -1)})


@pytest.mark.parametrize(
    ('shapes', 'corners'),
    [
        ([shape(Box((0.3, 0.2, 0.1)), (0.05, 0, 0))], [(-0.1, -0.1), (-0.1, 0.1), (0.2, -0.1), (0.2, 0.1)]),
        ([BODY, *WHEELS], mirrored((0.15, 0.1), (0.033, 0.13))),
        ([shape(Box((0.3, 0.1, 0.2)), rpy_rad=(1.57, 0, 0))], mirrored((0.15, 0.1))),  # a rounded angle
        ([BODY, shape(Box((9, 9, 0.1)), (0, 0, -10.06))], mirrored((0.15, 0.1))),  # below the floor
    ],
)
def test_corners_of_boxes_and_wheels(shapes, corners):
    assert sorted(outline_of(*shapes)) == corners


def test_a_round_robot_has_16_corners_less_than_2_percent_farther_out():
    outline = np.array(outline_of(shape(Cylinder(0.18, 0.1))))
    assert len(outline) == 16
    assert np.hypot(*outline.T).max() < 1.02 * 0.18 + 0.001
    assert set(map(tuple, outline)) == {(x, -y) for x, y in outline} == {(-x, y) for x, y in outline}


def test_a_robot_without_shapes_is_one_line():
    with pytest.raises(ConfigError, match='^my.urdf: given no collision shape above the floor; allowed: [^\n]*$'):
        outline_of(shape(Sphere(0.1)), floor_z_m=0.2)


def test_random_robots_are_held_by_few_corners_close_to_them():
    rng = np.random.default_rng(10)
    for _ in range(30):
        shapes = [
            Shape(make(*rng.uniform(0.02, 0.4, 3)), random_pose(rng))
            for make in (lambda *size: Box(size), lambda r, h, _: Cylinder(r, h), lambda r, _, __: Sphere(r))
            for _ in range(rng.integers(0, 4))
        ] or [shape(WHEEL)]
        corners_m = np.array(outline_of(*shapes))
        assert 3 <= len(corners_m) <= 16
        sides_m = np.roll(corners_m, -1, axis=0) - corners_m
        after_m = np.roll(sides_m, -1, axis=0)
        assert (sides_m[:, 0] * after_m[:, 1] > sides_m[:, 1] * after_m[:, 0]).all()  # turns left
        normals = np.stack([sides_m[:, 1], -sides_m[:, 0], np.zeros(len(sides_m))], axis=1)
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        assert all(reach_m(shapes, out) - out[:2] @ corner <= 1.0001e-4 for out, corner in zip(normals, corners_m))
        for bearing_rad in rng.uniform(0, 2 * math.pi, 20):
            direction = np.array([math.cos(bearing_rad), math.sin(bearing_rad), 0])
            reach = (corners_m @ direction[:2]).max()
            assert reach < reach_m(shapes, direction) + 0.06 * np.ptp(corners_m, axis=0).max()
