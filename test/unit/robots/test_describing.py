"""Robots described as a whole, the shipped ones, masses and inertias, sizes and limits of the drive, its grip."""

import math
import re

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots import describing
from diff_encoder_sim.robots.describing import G_MPS2, MARGIN, describe
from diff_encoder_sim.robots.description import (
    DrivenWheel,
    DriveTrain,
    Findings,
    GroundContact,
    RobotChoices,
    RobotSource,
)
from diff_encoder_sim.robots.meshes import primitive_tree
from diff_encoder_sim.robots.robot_file import derived_settings, load_robot_file
from diff_encoder_sim.robots.solids import Box, MassProperties, homogeneous
from diff_encoder_sim.robots.xacro_expansion import expansion
from diff_encoder_sim.trials.robot_params import load_robot_config, override
from diff_encoder_sim.trials.trial_files import needs_other_files
from places import ROOT
from robot_parts import CUBE_CORNERS, CUBE_TRIANGLES, finder, shape, write_mesh
from urdf_texts import (
    ball,
    base,
    box,
    cylinder,
    described,
    found,
    inertial,
    joint,
    link,
    pair,
    plugin,
    robot,
    sphere,
    tree_of,
    usual,
    wheel,
)


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
    joints = (('lift', 'prismatic', limits), ('pan', 'revolute', limits), ('wag', 'continuous', '<mimic joint="pan"/>'))
    parts = [
        link(f'{name}_link') + joint(name, f'{name}_link', '0 0 0.3', kind, inside=inside)
        for name, kind, inside in joints
    ]
    (note,) = described(usual(*parts)).notes
    assert note == 'joints held still at zero: lift (prismatic), pan (revolute), wag (continuous, mimic)'


def test_the_table_names_each_value_with_its_source():
    load = link('load', mass_kg=3.0) + joint('load_joint', 'load', '0.1 0 0.1')
    description = described(usual(load))
    assert found(description, 'base frame') == ('base_link', 'root link')
    assert found(description, 'mass [kg]') == ('5.2', '<inertial> of the links')
    assert description.mass.com_m[0] == pytest.approx((2.0 * 0.02 + 3.0 * 0.1) / 5.2)


def test_a_frame_without_collision_shapes_is_measured_by_its_visual_ones():
    seen = base().replace('<collision>', '<visual>').replace('</collision>', '</visual>')
    description = described(robot(seen, pair()))
    assert 'no link but the wheels has a collision shape: visual shapes are taken' in description.warnings
    assert max(x_m for x_m, _ in description.footprint) == pytest.approx(0.15)


def test_a_root_with_the_name_of_another_frame_is_refused():
    with pytest.raises(ConfigError, match="root link 'odom' is the name of a frame .*; allowed: the robot's base"):
        described(usual().replace('"base_link"', '"odom"'))


NAMES = sorted(path.stem for path in (ROOT / 'config' / 'robots').glob('*.yaml'))
# kg, wheel diameter and separation [m], counts per wheel revolution, states of the counter, reports per second, length
# and width with the wheels [mm]
PUBLISHED = {
    'alto': (80, 0.2, 0.4, 90, 0, 20, (500, 600)),
    'burger': (1.0, 0.066, 0.160, 4096, 2**32, 30, (138, 178)),
    'waffle_pi': (1.8, 0.066, 0.287, 4096, 2**32, 30, (281, 306)),
    'kobuki': (2.35 + 0.17, 0.070, 0.230, 52 * 6545 / 132, 2**16, 50, (351.5, 351.5)),
    'create2': (3.6 + 0.17, 0.072, 0.235, 508.8, 2**16, 1 / 0.015, (348.5, 348.5)),
    'hoverboard': (20.59, 0.165, 0.45, 90, 9000, 100, None),
    'gearmotor_kit': (1.26, 0.065, 0.17, 48 * 34.014, 2**32, 30, None),
}


