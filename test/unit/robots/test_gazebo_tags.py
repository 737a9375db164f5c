import pytest

from diff_encoder_sim.robots.driven_wheels import commanded_joints, drive_plugins
from diff_encoder_sim.robots.rolling_wheels import rolling_wheels
from urdf_texts import pair, plugin, tree_of, usual

WHEELS = ('left_wheel_joint',), ('right_wheel_joint',)


def drives(text):
    tree = tree_of(text)
    return drive_plugins(tree, rolling_wheels(tree))


def only_drive(*parts):
    (tags,) = drives(usual(*parts))
    return tags


@pytest.mark.parametrize(
    ('filename', 'tags'),
    [
        (
            'libgazebo_ros_diff_drive.so',
            {
                'leftJoint': 'left_wheel_joint',
                'rightJoint': 'right_wheel_joint',
                'wheelSeparation': 0.3,
                'wheelDiameter': 0.1,
                'wheelTorque': 5,
            },
        ),
        (
            'libgazebo_ros_diff_drive.so',
            {
                'left_joint': 'left_wheel_joint',
                'right_joint': 'right_wheel_joint',
                'wheel_separation': 0.3,
                'wheel_diameter': 0.1,
                'max_wheel_torque': 5,
            },
        ),
        (
            'libmaker_of_robots.so',
            {
                'left_wheel_joint_name': ' left_wheel_joint ',
                'right_wheel_joint_name': 'right_wheel_joint',
                'wheel_separation': 0.3,
                'wheel_diameter': 0.1,
                'torque': 5,
            },
        ),
    ],
)
def test_a_drive_plugin_tells_joints_and_sizes_whatever_it_calls_them(filename, tags):
    found = only_drive(plugin(filename, **tags))
    assert (found.source, found.kind) == (filename, 'differential')
    assert (found.left_joints, found.right_joints) == WHEELS
    assert (found.separation_m, found.diameter_m, found.limits) == (0.3, 0.1, {'wheel_torque': 5.0})


def test_gazebo_sim_tells_the_radius_and_limits_of_the_body():
    found = only_drive(
        '<gazebo><plugin name="gz::sim::systems::DiffDrive" filename="gz-sim-diff-drive-system">'
        '<left_joint>left_wheel_joint</left_joint><right_joint>right_wheel_joint</right_joint>'
        '<wheel_radius>0.05</wheel_radius><max_linear_velocity>0.5</max_linear_velocity>'
        '<max_angular_acceleration>2</max_angular_acceleration></plugin></gazebo>'
    )
    assert found.diameter_m == 0.1
    assert found.limits == {'max_linear_speed': 0.5, 'max_angular_acceleration': 2.0}


def test_zero_stands_for_no_limit():
    found = only_drive(
        plugin(
            'libx_diff_drive.so',
            leftJoint='left_wheel_joint',
            rightJoint='right_wheel_joint',
            wheelTorque=0,
            wheelAcceleration=1.8,
        )
    )
    assert found.limits == {'rim_acceleration': 1.8}


@pytest.mark.parametrize('number', ['1e300', '9' * 400, 'nan', 'inf', '-1', '7_0', '1e-300', ''])
def test_a_number_that_no_robot_has_is_ignored(number):
    tags = dict.fromkeys(('wheelSeparation', 'wheelDiameter', 'wheelTorque', 'wheelAcceleration'), number)
    drive = plugin('libx_diff_drive.so', leftJoint='left_wheel_joint', rightJoint='right_wheel_joint', **tags)
    found = only_drive(drive)
    assert (found.separation_m, found.diameter_m, found.limits) == (None, None, {})


def test_several_wheels_on_a_side_are_a_skid_steer_drive():
    rear = pair(x_m=-0.2, names=('rear_left', 'rear_right'))
    joints = {'left': ('left_wheel_joint', 'rear_left_joint'), 'right': ('right_wheel_joint', 'rear_right_joint')}
    several = ''.join(f'<{side}_joint>{name}</{side}_joint>' for side, names in joints.items() for name in names)
    found = only_drive(rear, f'<gazebo><plugin filename="libgazebo_ros_diff_drive.so">{several}</plugin></gazebo>')
    assert (found.kind, found.left_joints, found.right_joints) == ('skid-steer', joints['left'], joints['right'])
    corners = zip(('leftFront', 'leftRear', 'rightFront', 'rightRear'), (*joints['left'], *joints['right']))
    found = only_drive(rear, plugin('libmaker.so', **{f'{corner}Joint': name for corner, name in corners}))
    assert (found.kind, found.left_joints, found.right_joints) == ('skid-steer', joints['left'], joints['right'])


@pytest.mark.parametrize(
    ('filename', 'tags', 'kind'),
    [
        ('libgazebo_ros_tricycle_drive.so', {'steeringJoint': 'a'}, 'steered'),
        ('gz-sim-ackermann-steering-system', {'left_joint': 'a', 'right_joint': 'b'}, 'steered'),
        ('gz-sim-mecanum-drive-system', {'front_left_joint': 'a', 'front_right_joint': 'b'}, 'omnidirectional'),
    ],
)
def test_other_drives_are_told_by_their_names(filename, tags, kind):
    assert only_drive(plugin(filename, **tags)).kind == kind


@pytest.mark.parametrize(
    ('filename', 'tags'),
    [
        ('libgazebo_ros_joint_state_publisher.so', {'jointName': 'left_wheel_joint, right_wheel_joint'}),
        ('libgazebo_ros_imu.so', {'bodyName': 'left_wheel'}),
        ('libgazebo_ros_control.so', {'robotNamespace': '/'}),
        ('libgazebo_ros_planar_move.so', {'robotBaseFrame': 'base_link'}),
    ],
)
def test_other_plugins_drive_nothing(filename, tags):
    assert drives(usual(plugin(filename, **tags))) == ()


def test_transmissions_and_ros2_control_tell_what_is_commanded_and_how():
    text = usual(
        '<transmission name="t"><joint name="left_wheel_joint"><hardwareInterface>hardware_interface/'
        'VelocityJointInterface</hardwareInterface></joint></transmission>'
        '<ros2_control name="r" type="system"><joint name="right_wheel_joint"><command_interface name="velocity"/>'
        '<state_interface name="position"/></joint><joint name="ball_caster_joint"><command_interface name="position"/>'
        '</joint><joint name="missing"><command_interface name="velocity"/></joint></ros2_control>'
    )
    assert commanded_joints(tree_of(text)) == ('left_wheel_joint', 'right_wheel_joint')
    assert commanded_joints(tree_of(text), position=True) == ('ball_caster_joint',)


def test_a_controller_of_the_first_gazebo_tells_the_same():
    found = only_drive(
        '<gazebo><controller:differential_position2d xmlns:controller="any" name="c">'
        '<leftJoint>left_wheel_joint</leftJoint><rightJoint>right_wheel_joint</rightJoint><wheelSeparation>0.3</wheelSeparation>'
        '</controller:differential_position2d></gazebo>'
    )
    assert (found.source, found.left_joints, found.separation_m) == ('differential_position2d', WHEELS[0], 0.3)
