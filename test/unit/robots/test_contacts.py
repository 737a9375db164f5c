"""What touches the floor next to the drive wheels, the supports of the simulated robot, and its outline."""

import dataclasses
import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.contacts import footprint_outline, support_balls
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import GroundContact, RobotSource
from diff_encoder_sim.robots.solids import Box, Cylinder, Shape, Sphere, reach_m
from generated_robots import Recipe, urdf_of
from robot_parts import finder, random_pose, shape, write_mesh
from urdf_texts import ball, base, box, described, joint, link, pair, robot, sphere, wheel

FLOOR_Z_M = -0.033


def swivel(trail_m):
    fork = link('fork') + joint('swivel', 'fork', '0.2 0.05 0.08', 'continuous', axis='0 0 1')
    return fork, wheel('roll', x_m=trail_m, radius_m=0.03, parent='fork', z_m=0.03 - 0.08)


def plate(name, at, *size_m):
    return link(name, box(*size_m)) + joint('j', name, at)


FORK = link('caster_fork', box(0.02, 0.02, 0.02)) + joint('swivel', 'caster_fork', '0.2 0 0.03', axis='0 0 1')
SEEN = link('caster', sphere(0.02), shape='visual') + joint('j', 'caster', '0.1 0 0.02')


@pytest.mark.parametrize(
    ('parts', 'expected'),  # names, x, y and height above the floor [mm], front to back
    [
        ((ball('front', 0.1), ball('rear', -0.12, clearance_m=0.001)), [('front', 100, 0, 0), ('rear', -120, 0, 1)]),
        ((ball('sensor', 0.1, clearance_m=0.01),), []),
        ((ball('ball_caster', 0.1, clearance_m=0.01),), [('ball_caster', 100, 0, 10)]),
        # Forward a caster trails, backward it leads: its mean place is the swivel's.
        (swivel(-0.03), [('roll', 200, 50, 0)]),
        (swivel(0.03), [('roll', 200, 50, 0)]),
        ((plate('skid', '0.1 0 0.01', 0.04, 0.02, 0.02),), [('skid', 100, 0, 0)]),
        ((plate('plate', '0.15 0 0.011', 0.2, 0.1, 0.02),), [('plate', 250, 0, 1)]),
        ((plate('hull', '0.02 0 0.053', 0.3, 0.2, 0.1),), [('hull (front)', 170, 0, 3), ('hull (rear)', -130, 0, 3)]),
        ((FORK, ball('caster', 0.18)), [('caster', 180, 0, 0)]),
        ((SEEN,), [('caster', 100, 0, 0)]),
    ],
)
def test_what_touches_the_floor_and_where(parts, expected):
    contacts = described(robot(base(), pair(), *parts)).contacts
    found = [(contact.name, *(round(1e3 * value, 3) for value in contact.point_m)) for contact in contacts]
    assert found == expected


def test_a_mesh_touches_at_its_lowest_points(tmp_path):
    """Its box would touch at the corners."""
    body = np.array([[0.2, 0.1, 0.05], [0.2, -0.1, 0.05], [-0.2, 0.1, 0.05], [-0.2, -0.1, 0.05], [0, 0, 0.2]])
    foot = np.array([[0.1, 0.01, 0.001], [0.1, -0.01, 0.001], [0.12, 0.0, 0.001]])
    triangles = np.array([[0, 1, 4], [2, 3, 4], [0, 2, 4], [1, 3, 4], [5, 6, 7]])
    write_mesh(tmp_path / 'body.stl', np.vstack([body, foot]), triangles)
    mesh = link('shell', '<mesh filename="package://any/body.stl"/>') + joint('j', 'shell', '0 0 0')
    (contact,) = described(robot(base(), pair(), mesh), finder(tmp_path)).contacts
    assert contact.point_m == pytest.approx((0.11, 0.0, 0.001))


