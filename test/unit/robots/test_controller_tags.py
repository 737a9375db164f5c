import pytest
import yaml

from diff_encoder_sim.robots.driven_wheels import controllers, controllers_in
from diff_encoder_sim.robots.rolling_wheels import rolling_wheels
from urdf_texts import described, found, pair, plugin, tree_of, usual

ROS_1 = """
mobile_base_controller:
  type: diff_drive_controller/DiffDriveController
  left_wheel: left_wheel_joint
  right_wheel: right_wheel_joint
  wheel_separation: 0.3
  wheel_separation_multiplier: 1.1
  wheel_radius: 0.05
  linear: {x: {has_velocity_limits: true, max_velocity: 0.8, has_acceleration_limits: false, max_acceleration: 2.0}}
  angular: {z: {max_velocity: 1.5}}
"""
ROS_2 = """
diff_drive_controller:
  ros__parameters:
    left_wheel_names: [left_wheel_joint]
    right_wheel_names: [right_wheel_joint]
    wheel_separation: 0.3
    wheel_radius: 0.05
    linear.x.max_velocity: 0.8
    linear.x.has_velocity_limits: true
"""


def controllers_of(path, *parts):
    tree = tree_of(usual(plugin('libgazebo_ros2_control.so', parameters=path), *parts))
    return controllers(tree, rolling_wheels(tree))


def only_controller(text):
    (tags,) = controllers_in(yaml.safe_load(text), 'control.yaml')
    return tags


def test_a_controller_of_ros_1_tells_sizes_and_the_limits_that_hold():
    tags = only_controller(ROS_1)
    assert (tags.left_joints, tags.right_joints) == (('left_wheel_joint',), ('right_wheel_joint',))
    assert (round(tags.separation_m, 9), tags.diameter_m) == (0.33, 0.1)
    assert tags.limits == {'max_linear_speed': 0.8, 'max_angular_speed': 1.5}


def test_a_controller_of_ros_2_tells_the_same_in_dotted_keys():
    tags = only_controller(ROS_2)
    assert (tags.kind, tags.separation_m, tags.diameter_m) == ('differential', 0.3, 0.1)
    assert tags.limits == {'max_linear_speed': 0.8}


def test_a_file_that_a_plugin_names_is_read_if_it_is_there(tmp_path):
    path = tmp_path / 'control.yaml'
    path.write_text(ROS_2)
    for name in (str(path), f'file://{path}', f' {path} '):
        assert [tags.source for tags in controllers_of(name)] == ['control.yaml']
    for content in ('not: [closed', '- a list', ''):
        path.write_text(content)
        assert controllers_of(path) == ()
    assert controllers_of('/nowhere.yaml') == ()


def test_only_joints_that_carry_wheels_count(tmp_path):
    path = tmp_path / 'control.yaml'
    path.write_text(ROS_2.replace('[left_wheel_joint]', '[left_wheel_joint, a_joint, ball_caster_joint]'))
    (tags,) = controllers_of(path)
    assert (tags.kind, tags.left_joints) == ('differential', ('left_wheel_joint',))
    (tags,) = controllers_of(path, pair(x_m=0.2, names=('a', 'b')))
    assert (tags.kind, tags.left_joints) == ('skid-steer', ('left_wheel_joint', 'a_joint'))


def test_a_controller_tells_the_drive(tmp_path):
    path = tmp_path / 'control.yaml'
    path.write_text(ROS_2)
    description = described(usual(plugin('libgazebo_ros2_control.so', parameters=path)))
    assert found(description, 'left wheel joint') == ('left_wheel_joint', 'control.yaml')
    assert description.drive_limits['max_linear_speed'] == 0.8


@pytest.mark.parametrize(
    'key', ['wheel_separation', 'wheel_radius', 'wheel_separation_multiplier', 'linear.x.max_velocity']
)
@pytest.mark.parametrize(
    'value', ['1' * 300, '1' * 320, '9' * 5000, '1.0e+308', '.inf', '.nan', '1.0e-320', '-1', 'true']
)
def test_numbers_that_no_robot_has_are_ignored(tmp_path, key, value):
    path = tmp_path / 'control.yaml'
    lines = [line for line in ROS_2.splitlines() if not line.strip().startswith(f'{key}:')]
    path.write_text('\n'.join([*lines, f'    {key}: {value}']))
    for tags in controllers_of(path):
        assert tags.separation_m in (0.3, None) and tags.diameter_m in (0.1, None)
        assert tags.limits in ({'max_linear_speed': 0.8}, {})
    described(usual(plugin('libgazebo_ros2_control.so', parameters=path)))
