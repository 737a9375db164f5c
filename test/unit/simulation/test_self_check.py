"""What the self-check reports of robots that are right and wrong, and of what the scanner sees of the robot."""

import re
from contextlib import closing

import pytest

from diff_encoder_sim.robots.description import RobotChoices, RobotSource
from diff_encoder_sim.robots.simulated_robot import GeometryErrors, load_simulated_robot
from diff_encoder_sim.simulation.lidar import LidarParams
from diff_encoder_sim.simulation.physics import PhysicsParams
from diff_encoder_sim.simulation.self_check import FlatFloor, check_laser, self_check
from diff_encoder_sim.simulation.simulator import DriveParams, SimulatorParams
from generated_robots import RECIPES, Recipe, urdf_of
from places import ROOT


@pytest.fixture
def load(tmp_path):
    def load_it(recipe, *errors, effort_nm=0.0, **shapes):
        path = tmp_path / 'robot.urdf'
        limit = f'<limit effort="{effort_nm}" velocity="0"/></joint>'
        path.write_text(with_shapes(urdf_of(recipe, tmp_path), **shapes).replace('</joint>', limit))
        return load_simulated_robot(RobotSource(path), RobotChoices(), GeometryErrors(*errors))

    return load_it


def checks_of(robot, **drive):
    limits = {**robot.description.drive_limits, **drive}
    return {check.name: check for check in self_check(robot, SimulatorParams.from_mapping({'drive': limits}, 'test'))}


def failures(robot, **drive):
    return [name for name, check in checks_of(robot, **drive).items() if not check.is_ok]


@pytest.mark.parametrize('name', list(RECIPES))
def test_robots_as_people_write_them_pass(name, load):
    checks = checks_of(load(RECIPES[name]))
    assert [check for check in checks.values() if not check.is_ok] == []
    assert len(checks) == 8


def test_alto_passes():
    alto = load_simulated_robot(RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro'), RobotChoices())
    checks = {check.name: check for check in self_check(alto, SimulatorParams())}
    assert all(check.is_ok for check in checks.values())
    assert checks['weight on the driven wheels'].value == 'left 289 N (37 %), right 289 N (37 %) of 785 N'
    assert checks['laser'].value.startswith('laser at x 0.120, y 0.000, 1.120 m above the floor')


def test_wheels_with_errors_roll_as_they_are(load):
    assert failures(load(Recipe(), 0.02, -0.01, 0.03)) == []


def test_cylinder_wheels_as_they_are_written_fail(load, tmp_path):
    """This is what would be measured without the import's corrections."""
    robot = load(Recipe(wheel_mass_kg=0.1))
    text = urdf_of(Recipe(wheel_mass_kg=0.1), tmp_path)
    assert 'turn, left' in failures(robot._replace(urdf=text, floor_only_links=()))


@pytest.mark.parametrize(
    ('com_m', 'torque_nm', 'name', 'advice'),
    [
        ((-0.005, 0.0, 0.04), 0.005, 'torque', 'wheel_torque'),
        ((-0.078, 0.0, 0.04), 5.0, 'weight on the driven wheels', 'nearer to the axle'),
        ((-0.13, 0.0, 0.04), 5.0, 'pitch', 'tips over'),
    ],
)
def test_a_robot_that_is_weak_stands_on_its_caster_or_tips_over_is_found(load, com_m, torque_nm, name, advice):
    check = checks_of(load(Recipe(com_m=com_m)), wheel_torque=torque_nm)[name]
    assert not check.is_ok and advice in check.advice


def test_a_robot_that_rocks_leans_onto_its_other_support(load):
    """It hangs clear by a thousandth of its distance."""
    rocking = checks_of(load(Recipe(com_m=(-0.005, 0.0, 0.15))), max_linear_acceleration=1.5)['pitch']
    assert rocking.is_ok
    assert re.search(r' to 0\.0[5-9] while', rocking.value)


def test_a_light_robot_with_a_large_inertia_and_one_with_weak_motors_pass_by_their_limits(load):
    """As Neobotix's MP-500: 5 kg with an inertia of 2.6 kg m^2 about wheels 0.5 m apart."""
    recipe = Recipe(
        10.0, (-0.08, 0.0, 0.1), (2.6, 0.6, 0.2), -0.5, 0.13, 0.5, wheel_mass_kg=1.8,
        casters_m=((-0.43, 0.0),), laser_m=(0.2, 0.0, 0.5),
    )  # fmt: skip
    assert failures(load(recipe), max_angular_acceleration=6.0)
    assert failures(load(recipe)) == []
    weak = load(Recipe(), effort_nm=0.01)
    assert failures(weak, max_linear_acceleration=1.5, max_angular_acceleration=6.0) == ['torque']
    assert failures(weak) == []


def with_shapes(text, post_m=None, case_m=None):
    """A robot with a post on its first link, and a case about its scanner's frame, as collision shapes."""
    shape = '<collision><origin xyz="{} 0 {}"/><geometry><{}/></geometry></collision>'
    if post_m is not None:
        text = text.replace('</link>', shape.format(post_m, 0.2, 'box size="0.02 0.02 0.1"') + '</link>', 1)
    if case_m is not None:
        case = shape.format(0, 0, f'cylinder radius="{case_m}" length="0.05"')
        text = text.replace('<link name="base_scan">', f'<link name="base_scan">{case}')
    return text


@pytest.mark.parametrize(
    ('shapes', 'recipe', 'is_ok', 'value'),
    [
        ({}, {}, True, 'base_scan at x -0.030, y 0.000, 0.180 m above the floor, sees nothing of the robot'),
        # As published: a case about the scan's frame as collision shape, and a range from inside of it.
        ({'case_m': 0.08}, {}, True, 'sees nothing of the robot'),
        ({'case_m': 0.08, 'post_m': -0.18}, {}, True, 'sees the robot itself in [23] %'),
        ({'post_m': -0.18}, {}, True, 'in 2 % of its rays, from -180 to'),  # 0.02 m wide, 0.14 m behind: 8 degrees
        ({}, {'laser_m': (0.1, 0.0, 0.1)}, False, 'sees the robot itself in'),  # ahead of the box, at half its height
        ({}, {'laser_m': (-0.03, 0.0, 0.09)}, False, 'inside a collision shape'),
        ({}, {'laser_m': (-0.03, 0.0, 0.09), 'wheel': 'mesh'}, True, 'inside a collision shape'),  # maybe in a recess
    ],
)
def test_what_a_scanner_sees_of_its_own_robot_is_judged(load, shapes, recipe, is_ok, value):
    robot = load(Recipe(**recipe), **shapes)
    with closing(FlatFloor(robot, DriveParams(), PhysicsParams())) as floor:
        seen = check_laser(robot.description, floor.physics, LidarParams(range_min=0.05))
    assert seen.is_ok == is_ok and re.search(value, seen.value)
    assert ('angle_span' in seen.advice) == ('itself' in seen.value)
