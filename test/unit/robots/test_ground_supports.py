"""Where the robot leans: on the lowest contacts, level, and on one side of the axle only."""

import numpy as np
import pytest

from diff_encoder_sim.robots.contacts import support_balls
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import GroundContact, RobotSource
from generated_robots import Recipe, urdf_of

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