@pytest.mark.parametrize('name', NAMES)
def test_a_shipped_robot_is_as_published_and_complete(name):
    file = load_robot_file(name, ROOT, ROOT, {})
    robot = describe(file.source)
    params = override(load_robot_config(ROOT / 'config'), {**derived_settings(robot), **file.overrides})
    mass_kg, diameter_m, separation_m, ppr, modulus, rate_hz, size_mm = PUBLISHED[name]
    assert robot.mass.mass_kg == pytest.approx(mass_kg)
    assert (robot.wheel_diameter_m, robot.wheel_separation_m) == pytest.approx((diameter_m, separation_m))
    assert (params.odometry.wheel_diameter.plain, params.odometry.wheel_separation) == (diameter_m, separation_m)
    assert file.ppr == pytest.approx(ppr)
    assert (params.encoder.counter_modulus, params.encoder.rate) == (modulus, pytest.approx(rate_hz))
    across_mm = [1e3 * (max(side) - min(side)) for side in zip(*robot.footprint)]
    assert across_mm == pytest.approx(size_mm or across_mm, abs=2)
    assert (robot.warnings, robot.notes) == ((), ()) and robot.laser is not None and robot.contacts
    assert not needs_other_files(expansion(file.source).urdf)
    # The counter does not wrap within a report, at the highest speed, and odometry takes none for a restart.
    drive = params.simulator.drive
    rim_mps = drive.max_linear_speed + 0.5 * drive.max_angular_speed * params.odometry.wheel_separation
    wheel_radps = rim_mps / params.odometry.wheel_diameter.radii_m[0]
    assert wheel_radps < params.odometry.max_wheel_speed
    assert wheel_radps / 6.283 * ppr / params.encoder.rate < (modulus or float('inf')) / 4


BODY, WHEEL = box(0.4, 0.3, 0.1), cylinder(0.033, 0.018)
BODY_MOMENTS_KGM2 = np.diag(homogeneous([shape(Box((0.4, 0.3, 0.1)))], 1.0).inertia_kgm2)
FRAMES = link('footprint') + joint('up', 'base', '0 0 1', parent='footprint') + link('camera')


def mass_of(*parts, folder='.'):
    seen = Findings()
    tree = primitive_tree(tree_of(robot(*parts)), finder(folder), Findings())
    return describing.robot_mass(tree, seen), seen.warnings


@pytest.mark.parametrize(
    ('moments_kgm2', 'mass_kg', 'geometry', 'fault'),
    [
        (BODY_MOMENTS_KGM2, 1.0, BODY, None),
        (1e-9, 1.0, BODY, None),
        ([0.001, 0.001, 0.00205], 1.0, BODY, None),  # of a rounded plate
        (0.0, 1.0, BODY, 'an inertia that is not positive, .*: base .principal moments '),
        ([0.01, 0.01, -0.01], 1.0, BODY, 'an inertia that is not positive'),
        ([0.001, 0.001, 0.01], 1.0, BODY, 'an inertia of no body'),
        (1.0, 0.02, WHEEL, 'larger than its shapes, .*: base .1 kg m.2 of 0.02 kg: .* of 7071 mm, .* within 408 mm'),
    ],
)
def test_an_inertia_that_no_body_has_is_named_and_replaced(moments_kgm2, mass_kg, geometry, fault):
    part = link('base', geometry, inside=inertial(mass_kg, moments_kgm2, '0.1 0.2 0.3'))
    mass, warnings = mass_of(part)
    assert len(warnings) == (fault is not None) and all(re.search(fault, warning) for warning in warnings)
    assert (mass.mass_kg, *mass.com_m) == pytest.approx((mass_kg, 0.1, 0.2, 0.3))
    by_shape = homogeneous(tree_of(robot(part)).links['base'].collisions, mass_kg).inertia_kgm2
    assert mass.inertia_kgm2 == pytest.approx(by_shape if fault else moments_kgm2 * np.eye(3))


