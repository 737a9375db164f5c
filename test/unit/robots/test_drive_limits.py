import pytest

from urdf_texts import ball, base, box, described, found, pair, plugin, robot, usual

WEIGHT_N = (2.0 + 0.2) * 9.81


def drive(**limits):
    return plugin('libdiff_drive.so', leftJoint='left_wheel_joint', rightJoint='right_wheel_joint', **limits)


def with_joint_limits(effort, velocity):
    limits = f'<limit effort="{effort}" velocity="{velocity}"/>'
    return robot(base(), pair(inside=limits), ball('ball', 0.1))


def test_without_any_limit_the_torque_is_what_the_floor_takes():
    limits = described(usual()).drive_limits
    assert limits == {'wheel_torque': pytest.approx(WEIGHT_N * 0.05)}


def test_a_plugins_torque_counts_unless_wheels_could_only_slip():
    assert described(usual(drive(wheelTorque=0.4))).drive_limits['wheel_torque'] == 0.4
    description = described(usual(drive(wheelTorque=20)))
    assert description.drive_limits['wheel_torque'] == pytest.approx(WEIGHT_N * 0.05)
    assert found(description, 'wheel torque [N m]')[1] == (
        'mass x g x wheel radius: more only slips (given by libdiff_drive.so: 20)'
    )


def test_a_rims_acceleration_limits_driving_and_turning():
    limits = described(usual(drive(wheelAcceleration=1.8))).drive_limits
    assert limits['max_linear_acceleration'] == 1.8
    assert limits['max_angular_acceleration'] == pytest.approx(1.8 / 0.15)


def test_joint_limits_are_those_of_the_motors():
    limits = described(with_joint_limits(0.5, 10.0)).drive_limits
    assert limits['wheel_torque'] == 0.5
    assert limits['max_linear_speed'] == pytest.approx(0.5)
    assert limits['max_angular_speed'] == pytest.approx(0.5 / 0.15)


@pytest.mark.parametrize(('velocity', 'warned'), [(0, False), (1000, False), (0.1, True)])
def test_placeholders_are_no_limits(velocity, warned):
    description = described(with_joint_limits(0, velocity))
    assert list(description.drive_limits) == ['wheel_torque']
    assert any('too slow to drive' in warning for warning in description.warnings) == warned


def test_the_plugin_goes_before_the_joints():
    text = with_joint_limits(0.5, 10.0).replace('</robot>', drive(wheelTorque=0.3) + '</robot>')
    assert described(text).drive_limits['wheel_torque'] == 0.3


def test_usual_accelerations_give_way_to_a_low_torque_and_a_large_inertia():
    weak = described(with_joint_limits(0.02, 10.0)).drive_limits
    assert weak['max_linear_acceleration'] == pytest.approx(0.5 * 2 * 0.02 / 0.05 / 2.2)
    long = base(body=box(1.2, 0.2, 0.1)).replace('iyy="0.01" izz="0.01"', 'iyy="0.3" izz="0.3"')
    limits = described(robot(long, pair(), ball('ball', 0.1))).drive_limits
    force_n = 0.5 * WEIGHT_N * (1 - 0.02 * 2.0 / 2.2 / 0.1)
    assert limits['max_angular_acceleration'] == pytest.approx(force_n * 0.15 / 0.305, rel=0.02)
    assert 'max_linear_acceleration' not in limits


def test_an_acceleration_in_the_file_is_not_lowered_to_the_torque():
    text = with_joint_limits(0.02, 10.0).replace('</robot>', drive(wheelAcceleration=1.0) + '</robot>')
    assert described(text).drive_limits['max_linear_acceleration'] == 1.0
