"""Angles of two joints, in one message or in several; recorded counts, across wraps and restarts of the counters."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.per_wheel import PerWheel
from diff_encoder_sim.drives.drive_stream import Message
from diff_encoder_sim.drives.joint_wheels import JointWheels, PulseWheels
from diff_encoder_sim.drives.message_encoders import encode_encoder_pulse
from diff_encoder_sim.wheels.counter import wrap_count
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from reencoding_drives import JOINTS, MAKERS, ROS1, angles_rad, contents, counts_of, drive, run, samples_of, write


def read(messages, maker=ROS1):
    wheels = JointWheels('/js', JOINTS, maker.is_ros2)
    for tick, message in enumerate(messages):
        wheels.add(Message('/js', 7 * tick, maker.raw(message)))
    [(found, times_ns)] = wheels.drives()
    return found.stamps_ns.tolist(), times_ns.tolist(), found.wheel_angles_rad.tolist()


@MAKERS
def test_both_joints_of_a_message_among_others(maker):
    messages = [maker.joint_state(tick, (tick, 9.0, -tick), (JOINTS[1], 'arm', JOINTS[0])) for tick in range(1, 5)]
    assert read(messages, maker) == ([1, 2, 3, 4], [0, 7, 14, 21], [[-1, 1], [-2, 2], [-3, 3], [-4, 4]])


def test_joints_in_separate_messages_are_paired_at_the_left_ones_stamps():
    messages = [ROS1.joint_state(10**7 * tick, (float(tick),), (JOINTS[tick % 2],)) for tick in range(9)]
    assert read(messages)[::2] == ([10**7 * tick for tick in (2, 4, 6)], [[2, 2], [4, 4], [6, 6]])


@pytest.mark.parametrize(
    ('names', 'angles', 'fault'),
    [
        (JOINTS, (np.nan, 0.0), "'left_wheel_joint' has position nan"),
        (JOINTS, (0.0, 2e9), "'right_wheel_joint' has position 2000000000.0"),
        (JOINTS, (0.0,), '2 names, 1 positions'),
        ((*JOINTS, JOINTS[0]), (0.0, 0.0, 0.0), "'left_wheel_joint' is named 2 times"),
    ],
)
def test_a_message_without_one_angle_of_each_wheel_is_refused(names, angles, fault):
    with pytest.raises(InputFault, match=fault):
        read([ROS1.joint_state(1, angles, names)])


def test_names_of_joints_are_found_or_given(tmp_path):
    joints, samples = ('wheel_l', 'front_RIGHT_wheel'), samples_of(angles_rad(101), 90)
    path = write(tmp_path / 'a.bag', drive(count=101, names=joints, reference=None))
    for out, given in (('found', []), ('given', ['--left', joints[0], '--right', joints[1]])):
        run(path, '--ppr', '90', '--out', tmp_path / out, *given)
        found = contents(tmp_path / out / 'a_90ppr.bag')['/encoder_pulse']
        assert found == [encode_encoder_pulse(sample, joints)[4:] for sample in samples]


@pytest.mark.parametrize('modulus', [0, 256])
@MAKERS
def test_counts_of_a_finer_encoder_give_the_counts_of_its_divisors(tmp_path, maker, modulus):
    angles = angles_rad(2001, speeds_radps=(-4.0, 4.4))
    rows = [
        ('/fine', stamp_ns, maker.pulses(stamp_ns, [wrap_count(count, modulus) for count in counts]))
        for stamp_ns, *counts, _ in samples_of(angles, 1024)
    ]
    (tmp_path / 'config.yaml').write_text(f'counter_modulus: {modulus}\n')
    options = ['--pulses-ppr', 1024, '--ppr', 64, 100, '--config', tmp_path / 'config.yaml', '--draws', 0]
    run(write(tmp_path / 'a', rows), *options, '--out', tmp_path / 'out')
    for ppr, most_off in ((64, 0), (100, 1)):
        found = counts_of(tmp_path / 'out' / f'a_{ppr}ppr.bag')
        expected = [sample[1:3] for sample in samples_of(angles, ppr)]
        if modulus:  # wrapped counts have the steps of the drive, up to an unknown start
            found, expected = (np.diff(counts, axis=0) for counts in (found, expected))
        differences = wrap_count(np.subtract(found, expected), modulus)
        assert np.abs(differences).max() <= most_off
        assert np.count_nonzero(differences) <= (1 + (modulus > 0)) * 1.5 * 0.25 * ppr / 1024 * differences.size


def read_counts(*reports, names=JOINTS, **params):
    """Angles (n, 2) and restarts of reports: stamp [ms], left, right."""
    wheels = PulseWheels('/p', JOINTS, False, OdometryParams(**params), 'about', [])
    for stamp_ms, *counts in reports:
        wheels.add(Message('/p', 0, ROS1.raw(ROS1.pulses(stamp_ms * 1_000_000, counts, names))))
    return [drive.wheel_angles_rad for drive, _ in wheels.drives()], wheels.restarts


def test_an_angle_is_the_middle_of_its_pulse_and_unwrapped():
    [found], restarts = read_counts((0, 0, 15), (500, 15, 0), ppr=PerWheel(left=100, right=4), counter_modulus=16)
    pulses = np.array([[0.5, 15.5], [-0.5, 16.5]])
    assert found == pytest.approx(pulses * (2.0 * math.pi / np.array([100.0, 4.0]))) and restarts == 0


@pytest.mark.parametrize('names', [JOINTS[:1], (*JOINTS, JOINTS[0]), ('arm', 'hand')])
def test_counts_without_one_of_each_wheel_are_refused(names):
    with pytest.raises(InputFault, match='expected left_wheel_joint and right_wheel_joint, each once'):
        read_counts((0, *range(len(names))), names=names)
