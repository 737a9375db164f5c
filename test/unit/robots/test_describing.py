"""Robots described as a whole, the shipped ones, and the masses and inertias of links."""

import re
import shutil
import subprocess

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.describing import describe, robot_mass
from diff_encoder_sim.robots.description import Findings, RobotChoices, RobotSource
from diff_encoder_sim.robots.meshes import primitive_tree
from diff_encoder_sim.robots.robot_file import load_robot_file
from diff_encoder_sim.robots.robot_setup import derived_settings
from diff_encoder_sim.robots.solids import Box, Cylinder, Sphere, homogeneous
from diff_encoder_sim.robots.xacro_expansion import expand
from diff_encoder_sim.trials.robot_params import load_robot_config, override
from diff_encoder_sim.trials.trial_files import needs_other_files
from places import ROOT
from robot_parts import (
    CUBE_CORNERS,
    CUBE_TRIANGLES,
    finder,
    inertial,
    joint,
    link,
    mesh_shape,
    pose,
    shape,
    tree,
    write_binary_stl,
)
from urdf_texts import base, described, found, pair, robot, usual
from urdf_texts import joint as joint_text
from urdf_texts import link as link_text


def test_alto_is_found_as_it_is_without_a_warning():
    alto = describe(RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro'))
    assert (alto.left.joint, alto.right.joint) == ('left_wheel_joint', 'right_wheel_joint')
    assert (alto.wheel_diameter_m, alto.wheel_separation_m) == pytest.approx((0.2, 0.4))
    assert (alto.mass.mass_kg, *alto.mass.com_m[:2]) == pytest.approx((80.0, 0.05, 0.0))
    assert [contact.name for contact in alto.contacts] == ['front_caster', 'rear_caster']
    assert alto.laser.link == 'laser'
    assert sorted(alto.footprint) == [(-0.25, -0.3), (-0.25, 0.3), (0.25, -0.3), (0.25, 0.3)]
    assert alto.warnings == () and alto.notes == ()


def test_a_file_is_described_again_only_if_it_was_edited(tmp_path):
    source = RobotSource(tmp_path / 'robot.urdf')
    source.file.write_text(usual())
    first = describe(source)
    assert describe(source) is first
    source.file.write_text(usual().replace('name="made"', 'name="other"'))
    assert describe(source).tree.name == 'other'
    assert describe(source, RobotChoices(wheel_diameter=0.12)).wheel_diameter_m == 0.12


def test_all_other_joints_are_held_still_and_named_in_one_line():
    limits = '<limit lower="0" upper="1" effort="1" velocity="1"/>'
    lift = link_text('a') + joint_text('lift', 'a', '0 0 0.3', 'prismatic', inside=limits)
    pan = link_text('b') + joint_text('pan', 'b', '0 0 0.3', 'revolute', inside=limits)
    follower = link_text('c') + joint_text('follower', 'c', '0 0 0.3', 'continuous', inside='<mimic joint="pan"/>')
    (note,) = described(usual(lift, pan, follower)).notes
    assert note == 'joints held still at zero: lift (prismatic), pan (revolute), follower (continuous, mimic)'


def test_the_table_names_each_value_with_its_source():
    load = link_text('load', mass_kg=3.0) + joint_text('load_joint', 'load', '0.1 0 0.1')
    description = described(usual(load))
    assert found(description, 'base frame') == ('base_link', 'root link')
    assert found(description, 'mass [kg]') == ('5.2', '<inertial> of the links')
    assert description.mass.com_m[0] == pytest.approx((2.0 * 0.02 + 3.0 * 0.1) / 5.2)
    assert [row.quantity for row in description.found][:2] == ['name', 'base frame']


def test_a_frame_without_collision_shapes_is_measured_by_its_visual_ones():
    seen = base().replace('<collision>', '<visual>').replace('</collision>', '</visual>')
    description = described(robot(seen, pair()))
    assert 'no link but the wheels has a collision shape: visual shapes are taken' in description.warnings
    assert max(x_m for x_m, _ in description.footprint) == pytest.approx(0.15)


def test_a_root_with_the_name_of_another_frame_is_refused():
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


@pytest.mark.parametrize('name', NAMES)
def test_a_shipped_robot_is_as_published_and_complete(name, tmp_path):
    file = load_robot_file(name, ROOT, ROOT, {})
    robot = describe(file.source)
    params = override(load_robot_config(ROOT / 'config'), {**derived_settings(robot), **file.overrides})
    mass_kg, diameter_m, separation_m, ppr, modulus, rate_hz = PUBLISHED[name]
    assert robot.mass.mass_kg == pytest.approx(mass_kg)
    assert (robot.wheel_diameter_m, robot.wheel_separation_m) == pytest.approx((diameter_m, separation_m))
    assert (params.odometry.wheel_diameter, params.odometry.wheel_separation) == (diameter_m, separation_m)
    assert file.ppr == pytest.approx(ppr)
    assert (params.encoder.counter_modulus, params.encoder.rate) == (modulus, pytest.approx(rate_hz))
    across_mm = [1e3 * (max(side) - min(side)) for side in zip(*robot.footprint)]
    assert across_mm == pytest.approx(OUTSIDE.get(name, across_mm), abs=2)
    assert (robot.warnings, robot.notes) == ((), ()) and robot.laser is not None and robot.contacts
    assert not needs_other_files(expand(file.source))
    # The counter does not wrap within a report, at the highest speed, and odometry takes none for a restart.
    drive = params.simulator.drive
    rim_mps = drive.max_linear_speed + 0.5 * drive.max_angular_speed * params.odometry.wheel_separation
    wheel_radps = 2 * rim_mps / params.odometry.wheel_diameter
    assert wheel_radps < params.odometry.max_wheel_speed
    assert wheel_radps / 6.283 * ppr / params.encoder.rate < (modulus or float('inf')) / 4
    # Each [number] that is used is one of the list of sources at the top, and the other way round.
    for path in (ROOT / 'config' / 'robots' / f'{name}.yaml', ROOT / 'urdf' / f'{name}.urdf.xacro'):
        marks = re.findall(r'\[\d\]', path.read_text())
        assert name == 'alto' or min(map(marks.count, marks)) >= 2, path
    if shutil.which('check_urdf'):
        (tmp_path / 'robot.urdf').write_text(expand(file.source))
        assert subprocess.run(['check_urdf', tmp_path / 'robot.urdf'], capture_output=True).returncode == 0


BODY = shape(Box((0.4, 0.3, 0.1)))
BODY_INERTIA = homogeneous([BODY], 1.0).inertia_kgm2
WHEEL = shape(Cylinder(0.033, 0.018))


def mass_of(robot, folder='.'):
    """The mass of a robot, and the warnings."""
    seen = Findings()
    return robot_mass(primitive_tree(robot, finder(folder), Findings()), seen), seen.warnings


def one_link(inertia, mass_kg=1.0, **shapes):
    return tree([link('base', inertial(mass_kg, inertia, (0.1, 0.2, 0.3)), **shapes)])


@pytest.mark.parametrize('inertia', [BODY_INERTIA, 1e-9, np.diag([0.001, 0.001, 0.00205])])
def test_a_sound_inertia_a_small_one_and_that_of_a_rounded_plate_stay(inertia):
    mass, warnings = mass_of(one_link(inertia, collisions=[BODY]))
    assert warnings == []
    assert np.diag(mass.inertia_kgm2) == pytest.approx(np.diag(inertia * np.ones((3, 3))))


@pytest.mark.parametrize(
    ('inertia', 'mass_kg', 'part', 'fault'),
    [
        (0.0, 1.0, BODY, 'an inertia that is not positive, .*: base .principal moments '),
        (np.diag([0.01, 0.01, -0.01]), 1.0, BODY, 'an inertia that is not positive'),
        (np.diag([0.001, 0.001, 0.01]), 1.0, BODY, 'an inertia of no body'),
        (1.0, 0.02, WHEEL, 'larger than its shapes, .*: base .1 kg m.2 of 0.02 kg: .* of 7071 mm, .* within 408 mm'),
    ],
)
def test_an_inertia_that_no_body_has_is_named_and_replaced(inertia, mass_kg, part, fault):
    mass, (warning,) = mass_of(one_link(inertia, mass_kg, collisions=[part]))
    assert re.search(fault, warning)
    assert (mass.mass_kg, *mass.com_m) == pytest.approx((mass_kg, 0.1, 0.2, 0.3))
    assert mass.inertia_kgm2 == pytest.approx(homogeneous([part], mass_kg).inertia_kgm2)


def test_a_visual_shape_stands_in_for_a_collision_shape_and_water_for_both(tmp_path):
    write_binary_stl(tmp_path / 'a.stl', CUBE_CORNERS, CUBE_TRIANGLES)
    seen, _ = mass_of(one_link(0.0, visuals=[mesh_shape('package://p/a.stl', 0.1)]), tmp_path)
    assert seen.inertia_kgm2 == pytest.approx(homogeneous([shape(Box((0.2, 0.2, 0.2)))], 1.0).inertia_kgm2)
    unseen, _ = mass_of(one_link(0.0, visuals=[mesh_shape('package://p/b.stl', 0.1)]), tmp_path)
    assert unseen.inertia_kgm2 == pytest.approx(homogeneous((), 1.0).inertia_kgm2)


def test_a_link_is_measured_by_the_shapes_that_it_is_fixed_to():
    links = [link('base', inertial(1.0, BODY_INERTIA)), link('shell', collisions=[BODY])]
    assert mass_of(tree(links, [joint('base', 'shell')]))[1] == []
    links = [link('base', collisions=[BODY]), link('wheel', inertial(0.03, 0.0018), [shape(Sphere(0.033))])]
    at = pose((0, 0.1, 0))
    assert len(mass_of(tree(links, [joint('base', 'wheel', at, 'continuous')]))[1]) == 1
    assert mass_of(tree(links, [joint('base', 'wheel', at)]))[1] == []


def test_links_without_inertial_add_nothing():
    links = [link('footprint'), link('base', inertial(1.0, BODY_INERTIA), [BODY]), link('camera')]
    mass, _ = mass_of(tree(links, [joint('footprint', 'base', pose((0, 0, 1))), joint('base', 'camera')]))
    assert (mass.mass_kg, *mass.com_m) == (1, 0, 0, 1)


def test_a_robot_without_mass_is_one_line():
    with pytest.raises(ConfigError, match='^made.urdf: given 0 kg [^\n]*; allowed: <inertial> [^\n]*$'):
        mass_of(tree([link('base')]))