def test_a_visual_shape_stands_in_for_a_collision_shape_and_water_for_both(tmp_path):
    write_mesh(tmp_path / 'a.stl', CUBE_CORNERS, CUBE_TRIANGLES)
    for name, shapes in (('a', [shape(Box((0.2, 0.2, 0.2)))]), ('b', [])):
        mesh = f'<mesh filename="package://p/{name}.stl" scale="0.1 0.1 0.1"/>'
        mass, _ = mass_of(link('base', mesh, shape='visual', inside=inertial(1.0, 0.0)), folder=tmp_path)
        assert mass.inertia_kgm2 == pytest.approx(homogeneous(shapes, 1.0).inertia_kgm2)


@pytest.mark.parametrize(('kind', 'warnings'), [('continuous', 1), ('fixed', 0)])
def test_a_link_is_measured_by_the_shapes_that_it_is_fixed_to(kind, warnings):
    wheel_link = link('wheel', sphere(0.033), inside=inertial(0.03, 0.0018))
    assert len(mass_of(link('base', BODY), wheel_link, joint('j', 'wheel', '0 0.1 0', kind, 'base'))[1]) == warnings


def test_links_without_inertial_add_nothing_and_a_robot_without_mass_is_one_line():
    body = link('base', BODY, inside=inertial(1.0, BODY_MOMENTS_KGM2))
    mass, _ = mass_of(FRAMES, body, joint('j', 'camera', '0 0 0', parent='base'))
    assert (mass.mass_kg, *mass.com_m) == (1, 0, 0, 1)
    with pytest.raises(ConfigError, match='^made.urdf: given 0 kg [^\n]*; allowed: <inertial> [^\n]*$'):
        mass_of(link('base'))


CHOSEN = {'left_joint': 'left_wheel_joint', 'right_joint': 'right_wheel_joint'}


def drive(**sizes):
    return plugin('libdiff_drive.so', leftJoint='left_wheel_joint', rightJoint='right_wheel_joint', **sizes)


OTHER_WHEELS = plugin('libdiff.so', leftJoint='a_joint', rightJoint='b_joint', wheelDiameter=0.11)
GIVEN = {'wheel_diameter': 0.11, 'wheel_separation': 0.31}
SHAPE, MIDDLES = ('0.1', 'collision cylinder'), ('0.3', 'middles of the wheels')


@pytest.mark.parametrize(
    ('parts', 'choices', 'diameter', 'separation', 'warning'),
    [
        ((), {}, SHAPE, MIDDLES, ''),
        ((drive(wheelDiameter=0.098),), {}, ('0.098', 'libdiff_drive.so'), MIDDLES, '0.098 m is used'),
        ((drive(wheelDiameter=0.05),), {}, SHAPE, MIDDLES, '0.1 m is used'),  # a radius
        ((drive(wheelSeparation=0.33),), {}, SHAPE, MIDDLES, 'which is used'),
        ((drive(wheelDiameter=0.1),), GIVEN, ('0.11', 'given'), ('0.31', 'given'), 'would tip'),
        ((pair(x_m=-0.2, names=('a', 'b')), OTHER_WHEELS), CHOSEN, SHAPE, MIDDLES, 'slide without friction'),
    ],
)
def test_sizes_their_sources_and_disagreements(parts, choices, diameter, separation, warning):
    description = described(usual(*parts), **choices)
    assert diameter == found(description, 'wheel diameter [m]')
    assert separation == found(description, 'wheel separation [m]')
    apart_m = description.left.centre_m[1] - description.right.centre_m[1]
    assert description.wheel_separation_m == pytest.approx(apart_m)
    assert warning in ' '.join(description.warnings[:-1]) and bool(description.warnings[:-1]) == bool(warning)


TWO_SIZES = wheel('left', y_m=0.15, radius_m=0.0352, z_m=0.0352) + wheel('right', y_m=-0.15, radius_m=0.035, z_m=0.0352)
ASIDE = wheel('left_wheel', y_m=0.16) + wheel('right_wheel', y_m=-0.14)


