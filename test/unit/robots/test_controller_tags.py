import yaml

from diff_encoder_sim.robots.controller_tags import controllers, controllers_in
from urdf_texts import described, found, plugin, tree_of, usual

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


def controllers_of(path):
    return controllers(tree_of(usual(plugin('libgazebo_ros2_control.so', parameters=path))))


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
    assert only_controller(ROS_2.replace('[left_wheel_joint]', '[a, b]')).kind == 'skid-steer'


def test_a_file_that_a_plugin_names_is_read_if_it_is_there(tmp_path):
    path = tmp_path / 'control.yaml'
    path.write_text(ROS_2)
    for name in (str(path), f'file://{path}', f' {path} '):
        assert [tags.source for tags in controllers_of(name)] == ['control.yaml']
    for content in ('not: [closed', '- a list', ''):
        path.write_text(content)
        assert controllers_of(path) == ()
    assert controllers_of('/nowhere.yaml') == ()


def test_a_controller_tells_the_drive(tmp_path):
    path = tmp_path / 'control.yaml'
    path.write_text(ROS_2)
    description = described(usual(plugin('libgazebo_ros2_control.so', parameters=path)))
    assert found(description, 'left wheel joint') == ('left_wheel_joint', 'control.yaml')
    assert description.drive_limits['max_linear_speed'] == 0.8
