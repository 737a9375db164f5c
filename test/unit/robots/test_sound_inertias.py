import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.describing import link_masses
from diff_encoder_sim.robots.description import Box, Cylinder, Sphere
from diff_encoder_sim.robots.solids import homogeneous
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

WHEEL_WARNING = (
    'an inertia of a body larger than its shapes, replaced by that of a homogeneous solid: '
    'base (1 kg m^2 of 0.02 kg: a radius of gyration of 7071 mm, shapes within 408 mm)'
)
BODY = shape(Box((0.4, 0.3, 0.1)))
BODY_INERTIA = homogeneous([BODY], 1.0).inertia_kgm2


def masses_of(robot, folder='.'):
    return link_masses(robot, {name: part.collisions for name, part in robot.links.items()}, finder(folder))


def one_link(inertia, mass_kg=1.0, **shapes):
    return tree([link('base', inertial(mass_kg, inertia, (0.1, 0.2, 0.3)), **shapes)])


def test_a_sound_inertia_stays():
    found = masses_of(one_link(BODY_INERTIA, collisions=[BODY]))
    assert found.warnings == ()
    assert found.total.inertia_kgm2 == pytest.approx(BODY_INERTIA)


def test_1_kgm2_of_20_g_is_named_and_replaced_and_its_mass_and_centre_stay():
    wheel = shape(Cylinder(0.033, 0.018))
    found = masses_of(one_link(1.0, 0.02, collisions=[wheel]))
    assert found.warnings == (WHEEL_WARNING,)
    assert (found.total.mass_kg, *found.total.com_m) == pytest.approx((0.02, 0.1, 0.2, 0.3))
    assert found.total.inertia_kgm2 == pytest.approx(homogeneous([wheel], 0.02).inertia_kgm2)


@pytest.mark.parametrize(
    ('inertia', 'fault'),
    [
        (0.0, 'that is not positive'),
        (np.diag([0.01, 0.01, -0.01]), 'that is not positive'),
        (np.diag([0.001, 0.001, 0.01]), 'of no body'),
        (np.diag([0.0, 0.01, 0.01]), 'that is not positive'),
    ],
)
def test_an_inertia_that_no_body_has_is_named_and_replaced(inertia, fault):
    found = masses_of(one_link(inertia, collisions=[BODY]))
    assert len(found.warnings) == 1
    assert found.warnings[0].startswith(f'an inertia {fault}')
    assert ': base (principal moments ' in found.warnings[0]
    assert found.total.inertia_kgm2 == pytest.approx(BODY_INERTIA)


@pytest.mark.parametrize('inertia', [1e-9, np.diag([0.001, 0.001, 0.00205])])
def test_a_small_inertia_and_a_rounded_plate_are_no_fault(inertia):
    assert masses_of(one_link(inertia, collisions=[BODY])).warnings == ()


def test_a_visual_shape_stands_in_for_a_collision_shape_and_water_for_both(tmp_path):
    write_binary_stl(tmp_path / 'a.stl', CUBE_CORNERS, CUBE_TRIANGLES)
    seen = masses_of(one_link(0.0, visuals=[mesh_shape('package://p/a.stl', 0.1)]), tmp_path)
    assert seen.total.inertia_kgm2 == pytest.approx(homogeneous([shape(Box((0.2, 0.2, 0.2)))], 1.0).inertia_kgm2)
    unseen = masses_of(one_link(0.0, visuals=[mesh_shape('package://p/b.stl', 0.1)]), tmp_path)
    assert unseen.total.inertia_kgm2 == pytest.approx(homogeneous((), 1.0).inertia_kgm2)


def test_a_link_without_shapes_is_measured_by_what_it_is_fixed_to():
    """A body whose mass is in one link and whose shape is in another, fixed to it."""
    links = [link('base', inertial(1.0, BODY_INERTIA)), link('shell', collisions=[BODY])]
    assert masses_of(tree(links, [joint('base', 'shell')])).warnings == ()


def test_a_wheel_is_not_measured_by_the_body():
    links = [link('base', collisions=[BODY]), link('wheel', inertial(0.03, 0.0018), [shape(Sphere(0.033))])]
    at = pose((0, 0.1, 0))
    assert len(masses_of(tree(links, [joint('base', 'wheel', at, 'continuous')])).warnings) == 1
    assert masses_of(tree(links, [joint('base', 'wheel', at)])).warnings == ()


def test_links_without_inertial_or_mass_add_nothing():
    links = [link('footprint'), link('base', inertial(1.0, BODY_INERTIA), [BODY]), link('camera', inertial(0.0, 1.0))]
    found = masses_of(tree(links, [joint('footprint', 'base', pose((0, 0, 1))), joint('base', 'camera')]))
    assert list(found.by_link) == ['base']
    assert (found.total.mass_kg, *found.total.com_m) == (1, 0, 0, 1)


@pytest.mark.parametrize('robot', [tree([link('base')]), tree([link('base', inertial(0.0, 0.0))])])
def test_a_robot_without_mass_is_one_line(robot):
    with pytest.raises(ConfigError, match='^made.urdf: given no link with a mass; allowed: <inertial> [^\n]*$'):
        masses_of(robot)
