"""What touches the floor next to the drive wheels, and the outline of the footprint."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.contacts import footprint_outline, support_balls
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import Box, Cylinder, GroundContact, RobotSource, Shape, Sphere
from diff_encoder_sim.robots.solids import reach_m
from generated_robots import Recipe, urdf_of
from robot_parts import finder, random_pose, shape, write_binary_stl
from urdf_texts import ball, base, box, described, joint, link, pair, robot, usual, wheel


def contacts_of(*parts, **given):
    """Names, x, y and height above the floor [mm] of the contacts, front to back."""
    description = described(robot(base(), pair(), *parts), **given)
    return [(contact.name, *(round(1e3 * value, 3) for value in contact.point_m)) for contact in description.contacts]


def test_a_ball_touches_at_its_lowest_point():
    assert contacts_of(ball('front', 0.1), ball('rear', -0.12, clearance_m=0.001)) == [
        ('front', 100.0, 0.0, 0.0),
        ('rear', -120.0, 0.0, 1.0),
    ]


def test_what_is_well_above_the_floor_does_not_touch_unless_it_is_called_a_caster():
    assert contacts_of(ball('sensor', 0.1, clearance_m=0.01)) == []
    assert contacts_of(ball('ball_caster', 0.1, clearance_m=0.01)) == [('ball_caster', 100.0, 0.0, 10.0)]


def test_a_caster_wheel_stands_below_its_swivel():
    """Forward it trails, backward it leads: drawn either way, its mean place is the swivel's."""
    for trail_m in (-0.03, 0.03):
        swivel = link('fork') + joint('swivel', 'fork', '0.2 0.05 0.08', 'continuous', axis='0 0 1')
        roll = wheel('roll', x_m=trail_m, radius_m=0.03, parent='fork', z_m=0.03 - 0.08)
        assert contacts_of(swivel, roll) == [('roll', 200.0, 50.0, 0.0)]


def test_a_skid_stands_in_its_middle_and_a_long_plate_on_its_edge():
    skid = link('skid', box(0.04, 0.02, 0.02)) + joint('j', 'skid', '0.1 0 0.01')
    assert contacts_of(skid) == [('skid', 100.0, 0.0, 0.0)]
    plate = link('plate', box(0.2, 0.1, 0.02)) + joint('j', 'plate', '0.15 0 0.011')
    assert contacts_of(plate) == [('plate', 250.0, 0.0, 1.0)]


def test_a_hull_on_the_floor_stands_on_both_its_edges():
    hull = link('hull', box(0.3, 0.2, 0.1)) + joint('j', 'hull', '0.02 0 0.053')
    assert contacts_of(hull) == [('hull (front)', 170.0, 0.0, 3.0), ('hull (rear)', -130.0, 0.0, 3.0)]


def test_a_mesh_touches_where_its_own_points_are_lowest(tmp_path):
    """Its box would touch at the corners."""
    body = np.array([[0.2, 0.1, 0.05], [0.2, -0.1, 0.05], [-0.2, 0.1, 0.05], [-0.2, -0.1, 0.05], [0, 0, 0.2]])
    foot = np.array([[0.1, 0.01, 0.001], [0.1, -0.01, 0.001], [0.12, 0.0, 0.001]])
    corners = np.vstack([body, foot])
    write_binary_stl(tmp_path / 'body.stl', corners, np.array([[0, 1, 4], [2, 3, 4], [0, 2, 4], [1, 3, 4], [5, 6, 7]]))
    mesh = link('shell', '<mesh filename="package://any/body.stl"/>') + joint('j', 'shell', '0 0 0')
    assert contacts_of(mesh, find=finder(tmp_path)) == [('shell', pytest.approx(110.0), 0.0, pytest.approx(1.0))]


def test_passive_wheels_of_a_driven_pair_are_contacts_and_the_driven_are_not():
    description = described(
        usual(pair(x_m=-0.2, names=('a', 'b'))), left_joint='left_wheel_joint', right_joint='right_wheel_joint'
    )
    assert [contact.name for contact in description.contacts] == ['ball_caster', 'a', 'b']


