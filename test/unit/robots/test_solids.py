"""Primitives and balls against the textbook, points, and random poses."""

import math

import numpy as np
import pytest

from diff_encoder_sim.robots import solids
from diff_encoder_sim.robots.solids import Box, Cylinder, MassProperties, Sphere, homogeneous, reach_m
from robot_parts import random_pose, shape

Y, DOWN = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, -1.0])
PRIMITIVES = [Box((0.3, 0.2, 0.1)), Cylinder(0.033, 0.018), Sphere(0.05)]


@pytest.mark.parametrize(
    ('geometry', 'volume', 'moments'),
    [
        (Box((2, 3, 4)), 24, [25, 20, 13]),
        (Cylinder(2, 3), 12 * math.pi, [3 * 4 + 9, 3 * 4 + 9, 6 * 4]),
        (Sphere(2), 32 / 3 * math.pi, [0.4 * 12 * 4] * 3),
    ],
)
def test_solids_have_the_volume_and_the_inertia_of_the_textbook(geometry, volume, moments):
    assert solids.measures(geometry)[0] == pytest.approx(volume)
    assert_same(homogeneous([shape(geometry)], 12.0), (12.0, [0, 0, 0], np.diag(moments)))


@pytest.mark.parametrize(
    ('part', 'lowest_m'),
    [
        (shape(Box((2, 6, 2)), (1, 2, 5), (0, math.pi / 4, 0)), [1, 2, 5 - math.sqrt(2)]),  # the middle of the edge
        (shape(Box((2, 6, 2)), (1, 2, 5)), [1, 2, 4]),
        (shape(Cylinder(3, 2), (1, 2, 5)), [1, 2, 4]),
        (shape(Cylinder(0.5, 2), (1, 2, 5), (math.pi / 2, 0, 0)), [1, 2, 4.5]),
        (shape(Cylinder(1, 2), rpy_rad=(math.pi / 6, 0, 0)), [0, 0.5 - math.sqrt(0.75), -0.5 - math.sqrt(0.75)]),
    ],
)
def test_the_lowest_point_is_the_middle_of_what_lies_flat(part, lowest_m):
    assert part.support_point_m(DOWN) == pytest.approx(lowest_m)


@pytest.mark.parametrize('geometry', PRIMITIVES)
def test_no_point_of_a_shape_is_farther_than_its_support(geometry):
    rng = np.random.default_rng(2)
    for _ in range(20):
        part = shape(geometry)._replace(pose_in_link=random_pose(rng))
        middle_m, direction, point_m = part.pose_in_link[:3, 3], rng.normal(size=3), rng.normal(size=3)
        unit = direction / np.linalg.norm(direction)
        points_m = middle_m + rng.uniform(-0.2, 0.2, (5000, 3))
        points_m = points_m[[part.holds(each) for each in points_m]]
        outmost_m = part.support_point_m(direction)
        assert unit @ outmost_m == pytest.approx(reach_m([part], direction))
        assert reach_m([part], direction) - 0.05 < (points_m @ unit).max() <= reach_m([part], direction)
        assert part.holds(middle_m + 0.999 * (outmost_m - middle_m))
        assert not part.holds(middle_m + 1.001 * (outmost_m - middle_m))
        assert np.linalg.norm(points_m - point_m, axis=1).max() <= solids.farthest_m([part], point_m)


@pytest.mark.parametrize(
    ('part', 'radius_m'),
    [
        (shape(Cylinder(0.033, 0.018), (0, 0.01, 0), (-math.pi / 2, 0, 0)), 0.033),
        (shape(Cylinder(0.033, 0.018), (0, 0.01, 0), (1.57, 0, 0)), 0.033),
        (shape(Sphere(0.033), (0, 0.3, 0.001)), 0.033),
        (shape(Box((0.066, 0.018, 0.066))), 0),
        (shape(Cylinder(0.033, 0.018)), 0),  # lies flat
        (shape(Cylinder(0.033, 0.018), (0.01, 0, 0), (math.pi / 2, 0, 0)), 0),  # off the axis
        (shape(Sphere(0.033), (0, 0, 0.01)), 0),
    ],
)
def test_round_shapes_on_the_axis_roll(part, radius_m):
    assert part.rolling_radius_m(Y) == radius_m


def assert_same(found, expected):
    for value, right in zip(found, expected):
        assert value == pytest.approx(right, rel=1e-9, abs=1e-12)


def test_a_solid_cut_into_pieces_with_their_own_frames_is_the_solid():
    """A URDF's form: a pose of the link, and in it a centre of mass and an inertia along the link's axes."""
    rng = np.random.default_rng(8)
    whole = homogeneous([shape(Box((0.4, 0.2, 0.1)))], 8.0)
    pieces = []
    for corner in np.ndindex(2, 2, 2):
        centre_m = (np.array(corner) - 0.5) * [0.2, 0.1, 0.05]
        frame = random_pose(rng)
        turn = frame[:3, :3]
        inertia = turn.T @ homogeneous([shape(Box((0.2, 0.1, 0.05)))], 1.0).inertia_kgm2 @ turn
        pieces.append(MassProperties(1.0, turn.T @ (centre_m - frame[:3, 3]), inertia).moved(frame))
    assert_same(solids.merged(pieces), whole)
