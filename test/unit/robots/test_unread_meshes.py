"""A mesh that is missing or broken stops a robot only if the part decides how it drives."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.simulated_robot import self_contained_urdf
from robot_parts import finder
from urdf_texts import base, described, joint, link, pair, robot, usual, wheel

MISSING = '<mesh filename="package://sensors/housing.stl"/>'


def housing(name, parent='base_link', mass_kg=0.1, mesh=MISSING):
    return link(name, mesh, mass_kg=mass_kg) + joint(f'{name}_joint', name, '0 0 0.3', parent=parent)


@pytest.mark.parametrize('name', ["lidar's housing", 'camera_support'])
def test_a_sensors_housing_is_left_out_with_a_warning(name):
    described_robot = described(usual(housing(name)))
    (warning,) = [text for text in described_robot.warnings if 'package://sensors/housing.stl' in text]
    assert name in warning and 'missing' in warning
    assert described_robot.footprint == described(usual()).footprint


def test_so_is_a_broken_one_and_other_shapes_of_its_link_stay(tmp_path):
    (tmp_path / 'housing.stl').write_text('solid')
    case = housing('case').replace(
        '</link>', '<collision><geometry><sphere radius="0.6"/></geometry></collision></link>'
    )
    described_robot = described(usual(case), find=finder(tmp_path))
    assert [text for text in described_robot.warnings if 'given no valid mesh' in text or 'triangles' in text]
    assert max(x_m for x_m, _ in described_robot.footprint) > 0.55


@pytest.mark.parametrize(
    'parts',
    [
        (pair(), housing('chassis', mass_kg=5.0)),
        (pair(), housing('front_caster')),
        (wheel('left', y_m=0.1), wheel('right', y_m=-0.1), housing('tyre', parent='left')),
        (pair(parent='deck'), housing('deck')),
    ],
)
def test_a_mesh_of_the_body_a_caster_or_a_wheel_must_be_there(parts):
    with pytest.raises(ConfigError, match=r"made.urdf: link '\w+': collision mesh 'package://sensors/housing.stl': "):
        described(robot(base(), *parts))


def test_so_must_the_only_shape_of_a_robot():
    with pytest.raises(ConfigError, match="link 'case': collision mesh"):
        described(robot(base(body='').replace('<geometry></geometry>', ''), pair(), housing('case')))


def test_workers_get_a_robot_without_it():
    text = self_contained_urdf(usual(housing('case')), 'made.urdf', lambda uri: None)
    assert 'housing.stl' not in text
    assert described(text).footprint == described(usual(housing('case'))).footprint
