"""Where a wheel's mesh rolls."""

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.meshes import tread_of
from diff_encoder_sim.robots.simulated_robot import self_contained_urdf
from robot_parts import CUBE_CORNERS, finder, random_pose, write_binary_stl
from urdf_texts import ball, base, described, found, joint, link, pair, robot, usual, wheel

ORIGIN, Z = np.zeros(3), np.array([0.0, 0.0, 1.0])


def ring(radius_m, z_m, count=24):
    bearings_rad = 2 * np.pi * np.arange(count) / count
    return np.column_stack([radius_m * np.cos(bearings_rad), radius_m * np.sin(bearings_rad), np.full(count, z_m)])


def disc(*radii_and_heights_m):
    return np.vstack([ring(radius_m, z_m) for radius_m, z_m in radii_and_heights_m])


WHEEL_WITH_MOTOR = disc((0.05, -0.01), (0.05, 0.01), (0.02, 0.01), (0.02, 0.08))


def test_a_motor_behind_the_wheel_does_not_widen_its_tread():
    tread = tread_of(WHEEL_WITH_MOTOR, ORIGIN, Z)
    assert tread.geometry.radius_m == pytest.approx(0.05)
    assert tread.geometry.length_m == pytest.approx(0.02)
    assert tread.pose_in_link[:3, 3] == pytest.approx([0.0, 0.0, 0.0])


def test_the_axis_may_have_any_direction_and_place():
    placed = random_pose(np.random.default_rng(1))
    points_m = disc((0.05, 0.03), (0.05, 0.05)) @ placed[:3, :3].T + placed[:3, 3]
    tread = tread_of(points_m, placed[:3, 3], placed[:3, 2])
    assert tread.geometry.radius_m == pytest.approx(0.05, abs=1e-6)
    assert tread.pose_in_link[:3, 3] == pytest.approx(placed[:3, :3] @ [0, 0, 0.04] + placed[:3, 3])
    assert tread.pose_in_link[:3, 2] == pytest.approx(placed[:3, 2])
    assert np.linalg.det(tread.pose_in_link[:3, :3]) == pytest.approx(1.0)


def test_a_hexagon_rolls_and_a_box_does_not_nor_does_what_is_off_the_axis():
    assert tread_of(np.vstack([ring(0.05, 0.0, 6), ring(0.05, 0.02, 6)]), ORIGIN, Z) is not None
    assert tread_of(0.05 * CUBE_CORNERS, ORIGIN, Z) is None
    assert tread_of(disc((0.05, 0.0), (0.05, 0.02)) + [0.03, 0.0, 0.0], ORIGIN, Z) is None


@pytest.mark.parametrize('shape', ['collision', 'visual'])
def test_a_robot_whose_wheels_are_meshes_has_their_radius_and_the_treads_separation(tmp_path, shape):
    triangles = np.array([[index, index + 1, index + 2] for index in range(len(WHEEL_WITH_MOTOR) - 2)])
    write_binary_stl(tmp_path / 'wheel.stl', WHEEL_WITH_MOTOR, triangles)
    wheels = ''.join(
        link(f'{side}_wheel', '<mesh filename="package://any/wheel.stl"/>', f'rpy="{roll} 0 0"', 0.1, shape)
        + joint(f'{side}_wheel_joint', f'{side}_wheel', f'0 {y_m} 0.05', 'continuous')
        for side, y_m, roll in (('left', 0.15, 1.5707963267948966), ('right', -0.15, -1.5707963267948966))
    )
    description = described(robot(base(), wheels, ball('ball', 0.1)), find=finder(tmp_path))
    assert found(description, 'wheel diameter [m]') == ('0.1', f'{shape} cylinder')
    assert description.wheel_separation_m == pytest.approx(0.3)


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


def test_workers_get_a_robot_without_it():
    text = self_contained_urdf(usual(housing('case')), 'made.urdf', lambda uri: None)
    assert 'housing.stl' not in text
    assert described(text).footprint == described(usual(housing('case'))).footprint


def test_so_must_the_only_shape_of_a_robot():
    with pytest.raises(ConfigError, match="link 'case': collision mesh"):
        described(robot(base(body='').replace('<geometry></geometry>', ''), pair(), housing('case')))
