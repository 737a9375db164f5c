"""The drives that plugins and transmissions name, and robots of 60 kinds with 200 tags."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.drive_tags import commanded_joints, find_drive_tags
from diff_encoder_sim.robots.driven_wheels import drivable_joints, rolling_wheels
from plugin_tags import variant
from urdf_texts import described, pair, plugin, transmission, tree_of, usual

LEFT, RIGHT = 'left_wheel_joint', 'right_wheel_joint'


def drives(*parts):
    tree = tree_of(usual(*parts))
    wheels = rolling_wheels(tree)
    return find_drive_tags(tree, wheels, drivable_joints(tree, wheels))


@pytest.mark.parametrize('number', range(60))
def test_a_robot_is_accepted_by_its_wheels_and_not_by_words_in_tags(number):
    text, driven = variant(number)
    if driven:
        description = described(text)
        assert (description.left.joint, description.right.joint) == driven
        return
    with pytest.raises(ConfigError, match='given a robot|given an omnidirectional'):
        described(text)


@pytest.mark.parametrize(
    ('filename', 'names'),
    [
        ('libgazebo_ros_diff_drive.so', 'leftJoint rightJoint wheelSeparation wheelDiameter wheelTorque'),
        ('libgazebo_ros_diff_drive.so', 'left_joint right_joint wheel_separation wheel_diameter max_wheel_torque'),
        ('libmaker.so', 'left_wheel_joint_name right_wheel_joint_name wheel_separation wheel_diameter torque'),
    ],
)
def test_a_drive_plugin_gives_joints_and_sizes_whatever_it_calls_them(filename, names):
    (tags,) = drives(plugin(filename, **dict(zip(names.split(), (f' {LEFT} ', RIGHT, 0.3, 0.1, 5)))))
    assert (tags.source, tags.kind, tags.left_joints, tags.right_joints) == (
        filename, 'differential', (LEFT,), (RIGHT,),
    )  # fmt: skip
    assert (tags.separation_m, tags.diameter_m, tags.limits) == (0.3, 0.1, {'wheel_torque': 5.0})


def test_gazebo_sim_gives_the_radius_and_limits_of_the_body():
    numbers = {'wheel_radius': 0.05, 'max_linear_velocity': 0.5, 'max_angular_acceleration': 2}
    (tags,) = drives(plugin('gz-sim-diff-drive-system', left_joint=LEFT, right_joint=RIGHT, **numbers))
    assert (tags.diameter_m, tags.limits) == (0.1, {'max_linear_speed': 0.5, 'max_angular_acceleration': 2.0})


@pytest.mark.parametrize('number', ['1e300', 'nan', '-1', '0', '1e-300', ''])
def test_a_number_that_no_robot_has_is_ignored(number):
    tags = dict.fromkeys(('wheelSeparation', 'wheelDiameter', 'wheelTorque', 'wheelAcceleration'), number)
    (found_tags,) = drives(plugin('libx_diff_drive.so', leftJoint=LEFT, rightJoint=RIGHT, **tags))
    assert (found_tags.separation_m, found_tags.diameter_m, found_tags.limits) == (None, None, {})


def test_several_wheels_on_a_side_are_a_skid_steer_drive():
    rear = pair(x_m=-0.2, names=('rear_left', 'rear_right'))
    lefts, rights = (LEFT, 'rear_left_joint'), (RIGHT, 'rear_right_joint')
    several = ''.join(f'<{side}_joint>{name}</{side}_joint>' for side, names in (('left', lefts), ('right', rights))
                      for name in names)  # fmt: skip
    corners = dict(zip(('leftFrontJoint', 'leftRearJoint', 'rightFrontJoint', 'rightRearJoint'), (*lefts, *rights)))
    for part in (
        f'<gazebo><plugin filename="libgazebo_ros_diff_drive.so">{several}</plugin></gazebo>',
        plugin('libmaker.so', **corners),
    ):
        (tags,) = drives(rear, part)
        assert (tags.kind, tags.left_joints, tags.right_joints) == ('skid-steer', lefts, rights)


def test_other_plugins_drive_nothing():
    joints = plugin('libgazebo_ros_joint_state_publisher.so', jointName=f'{LEFT}, {RIGHT}')
    assert drives(joints, plugin('libgazebo_ros_planar_move.so', robotBaseFrame='base_link')) == ()


def test_transmissions_and_ros2_control_show_which_joints_are_commanded_and_how():
    text = usual(
        transmission(LEFT),
        f'<ros2_control name="r" type="system"><joint name="{RIGHT}"><command_interface name="velocity"/>'
        '<state_interface name="position"/></joint><joint name="ball_caster_joint"><command_interface name="position"/>'
        '</joint><joint name="missing"><command_interface name="velocity"/></joint></ros2_control>',
    )
    assert commanded_joints(tree_of(text)) == (LEFT, RIGHT)
    assert commanded_joints(tree_of(text), position=True) == ('ball_caster_joint',)