@pytest.mark.parametrize(
    ('text', 'diameter_m', 'expected'),
    [
        (robot(base(), TWO_SIZES, ball('ball', 0.1)), 0.0702, 'diameters 0.0704 m (left) and 0.07 m (right)'),
        (robot(base(body=box(300, 200, 100)), pair(50.0, 300.0)), 100.0, 'wheels of 100 m: a URDF is'),
        (robot(base(), ASIDE, ball('ball', 0.1)), 0.1, "the wheels' middle is 10.0 mm to the left of the base frame's"),
    ],
)
def test_wheels_of_two_sizes_in_millimetres_or_aside_are_warnings(text, diameter_m, expected):
    description = described(text)
    assert description.wheel_diameter_m == pytest.approx(diameter_m)
    assert any(expected in warning for warning in description.warnings)


def both(part_of):
    """A robot whose sides are made by a function of their name and place."""
    return robot(base(), part_of('left', 0.1), part_of('right', -0.1), ball('caster', 0.1))


def test_the_separation_is_that_of_the_tyres_and_not_of_the_joints():
    origin = 'xyz="0 {} 0" rpy="1.5707963267948966 0 0"'
    text = both(lambda side, y_m: wheel(side, y_m=y_m, origin=origin.format(0.2 * y_m)))
    assert described(text).wheel_separation_m == pytest.approx(0.24)


def test_a_tyre_may_be_a_separate_link_with_a_visual_shape():
    hub = '<link name="{0}_hub"/>' + joint('{0}_joint', '{0}_hub', '0 {1} 0.05', 'continuous')
    tyre = link('{0}_tyre', sphere(0.05), shape='visual') + joint('{0}_tyre', '{0}_tyre', '0 0 0', parent='{0}_hub')
    assert found(described(both((hub + tyre).format)), 'wheel diameter [m]') == ('0.1', 'visual sphere')


def test_wheels_without_a_round_shape_need_a_diameter():
    turning = joint('{0}_wheel_joint', '{0}_wheel', '0 {1} 0.05', 'continuous')
    text = both((link('{0}_wheel', box(0.1, 0.02, 0.1)) + turning).format)
    assert described(text.replace('</robot>', f'{drive(wheelDiameter=0.1)}</robot>')).wheel_diameter_m == 0.1
    assert described(text, wheel_diameter=0.1, **CHOSEN).wheel_diameter_m == 0.1
    with pytest.raises(ConfigError, match="wheels 'left_wheel' and 'right_wheel' without a round shape; allowed: "):
        described(text, **CHOSEN)


WEIGHT_N = (2.0 + 0.2) * 9.81
MOST_NM = WEIGHT_N * 0.05  # that the floor takes
FAST, SLOW = {'effort': 0.5, 'velocity': 10.0}, {'effort': 0.02, 'velocity': 10.0}


def limits_of(*parts, effort=None, velocity=0, **given):
    limits = '' if effort is None else f'<limit effort="{effort}" velocity="{velocity}"/>'
    return described(robot(base(**given), pair(inside=limits), ball('ball', 0.1), *parts)).drive_limits


@pytest.mark.parametrize(
    ('given', 'plugin_has', 'expected'),
    [
        ({}, {}, {'wheel_torque': MOST_NM}),
        ({}, {'wheelTorque': 0.4}, {'wheel_torque': 0.4}),
        ({}, {'wheelTorque': 20}, {'wheel_torque': MOST_NM}),
        (FAST, {'wheelTorque': 0.3}, {'wheel_torque': 0.3}),
        ({}, {'wheelAcceleration': 1.8}, {'max_linear_acceleration': 1.8, 'max_angular_acceleration': 1.8 / 0.15}),
        (FAST, {}, {'wheel_torque': 0.5, 'max_linear_speed': 0.5, 'max_angular_speed': 0.5 / 0.15}),
        # Accelerations give way to low torque, unless given.
        (SLOW, {}, {'max_linear_acceleration': 0.5 * 2 * 0.02 / 0.05 / 2.2}),
        (SLOW, {'wheelAcceleration': 1.0}, {'max_linear_acceleration': 1.0}),
    ],
)
def test_limits_are_those_of_plugin_and_joints_and_no_more_than_the_floor_takes(given, plugin_has, expected):
    limits = limits_of(*([drive(**plugin_has)] if plugin_has else []), **given)
    assert {key: limits[key] for key in expected} == pytest.approx(expected)


