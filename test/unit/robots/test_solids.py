import itertools
import math

import numpy as np
import pytest

from diff_encoder_sim.robots.description import Box, Cylinder, Inertial, MassProperties, Sphere
from diff_encoder_sim.robots.solids import (
    farthest_m,
    holds_point,
    homogeneous,
    link_mass,
    lowest_point_m,
    merged,
    placed,
    reach_m,
    rolling_radius_m,
    smallest_ball,
    support_point_m,
    volume_m3,
)
from robot_parts import pose, random_pose, shape

Y = np.array([0.0, 1.0, 0.0])
PRIMITIVES = [Box((0.3, 0.2, 0.1)), Cylinder(0.033, 0.018), Sphere(0.05)]


def test_volumes_are_those_of_the_textbook():
    assert volume_m3(Box((2, 3, 4))) == 24
    assert volume_m3(Cylinder(2, 3)) == pytest.approx(12 * math.pi)
    assert volume_m3(Sphere(3)) == pytest.approx(36 * math.pi)


@pytest.mark.parametrize('geometry', PRIMITIVES)
def test_a_point_is_inside_of_a_primitive_until_its_farthest_point(geometry):
    turned = shape(geometry, (1, 2, 5), (0.3, -0.7, 1.1))
    middle_m = turned.pose_in_link[:3, 3]
    for direction in np.random.default_rng(0).normal(size=(20, 3)):
        outmost_m = support_point_m(turned, direction)
        assert holds_point(turned, middle_m + 0.999 * (outmost_m - middle_m))
        assert not holds_point(turned, middle_m + 1.001 * (outmost_m - middle_m))


def test_the_lowest_point_of_a_box_on_its_edge_is_in_the_middle_of_the_edge():
    lowest_m = lowest_point_m(shape(Box((2, 6, 2)), (1, 2, 5), (0, math.pi / 4, 0)))
    assert lowest_m == pytest.approx([1, 2, 5 - math.sqrt(2)])


def test_the_lowest_point_of_a_flat_face_is_its_middle():
    assert lowest_point_m(shape(Box((2, 6, 2)), (1, 2, 5))) == pytest.approx([1, 2, 4])
    assert lowest_point_m(shape(Cylinder(3, 2), (1, 2, 5))) == pytest.approx([1, 2, 4])


def test_a_lying_cylinder_touches_the_floor_below_its_middle():
    assert lowest_point_m(shape(Cylinder(0.5, 2), (1, 2, 5), (math.pi / 2, 0, 0))) == pytest.approx([1, 2, 4.5])


@pytest.mark.parametrize('tilt_rad', [0.1, 0.8, 1.5])
def test_a_tilted_cylinder_touches_the_floor_with_its_rim(tilt_rad):
    lowest_m = lowest_point_m(shape(Cylinder(0.5, 2), rpy_rad=(tilt_rad, 0, 0)))
    assert lowest_m[2] == pytest.approx(-math.cos(tilt_rad) - 0.5 * math.sin(tilt_rad))


@pytest.mark.parametrize('geometry', PRIMITIVES)
def test_no_point_of_a_shape_is_farther_than_its_support(geometry):
    """Random points of the shape, random poses and directions."""
    rng = np.random.default_rng(2)
    inside_m = _points_inside(geometry, rng)
    for _ in range(20):
        part = shape(geometry)._replace(pose_in_link=random_pose(rng))
        direction = rng.normal(size=3)
        unit = direction / np.linalg.norm(direction)
        reaches_m = (inside_m @ part.pose_in_link[:3, :3].T + part.pose_in_link[:3, 3]) @ unit
        assert reaches_m.max() <= reach_m([part], direction)
        assert unit @ support_point_m(part, direction) == pytest.approx(reach_m([part], direction))
        assert reaches_m.max() > reach_m([part], direction) - 0.03


@pytest.mark.parametrize('geometry', PRIMITIVES)
def test_no_point_of_a_shape_is_farther_from_a_point_than_said(geometry):
    rng = np.random.default_rng(3)
    part, point_m = shape(geometry)._replace(pose_in_link=random_pose(rng)), rng.normal(size=3)
    inside_m = _points_inside(geometry, rng) @ part.pose_in_link[:3, :3].T + part.pose_in_link[:3, 3]
    assert np.linalg.norm(inside_m - point_m, axis=1).max() <= farthest_m([part], point_m)


def test_a_shape_is_placed_by_its_links_pose():
    part = placed(shape(Box((1, 1, 1)), (1, 0, 0)), pose((0, 0, 2), (0, 0, math.pi / 2)))
    assert part.pose_in_link[:3, 3] == pytest.approx([0, 1, 2])


