"""Robots described as a whole, the shipped ones, and robots of 60 kinds with 200 tags."""

import re
import shutil
import subprocess

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import RobotChoices, RobotSource
from diff_encoder_sim.robots.robot_file import load_robot_file
from diff_encoder_sim.robots.robot_setup import derived_settings
from diff_encoder_sim.robots.simulated_robot import needs_other_files
from diff_encoder_sim.robots.xacro_expansion import expand
from diff_encoder_sim.trials.robot_params import load_robot_config, override
from places import ROOT
from plugin_tags import variant
from robot_parts import CUBE_CORNERS, CUBE_TRIANGLES, finder, write_binary_stl
from urdf_texts import base, described, found, inertial, joint, link, pair, robot, sphere, usual


def test_alto_is_found_as_it_is_without_a_warning():
    alto = describe(RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro'))
    assert (alto.left.joint, alto.right.joint) == ('left_wheel_joint', 'right_wheel_joint')
    assert (alto.wheel_diameter_m, alto.wheel_separation_m) == pytest.approx((0.2, 0.4))
    assert (alto.mass.mass_kg, *alto.mass.com_m[:2]) == pytest.approx((80.0, 0.05, 0.0))
    assert [contact.name for contact in alto.contacts] == ['front_caster', 'rear_caster']
    assert alto.laser.link == 'laser'
    assert sorted(alto.footprint) == [(-0.25, -0.3), (-0.25, 0.3), (0.25, -0.3), (0.25, 0.3)]
    assert alto.warnings == () and alto.notes == ()


def test_a_file_that_was_edited_is_described_anew_and_one_that_was_not_is_not(tmp_path):
    source = RobotSource(tmp_path / 'robot.urdf')
    source.file.write_text(usual())
    first = describe(source)
    assert describe(source) is first
    source.file.write_text(usual().replace('name="made"', 'name="other"'))
    assert describe(source).tree.name == 'other'
    assert describe(source, RobotChoices(wheel_diameter=0.12)).wheel_diameter_m == 0.12


def test_all_other_joints_are_held_still_and_named_in_one_line():
    limits = '<limit lower="0" upper="1" effort="1" velocity="1"/>'
    lift = link('a') + joint('lift', 'a', '0 0 0.3', 'prismatic', inside=limits)
    pan = link('b') + joint('pan', 'b', '0 0 0.3', 'revolute', inside=limits)
    follower = link('c') + joint('follower', 'c', '0 0 0.3', 'continuous', inside='<mimic joint="pan"/>')
    (note,) = described(usual(lift, pan, follower)).notes
    assert note == 'joints held still at zero: lift (prismatic); pan (revolute); follower (continuous, mimic)'


def test_the_mass_is_that_of_all_links():
    load = f'<link name="load">{inertial(3.0, 0.01)}</link>' + joint('load_joint', 'load', '0.1 0 0.1')
    mass = described(usual(load)).mass
    assert mass.mass_kg == pytest.approx(2.0 + 2 * 0.1 + 3.0)
    assert mass.com_m[0] == pytest.approx((2.0 * 0.02 + 3.0 * 0.1) / 5.2)


def test_collision_meshes_become_primitives_with_a_note(tmp_path):
    write_binary_stl(tmp_path / 'cube.stl', 0.05 * CUBE_CORNERS, CUBE_TRIANGLES)
    mesh = link('case', '<mesh filename="package://any/cube.stl"/>') + joint('case_joint', 'case', '0 0 0.3')
    description = described(usual(mesh), find=finder(tmp_path))
    assert [note for note in description.notes if 'cube.stl' in note and 'box' in note]


def test_a_frame_without_collision_shapes_is_measured_by_its_visual_ones():
    seen = base().replace('<collision>', '<visual>').replace('</collision>', '</visual>')
    description = described(robot(seen, pair()))
    assert 'no link but the wheels has a collision shape: visual shapes are taken' in description.warnings
    assert max(x_m for x_m, _ in description.footprint) == pytest.approx(0.15)


def test_a_caster_that_can_only_be_seen_touches_all_the_same():
    seen = link('caster', sphere(0.02), shape='visual') + joint('j', 'caster', '0.1 0 0.02')
    assert [contact.name for contact in described(robot(base(), pair(), seen)).contacts] == ['caster']


def test_the_table_names_each_value_with_its_source():
    description = described(usual())
    assert found(description, 'base frame') == ('base_link', 'root link')
    assert found(description, 'mass [kg]') == ('2.2', '<inertial> of the links')
    assert [row.quantity for row in description.found][:2] == ['name', 'base frame']


def test_a_root_that_is_another_frames_name_is_refused():
    with pytest.raises(ConfigError, match="root link 'odom' is the name of a frame .*; allowed: the robot's base"):
        described(usual().replace('"base_link"', '"odom"'))


NAMES = sorted(path.stem for path in (ROOT / 'config' / 'robots').glob('*.yaml'))

# kg, wheel diameter and separation [m], counts per wheel revolution, states of the counter, reports per second
PUBLISHED = {
    'alto': (80, 0.2, 0.4, 90, 0, 20),
    'burger': (1.0, 0.066, 0.160, 4096, 2**32, 30),
    'waffle_pi': (1.8, 0.066, 0.287, 4096, 2**32, 30),
    'kobuki': (2.35 + 0.17, 0.070, 0.230, 52 * 6545 / 132, 2**16, 50),
    'create2': (3.6 + 0.17, 0.072, 0.235, 508.8, 2**16, 1 / 0.015),
    'hoverboard': (20.59, 0.165, 0.45, 90, 9000, 100),
    'gearmotor_kit': (1.26, 0.065, 0.17, 48 * 34.014, 2**32, 30),
}
# mm, length and width with the wheels
OUTSIDE = {'burger': (138, 178), 'waffle_pi': (281, 306), 'kobuki': (351.5, 351.5), 'create2': (348.5, 348.5)}


def shipped(name):
    return load_robot_file(name, ROOT, ROOT, {})


def params_of(name):
    file = shipped(name)
    config = load_robot_config(ROOT / 'config')
    return override(config, {**derived_settings(describe(file.source)), **file.overrides})


@pytest.mark.parametrize('name', NAMES)
def test_a_shipped_robot_has_the_published_mass_wheels_and_encoder(name):
    file, robot, params = shipped(name), describe(shipped(name).source), params_of(name)
    mass_kg, diameter_m, separation_m, ppr, modulus, rate_hz = PUBLISHED[name]
    assert robot.mass.mass_kg == pytest.approx(mass_kg)
    assert (robot.wheel_diameter_m, robot.wheel_separation_m) == pytest.approx((diameter_m, separation_m))
    assert (params.odometry.wheel_diameter, params.odometry.wheel_separation) == (diameter_m, separation_m)
    assert file.ppr == pytest.approx(ppr)
    assert (params.encoder.counter_modulus, params.encoder.rate) == (modulus, pytest.approx(rate_hz))


@pytest.mark.parametrize('name', NAMES)
def test_nothing_of_a_shipped_robot_is_doubtful(name):
    robot = describe(shipped(name).source)
    assert (robot.warnings, robot.notes) == ((), ())
    assert robot.laser is not None
    assert robot.contacts != ()


@pytest.mark.parametrize('name', OUTSIDE)
def test_a_shipped_robot_has_the_published_size(name):
    across_m = [max(side) - min(side) for side in zip(*describe(shipped(name).source).footprint)]
    assert [1e3 * each for each in across_m] == pytest.approx(OUTSIDE[name], abs=2)


@pytest.mark.parametrize('name', NAMES)
def test_the_counter_of_a_shipped_robot_does_not_wrap_within_a_report(name):
    """At the highest speed, and at the speed above which odometry takes a jump for a restart."""
    params, ppr = params_of(name), shipped(name).ppr
    drive = params.simulator.drive
    rim_mps = drive.max_linear_speed + 0.5 * drive.max_angular_speed * params.odometry.wheel_separation
    wheel_radps = 2 * rim_mps / params.odometry.wheel_diameter
    assert wheel_radps < params.odometry.max_wheel_speed
    counts = wheel_radps / 6.283 * ppr / params.encoder.rate
    assert counts < (params.encoder.counter_modulus or float('inf')) / 4


@pytest.mark.parametrize('name', NAMES)
def test_a_shipped_robot_travels_alone_once_expanded(name):
    assert not needs_other_files(expand(shipped(name).source))


@pytest.mark.parametrize('name', [name for name in NAMES if name != 'alto'])
def test_the_sources_of_a_shipped_robots_numbers_are_named(name):
    """Each [number] that is used is one of the list at the top, and the other way round."""
    for path in (ROOT / 'config' / 'robots' / f'{name}.yaml', ROOT / 'urdf' / f'{name}.urdf.xacro'):
        marks = re.findall(r'\[\d\]', path.read_text())
        assert marks != []
        assert min(marks.count(mark) for mark in marks) >= 2, path


@pytest.mark.skipif(shutil.which('check_urdf') is None, reason='liburdfdom-tools is not installed')
@pytest.mark.parametrize('name', NAMES)
def test_ros_reads_a_shipped_robot(name, tmp_path):
    (tmp_path / 'robot.urdf').write_text(expand(shipped(name).source))
    assert subprocess.run(['check_urdf', tmp_path / 'robot.urdf'], capture_output=True).returncode == 0


VARIANTS = 60


@pytest.mark.parametrize('number', range(VARIANTS))
def test_a_robot_is_accepted_by_its_wheels_and_not_by_words_in_tags(number):
    text, driven = variant(number)
    if driven:
        description = described(text)
        assert (description.left.joint, description.right.joint) == driven
        return
    with pytest.raises(ConfigError, match='given a robot|given an omnidirectional'):
        described(text)
