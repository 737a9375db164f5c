"""What the self-check says of robots that are right, and of robots that are not."""

import re

import pytest

from diff_encoder_sim.robots.description import RobotChoices, RobotSource
from diff_encoder_sim.robots.simulated_robot import GeometryErrors, load_simulated_robot
from diff_encoder_sim.simulation.self_check import self_check
from diff_encoder_sim.simulation.simulator import SimulatorParams
from generated_robots import RECIPES, Recipe, urdf_of
from places import ROOT


@pytest.fixture
def load(tmp_path):
    def load_it(recipe, *errors, effort_nm=0.0):
        path = tmp_path / 'robot.urdf'
        limit = f'<limit effort="{effort_nm}" velocity="0"/></joint>'
        path.write_text(urdf_of(recipe, tmp_path).replace('</joint>', limit))
        return load_simulated_robot(RobotSource(path), RobotChoices(), GeometryErrors(*errors))

    return load_it


def checks_of(robot, **drive):
    limits = {**robot.description.drive_limits, **drive}
    return {check.name: check for check in self_check(robot, SimulatorParams.from_mapping({'drive': limits}, 'test'))}


def failures(robot, **drive):
    return [name for name, check in checks_of(robot, **drive).items() if not check.is_ok]


@pytest.mark.heavy
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


def test_weak_motors_are_found(load):
    weak = checks_of(load(Recipe()), wheel_torque=0.005)['torque']
    assert not weak.is_ok
    assert 'wheel_torque' in weak.advice


def test_a_robot_that_stands_on_its_caster_is_found(load):
    assert 'weight on the driven wheels' in failures(load(Recipe(com_m=(-0.078, 0.0, 0.04))))


def test_a_robot_that_tips_over_is_found(load):
    assert 'pitch' in failures(load(Recipe(com_m=(-0.13, 0.0, 0.04))))


def test_a_robot_that_rocks_leans_onto_its_other_support(load):
    """It hangs clear by a thousandth of its distance."""
    rocking = checks_of(load(Recipe(com_m=(-0.005, 0.0, 0.15))), max_linear_acceleration=1.5)['pitch']
    assert rocking.is_ok
    assert re.search(r' to 0\.0[5-9] while', rocking.value)


def test_a_robot_without_a_laser_drives_and_gets_the_line_that_adds_one(load):
    robot = load(Recipe())
    checks = checks_of(robot._replace(description=robot.description._replace(laser=None)))
    assert all(check.is_ok for check in checks.values())
    assert 'laser: {parent: base, xyz: [0.0, 0.0, 0.' in checks['laser'].advice


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
