"""What touches the floor beside the drive wheels."""

import numpy as np
import pytest

from diff_encoder_sim.robots.contacts import support_balls
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import GroundContact, RobotSource
from generated_robots import Recipe, urdf_of
from robot_parts import finder, write_binary_stl
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


def test_a_caster_on_the_other_side_does_not_hold_it():
    (warning,) = warnings_of(ball('rear', -0.1))
    assert 'nothing touches the floor' in warning


def test_a_caster_high_above_the_floor_lets_it_tip():
    (warning,) = warnings_of(ball('front_caster', 0.1, clearance_m=0.01))
    assert 'it would tip until a contact 10 mm up carries it' in warning


def test_casters_on_both_sides_that_reach_below_the_wheels_lift_them():
    (warning,) = warnings_of(ball('front', 0.1, clearance_m=-0.004), ball('rear', -0.3, clearance_m=-0.008))
    assert warning.startswith('front and rear would lift the drive wheels by 5.0 mm')


def test_a_robot_without_a_caster_is_told_to_get_supports():
    (warning,) = warnings_of()
    assert warning.startswith('nothing but the drive wheels touches the floor (a balancing robot?)')
