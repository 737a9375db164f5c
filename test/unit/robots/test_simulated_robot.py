"""Robots as the simulator loads them."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.robots.description import RobotChoices, RobotSource
from diff_encoder_sim.robots.physics_urdf import FLOOR_ONLY_LINKS, joined_links
from diff_encoder_sim.robots.simulated_robot import NO_ERRORS, GeometryErrors, load_simulated_robot
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expand
from generated_robots import LEFT, RIGHT, Recipe, urdf_of
from places import ROOT

ALTO = RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro')


def load(source=ALTO, errors=NO_ERRORS):
    return load_simulated_robot(source, RobotChoices(), errors)


@pytest.fixture
def generated(tmp_path):
    def source_of(**recipe):
        path = tmp_path / 'robot.urdf'
        path.write_text(urdf_of(Recipe(**recipe), tmp_path))
        return RobotSource(path)

    return source_of


def test_alto_is_table_1_of_the_paper():
    alto = load()
    assert alto.description.tree.name == 'alto'
    assert alto.wheels == pytest.approx((0.1, 0.1, 0.4))
    assert alto.description.mass.mass_kg == pytest.approx(80.0)


def test_the_odometry_has_the_geometry_of_alto():
    config, description = load_yaml(ROOT / 'config' / 'config.yaml'), load().description
    assert config['wheel_diameter'] == description.wheel_diameter_m
    assert config['wheel_separation'] == description.wheel_separation_m
    assert config['axle_x'] == description.axle_x_m


def test_a_sound_file_is_simulated_as_it_is():
    alto = load()
    assert (alto.urdf, alto.floor_only_links) == (joined_links(parse_urdf(expand(ALTO), '')), ())


def test_errors_are_arguments_of_a_file_that_has_them():
    alto = load(errors=GeometryErrors(0.01, -0.02, 0.05))
    assert alto.wheels == pytest.approx((0.101, 0.098, 0.42))
    assert alto.floor_only_links == ()
    assert alto.description.wheel_diameter_m == 0.2  # nominal


def test_arguments_that_have_another_effect_are_not_taken_for_errors(tmp_path):
    path = tmp_path / 'robot.urdf.xacro'
    path.write_text(
        ALTO.file.read_text().replace('* (1 + $(arg wheel_separation_error))', '+ $(arg wheel_separation_error)')
    )
    robot = load(RobotSource(path), GeometryErrors(separation=0.05))
    assert robot.wheels == pytest.approx((0.1, 0.1, 0.42))
    assert robot.floor_only_links == FLOOR_ONLY_LINKS


def test_errors_of_any_other_robot_are_applied_to_its_wheels(generated):
    robot = load(generated(), GeometryErrors(0.01, -0.02, 0.05))
    assert robot.wheels == pytest.approx((0.033 * 1.01, 0.033 * 0.98, 0.16 * 1.05))
    assert robot.joints == (LEFT, RIGHT)
    assert robot.floor_only_links == FLOOR_ONLY_LINKS


def test_a_joint_whose_axis_points_to_the_right_turns_backward_when_the_robot_drives_forward(generated):
    assert load(generated(has_mirrored_axes=True)).forward_signs == (1.0, -1.0)
    assert load(generated()).forward_signs == (1.0, 1.0)


def test_a_file_that_was_edited_is_read_again(generated):
    for radius_m in (0.05, 0.04, 0.05):
        assert load(generated(radius_m=radius_m)).wheels.left_radius_m == pytest.approx(radius_m)


def test_a_missing_joint_is_refused_with_the_file(generated):
    source = generated()
    with pytest.raises(ConfigError, match="robot.urdf: .*'wheel_left'.*missing") as caught:
        load_simulated_robot(source, RobotChoices('wheel_left', RIGHT))
    assert '\n' not in str(caught.value)