@pytest.mark.parametrize(
    ('com_m', 'contacts_m', 'front_m', 'rear_m'),
    [
        # The side of the centre of mass touches, the other hangs clear.
        ((0.03, 0), [(0.12, 0.01, 0), (-0.08, -0.01, 0)], (0.12, 0.01, 0), (-0.08, -0.01, 0.0001)),
        ((0.01, 0), [(0.12, 0.01, 0), (-0.08, -0.01, 0)], (0.12, 0.01, 0.0001), (-0.08, -0.01, 0)),
        # Of several contacts the lowest carries, and of those the outermost.
        ((0.05, 0), [(0.1, 0, 0), (0.15, 0, 0), (0.3, 0, 0.004)], (0.15, 0, 0), None),
        # Casters side by side share the load below the centre of mass.
        ((0.05, 0.01), [(0.1, 0.05, 0), (0.1, -0.05, 0)], (0.1, 0.01, 0), None),
        ((0.05, -0.2), [(0.1, 0.05, 0), (0.1, -0.05, 0)], (0.1, -0.05, 0), None),
        # A side without contacts leans on the end of the footprint.
        ((0.01, 0), [], (0.053, 0, 0.000033), (-0.1, 0, 0)),
    ],
)
def test_where_the_robot_leans(tmp_path, com_m, contacts_m, front_m, rear_m):
    (tmp_path / 'robot.urdf').write_text(urdf_of(Recipe(root_height_m=-FLOOR_Z_M, axle_x_m=0.02), tmp_path))
    description = describe(RobotSource(tmp_path / 'robot.urdf'))
    contacts = tuple(GroundContact('c', (x, y, z + FLOOR_Z_M)) for x, y, z in contacts_m)
    mass = description.mass._replace(com_m=np.array([*com_m, 0.0]))
    balls = support_balls(dataclasses.replace(description, contacts=contacts, mass=mass))
    front, rear = (ball.pose_in_link[:3, 3] - (0.0, 0.0, ball.geometry.radius_m + FLOOR_Z_M) for ball in balls)
    assert front == pytest.approx(front_m, abs=1e-6)
    assert rear_m is None or rear == pytest.approx(rear_m, abs=1e-6)


@pytest.mark.parametrize(
    ('parts', 'com_x_m', 'expected'),
    [
        ((ball('front', 0.1), ball('rear', -0.1, clearance_m=0.002)), 0.02, None),
        ((ball('rear', -0.1),), -0.02, None),
        ((ball('rear', -0.1),), 0.02, 'where nothing carries it'),
        ((ball('f', 0.1, -0.004), ball('r', -0.3, -0.008)), 0.02, 'f and r would lift the drive wheels by 5.0 mm'),
        ((), 0.02, 'nothing but the drive wheels touches the floor (a balancing robot?)'),
    ],
)
def test_a_robot_that_does_not_stand_on_its_wheels_and_a_caster_is_a_warning(parts, com_x_m, expected):
    *warnings, no_laser = described(robot(base(com_x_m=com_x_m), pair(), *parts)).warnings
    assert 'no laser' in no_laser and len(warnings) == (expected is not None)
    assert expected is None or expected in warnings[0]


BODY = shape(Box((0.3, 0.2, 0.1)), (0, 0, 0.1))
WHEEL = Cylinder(0.033, 0.02)
WHEELS = [shape(WHEEL, (0, y_m, 0), (math.pi / 2, 0, 0)) for y_m in (0.12, -0.12)]


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


def test_a_round_robot_has_16_corners_less_than_2_percent_farther_out_and_one_without_shapes_is_refused():
    outline = np.array(outline_of(shape(Cylinder(0.18, 0.1))))
    assert len(outline) == 16
    assert np.hypot(*outline.T).max() < 1.02 * 0.18 + 0.001
    assert set(map(tuple, outline)) == {(x, -y) for x, y in outline} == {(-x, y) for x, y in outline}
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
