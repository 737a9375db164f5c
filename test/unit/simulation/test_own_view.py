"""Where the scanner is, and what of the robot it sees."""

import re

import pytest

from diff_encoder_sim.robots.description import RobotChoices, RobotSource
from diff_encoder_sim.robots.simulated_robot import load_simulated_robot
from diff_encoder_sim.simulation.lidar import LidarParams
from diff_encoder_sim.simulation.physics import PhysicsParams
from diff_encoder_sim.simulation.self_check import FlatFloor, check_laser
from diff_encoder_sim.simulation.simulator import DriveParams
from generated_robots import Recipe, urdf_of


@pytest.fixture
def check(tmp_path):
    def check_it(post_m=None, case_m=None, **recipe):
        path = tmp_path / 'robot.urdf'
        text = urdf_of(Recipe(**recipe), tmp_path)
        if post_m is not None:
            box = (
                f'<collision><origin xyz="{post_m} 0 0.2"/><geometry><box size="0.02 0.02 0.1"/></geometry></collision>'
            )
            text = text.replace('</link>', f'{box}</link>', 1)
        if case_m is not None:
            case = f'<collision><geometry><cylinder radius="{case_m}" length="0.05"/></geometry></collision>'
            text = re.sub(r'<link name="base_scan".*?/>', f'<link name="base_scan">{case}</link>', text)
            assert case in text
        path.write_text(text)
        robot = load_simulated_robot(RobotSource(path), RobotChoices())
        floor = FlatFloor(robot, DriveParams(), PhysicsParams())
        try:
            return check_laser(robot.description, floor.physics, LidarParams(range_min=0.05))
        finally:
            floor.close()

    return check_it


def test_a_scanner_on_top_sees_nothing_of_the_robot(check):
    assert check() == (
        'laser', 'base_scan at x -0.030, y 0.000, 0.180 m above the floor, sees nothing of the robot', True, ''
    )  # fmt: skip


def test_a_case_that_is_wider_than_the_shortest_range_hides_nothing(check):
    """As published: a case about the scan's frame as collision shape, and a range from inside of it."""
    assert check(case_m=0.08).value.endswith('sees nothing of the robot')
    assert re.search('sees the robot itself in [23] %', check(case_m=0.08, post_m=-0.18).value)


def test_a_post_is_seen_from_where_it_is(check):
    """0.02 m wide, 0.14 m behind: 8 degrees."""
    seen = check(post_m=-0.18)
    assert 'in 2 % of its rays, from -180 to' in seen.value
    assert seen.is_ok and 'angle_span' in seen.advice


def test_a_scanner_between_the_walls_of_its_own_body_is_not_ok(check):
    """Ahead of the box, at half its height."""
    seen = check(laser_m=(0.1, 0.0, 0.1))
    assert not seen.is_ok
    assert 'sees the robot itself in' in seen.value


def test_a_scanner_inside_the_body_is_not_ok(check):
    inside = check(laser_m=(-0.03, 0.0, 0.09))
    assert not inside.is_ok
    assert 'inside a collision shape' in inside.value


def test_a_scanner_inside_the_hull_of_a_mesh_may_be_in_a_recess(check):
    assert check(laser_m=(-0.03, 0.0, 0.09), wheel='mesh').is_ok