@pytest.mark.parametrize('roll_rad', [math.pi / 2, -math.pi / 2, 1.5708, 1.57])
def test_a_cylinder_along_the_axis_rolls_on_its_radius(roll_rad):
    assert rolling_radius_m(shape(Cylinder(0.033, 0.018), (0, 0.01, 0), (roll_rad, 0, 0)), Y) == 0.033


def test_a_ball_on_the_axis_rolls_on_its_radius():
    assert rolling_radius_m(shape(Sphere(0.033), (0, 0.3, 0.001)), Y) == 0.033


@pytest.mark.parametrize(
    'part',
    [
        shape(Box((0.066, 0.018, 0.066))),
        shape(Cylinder(0.033, 0.018)),
        shape(Cylinder(0.033, 0.018), (0.01, 0, 0), (math.pi / 2, 0, 0)),
        shape(Sphere(0.033), (0, 0, 0.01)),
    ],
    ids=['box', 'lies flat', 'off the axis', 'ball off the axis'],
)
def test_what_is_not_round_about_the_axis_does_not_roll(part):
    assert rolling_radius_m(part, Y) is None


def _points_inside(geometry, rng):
    points_m = rng.uniform(-1, 1, (20_000, 3))
    if isinstance(geometry, Box):
        return points_m * geometry.size_xyz_m / 2
    if isinstance(geometry, Cylinder):
        points_m = points_m[np.hypot(points_m[:, 0], points_m[:, 1]) <= 1]
        return points_m * [geometry.radius_m, geometry.radius_m, geometry.length_m / 2]
    return geometry.radius_m * points_m[np.linalg.norm(points_m, axis=1) <= 1]


NOTHING = MassProperties(0.0, np.zeros(3), np.zeros((3, 3)))


def assert_same(found, expected):
    for value, right in zip(found, expected):
        assert value == pytest.approx(right, rel=1e-9, abs=1e-12)


def random_body(rng):
    """Six point masses: an inertia that a body can have."""
    masses_kg, points_m = rng.uniform(0.1, 2, 6), rng.normal(size=(6, 3))
    return merged(MassProperties(mass, point, np.zeros((3, 3))) for mass, point in zip(masses_kg, points_m))


def moved(body, by):
    return link_mass(Inertial(*body), by)


@pytest.mark.parametrize(
    ('geometry', 'moments'),
    [
        (Box((2, 3, 4)), [12 / 12 * 25, 12 / 12 * 20, 12 / 12 * 13]),
        (Cylinder(2, 3), [12 / 12 * (3 * 4 + 9), 12 / 12 * (3 * 4 + 9), 12 / 2 * 4]),
        (Sphere(2), [0.4 * 12 * 4] * 3),
    ],
)
def test_homogeneous_solids_have_the_inertia_of_the_textbook(geometry, moments):
    assert_same(homogeneous([shape(geometry)], 12.0), (12.0, [0, 0, 0], np.diag(moments)))


def test_pieces_joined_in_any_order_and_any_frame_are_the_same_body():
    rng = np.random.default_rng(7)
    for _ in range(50):
        bodies, by = [random_body(rng) for _ in range(4)], random_pose(rng)
        whole = merged(bodies)
        assert_same(merged([merged(bodies[2:]), merged(bodies[:2])]), whole)
        assert_same(merged(moved(body, by) for body in bodies), moved(whole, by))


def test_a_solid_cut_into_pieces_with_frames_of_their_own_is_the_solid():
    """A URDF's way to say it: a pose of the link, and in it a centre of mass and an inertia along the link's axes."""
    rng = np.random.default_rng(8)
    whole = homogeneous([shape(Box((0.4, 0.2, 0.1)))], 8.0)
    pieces = []
    for corner in np.ndindex(2, 2, 2):
        centre_m = (np.array(corner) - 0.5) * [0.2, 0.1, 0.05]
        frame = random_pose(rng)
        turn = frame[:3, :3]
        inertia = turn.T @ homogeneous([shape(Box((0.2, 0.1, 0.05)))], 1.0).inertia_kgm2 @ turn
        pieces.append(link_mass(Inertial(1.0, turn.T @ (centre_m - frame[:3, 3]), inertia), frame))
    assert_same(merged(pieces), whole)


@pytest.mark.parametrize('dimensions', [2, 3])
def test_a_ball_around_a_cube_goes_through_its_corners(dimensions):
    corners_m = np.array(list(itertools.product((1.0, 3.0), repeat=dimensions)))
    ball = smallest_ball(corners_m)
    assert ball.centre_m == pytest.approx(np.full(dimensions, 2.0))
    assert ball.radius_m == pytest.approx(np.sqrt(dimensions))


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