@pytest.mark.parametrize(('velocity', 'warned'), [(0, False), (1000, False), (0.1, True)])
def test_placeholders_are_no_limits(velocity, warned):
    text = robot(base(), pair(inside=f'<limit effort="0" velocity="{velocity}"/>'), ball('ball', 0.1))
    assert list(described(text).drive_limits) == ['wheel_torque']
    assert any('too slow to drive' in warning for warning in described(text).warnings) == warned


def test_accelerations_give_way_to_a_large_inertia_and_little_grip():
    assert limits_of(com_x_m=0.08)['max_linear_acceleration'] < 1.5
    long = base(body=box(1.2, 0.2, 0.1)).replace('iyy="0.01" izz="0.01"', 'iyy="0.3" izz="0.3"')
    assert list(described(robot(long, pair(), ball('ball', 0.1))).drive_limits)[1:] == ['max_angular_acceleration']
    fast = limits_of(drive(wheelAcceleration=60))
    assert 0.5 < fast['max_linear_acceleration'] < MARGIN * G_MPS2
    assert fast['max_angular_acceleration'] == pytest.approx(2 * fast['max_linear_acceleration'] / 0.3)


LEFT, RIGHT = (DrivenWheel('', '', (0.1, y_m, 0.0), (0.0, 1.0, 0.0), 0.05, '', None) for y_m in (0.25, -0.25))
TRAIN = DriveTrain(LEFT, RIGHT, (0.1, 0.1), 0.5)  # axle at x = 0.1, floor at z = -0.05


def grip(com_m, *contacts_x_m, inertia_kgm2=1.0):
    mass = MassProperties(2.0, np.array(com_m), inertia_kgm2 * np.eye(3))
    return describing.grip_accelerations(mass, [GroundContact('any', (x_m, 0.0, -0.05)) for x_m in contacts_x_m], TRAIN)


@pytest.mark.parametrize('side', [1, -1])
@pytest.mark.parametrize(('d_m', 'c_m', 'h_m'), [(0.05, 0.2, 0.1), (0.0, 0.2, 0.0), (0.1, math.inf, 0.15)])
def test_a_caster_takes_weight_and_takes_more_the_higher_the_centre_of_mass(side, d_m, c_m, h_m):
    """At the limit, the wheels' load m (g (1 - d/c) - a h/c) is the force m a that they pass on."""
    casters_x_m = [0.1 + side * c_m, 0.1 - side * 0.01] if math.isfinite(c_m) else []
    a_mps2 = grip((0.1 + side * d_m, 0.0, h_m - 0.05), *casters_x_m)[0] / MARGIN
    assert G_MPS2 * (1 - d_m / c_m) - a_mps2 * h_m / c_m == pytest.approx(a_mps2)


@pytest.mark.parametrize('com_y_m', [0.0, 0.1])
def test_turning_in_place_takes_half_of_the_grip_at_both_wheels(com_y_m):
    """At the limit, two forces m g (1 - d/c) / 2 at L/2 from the axle's middle turn I + m d^2."""
    turn_radps2 = grip((0.15, com_y_m, 0.05), 0.3, inertia_kgm2=0.4)[1]
    inertia_kgm2 = 0.4 + 2.0 * (0.05**2 + com_y_m**2)
    assert turn_radps2 / MARGIN * inertia_kgm2 == pytest.approx(2.0 * G_MPS2 * (1 - 0.05 / 0.2) * 0.25)


def test_torque_moves_the_body_by_two_forces_at_the_rims():
    mass = MassProperties(2.0, np.array([0.1, 0.0, 0.05]), 0.4 * np.eye(3))
    linear_mps2, angular_radps2 = describing.accelerations(MARGIN * 2 * 0.3 / 0.05, mass, TRAIN)
    assert linear_mps2 / MARGIN == pytest.approx(2 * (0.3 / 0.05) / 2.0)
    assert angular_radps2 / MARGIN == pytest.approx(2 * (0.3 / 0.05) * 0.25 / 0.4)
