"""What touches the floor next to the drive wheels, and the supports of the simulated robot."""

import dataclasses

import numpy as np
import pytest

from diff_encoder_sim.robots.contacts import support_balls
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import GroundContact, RobotSource
from generated_robots import Recipe, urdf_of
from robot_parts import finder, write_binary_stl
from urdf_texts import ball, base, box, described, joint, link, pair, robot, sphere, usual, wheel

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
    write_binary_stl(tmp_path / 'body.stl', np.vstack([body, foot]), triangles)
    mesh = link('shell', '<mesh filename="package://any/body.stl"/>') + joint('j', 'shell', '0 0 0')
    (contact,) = described(robot(base(), pair(), mesh), finder(tmp_path)).contacts
    assert contact.point_m == pytest.approx((0.11, 0.0, 0.001))


def test_passive_wheels_of_a_driven_pair_are_contacts_and_the_driven_are_not():
    chosen = {'left_joint': 'left_wheel_joint', 'right_joint': 'right_wheel_joint'}
    description = described(usual(pair(x_m=-0.2, names=('a', 'b'))), **chosen)
    assert [contact.name for contact in description.contacts] == ['ball_caster', 'a', 'b']


@pytest.fixture
def description(tmp_path):
    path = tmp_path / 'robot.urdf'
    path.write_text(urdf_of(Recipe(root_height_m=-FLOOR_Z_M, axle_x_m=0.02), tmp_path))
    return describe(RobotSource(path))


def lean(description, com_x_m, contacts_m, com_y_m=0.0):
    """The front and the rear ball's lowest points, above the floor."""
    contacts = tuple(GroundContact('c', (x, y, z + FLOOR_Z_M)) for x, y, z in contacts_m)
    mass = description.mass._replace(com_m=np.array([com_x_m, com_y_m, 0.0]))
    balls = support_balls(dataclasses.replace(description, contacts=contacts, mass=mass))
    return [ball.pose_in_link[:3, 3] - (0.0, 0.0, ball.geometry.radius_m + FLOOR_Z_M) for ball in balls]


def test_the_side_of_the_centre_of_mass_touches_and_the_other_hangs_clear(description):
    contacts_m = [(0.12, 0.01, 0.0), (-0.08, -0.01, 0.0)]
    for com_x_m, expected_m in ((0.03, (0.0, 0.0001)), (0.01, (0.0001, 0.0))):
        front, rear = lean(description, com_x_m, contacts_m)
        assert front == pytest.approx([0.12, 0.01, expected_m[0]])
        assert rear == pytest.approx([-0.08, -0.01, expected_m[1]])


@pytest.mark.parametrize(
    ('contacts_m', 'com_y_m', 'front_m'),
    [
        # Of several contacts the lowest carries, and of those the outermost.
        ([(0.1, 0.0, 0.0), (0.15, 0.0, 0.0), (0.3, 0.0, 0.004)], 0.0, (0.15, 0.0, 0.0)),
        # Casters side by side share the load below the centre of mass.
        ([(0.1, 0.05, 0.0), (0.1, -0.05, 0.0)], 0.01, (0.1, 0.01, 0.0)),
        ([(0.1, 0.05, 0.0), (0.1, -0.05, 0.0)], -0.2, (0.1, -0.05, 0.0)),
    ],
)
def test_of_several_contacts_the_load_decides(description, contacts_m, com_y_m, front_m):
    assert lean(description, 0.05, contacts_m, com_y_m)[0] == pytest.approx(front_m)


def test_a_side_without_contacts_leans_on_the_end_of_the_footprint(description):
    front, rear = lean(description, 0.01, [])
    x_m = [x for x, _ in description.footprint]
    assert front[0] == pytest.approx(max(*x_m, 0.053)) and rear[0] == pytest.approx(min(x_m))
    assert rear[2] == pytest.approx(0.0)


@pytest.mark.parametrize(
    ('parts', 'com_x_m', 'expected'),
    [
        ((ball('front', 0.1),), 0.02, None),
        ((ball('front', 0.1), ball('rear', -0.1, clearance_m=0.002)), 0.02, None),
        ((ball('rear', -0.1),), -0.02, None),
        ((ball('rear', -0.1),), 0.02, 'where nothing carries it'),
        ((ball('front_caster', 0.1, clearance_m=0.01),), 0.02, 'where nothing carries it'),
        (
            (ball('front', 0.1, clearance_m=-0.004), ball('rear', -0.3, clearance_m=-0.008)),
            0.02,
            'front and rear would lift the drive wheels by 5.0 mm',
        ),
        ((), 0.02, 'nothing but the drive wheels touches the floor (a balancing robot?)'),
    ],
)
def test_a_robot_that_does_not_stand_on_its_wheels_and_a_caster_is_a_warning(parts, com_x_m, expected):
    *warnings, no_laser = described(robot(base(com_x_m=com_x_m), pair(), *parts)).warnings
    assert 'no laser' in no_laser and len(warnings) == (expected is not None)
    assert expected is None or expected in warnings[0]