def test_a_fork_above_its_caster_is_no_contact():
    swivel = link('caster_fork', box(0.02, 0.02, 0.02)) + joint('swivel', 'caster_fork', '0.2 0 0.03', axis='0 0 1')
    assert [name for name, *_ in contacts_of(swivel, ball('caster', 0.18))] == ['caster']


FLOOR_Z_M = -0.033


@pytest.fixture
def description(tmp_path):
    path = tmp_path / 'robot.urdf'
    path.write_text(urdf_of(Recipe(root_height_m=-FLOOR_Z_M, axle_x_m=0.02), tmp_path))
    return describe(RobotSource(path))


def lean(description, com_x_m, contacts_m, com_y_m=0.0):
    """The front and the rear ball's lowest points, above the floor."""
    contacts = tuple(GroundContact('c', (x, y, z + FLOOR_Z_M)) for x, y, z in contacts_m)
    mass = description.mass._replace(com_m=np.array([com_x_m, com_y_m, 0.0]))
    balls = support_balls(description._replace(contacts=contacts, mass=mass))
    return [ball.pose_in_link[:3, 3] - (0.0, 0.0, ball.geometry.radius_m + FLOOR_Z_M) for ball in balls]


def test_the_side_of_the_centre_of_mass_touches_and_the_other_hangs_clear(description):
    contacts_m = [(0.12, 0.01, 0.0), (-0.08, -0.01, 0.0)]
    for com_x_m, expected_m in ((0.03, (0.0, 0.0001)), (0.01, (0.0001, 0.0))):
        front, rear = lean(description, com_x_m, contacts_m)
        assert front == pytest.approx([0.12, 0.01, expected_m[0]])
        assert rear == pytest.approx([-0.08, -0.01, expected_m[1]])


def test_of_several_contacts_the_lowest_carries_and_of_those_the_outermost(description):
    front, _ = lean(description, 0.05, [(0.1, 0.0, 0.0), (0.15, 0.0, 0.0), (0.3, 0.0, 0.004)])
    assert front == pytest.approx([0.15, 0.0, 0.0])


@pytest.mark.parametrize(('com_y_m', 'y_m'), [(0.01, 0.01), (0.2, 0.05), (-0.2, -0.05)])
def test_casters_side_by_side_share_the_load_below_the_centre_of_mass(description, com_y_m, y_m):
    front, _ = lean(description, 0.05, [(0.1, 0.05, 0.0), (0.1, -0.05, 0.0)], com_y_m)
    assert front == pytest.approx([0.1, y_m, 0.0])


def test_a_side_without_contacts_leans_on_the_end_of_the_footprint(description):
    front, rear = lean(description, 0.01, [])
    x_m = [x for x, _ in description.footprint]
    assert front[0] == pytest.approx(max(*x_m, 0.053)) and rear[0] == pytest.approx(min(x_m))
    assert rear[2] == pytest.approx(0.0)


def warnings_of(*parts, com_x_m=0.02):
    """The warnings, without that of the missing laser."""
    return described(robot(base(com_x_m=com_x_m), pair(), *parts)).warnings[:-1]


def test_a_robot_on_a_caster_below_its_centre_of_mass_stands_well():
    assert warnings_of(ball('front', 0.1)) == ()
    assert warnings_of(ball('front', 0.1), ball('rear', -0.1, clearance_m=0.002)) == ()
    assert warnings_of(ball('rear', -0.1), com_x_m=-0.02) == ()


@pytest.mark.parametrize(
    ('parts', 'expected'),
    [
        ((ball('rear', -0.1),), 'nothing touches the floor'),
        ((ball('front_caster', 0.1, clearance_m=0.01),), 'it would tip until a contact 10 mm up carries it'),
        (
            (ball('front', 0.1, clearance_m=-0.004), ball('rear', -0.3, clearance_m=-0.008)),
            'front and rear would lift the drive wheels by 5.0 mm',
        ),
        ((), 'nothing but the drive wheels touches the floor (a balancing robot?)'),
    ],
)
def test_a_robot_that_does_not_stand_on_its_wheels_and_a_caster_is_a_warning(parts, expected):
    (warning,) = warnings_of(*parts)
    assert expected in warning


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
