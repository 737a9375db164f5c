"""Recorded counts as angles, across wraps and restarts of the counters."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.joint_wheels import PulseWheels
from diff_encoder_sim.drives.ros1_stream import Message
from diff_encoder_sim.wheels.counter import wrap_count
from diff_encoder_sim.wheels.encoder_params import PerWheel
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from reencoding_drives import JOINTS, MAKERS, ROS1, angles_rad, write_ros1, write_ros2
from reencoding_runs import counts_of, run, samples_of


@pytest.mark.parametrize('modulus', [0, 256])
@MAKERS
def test_counts_of_a_finer_encoder_give_the_counts_of_its_divisors(tmp_path, maker, modulus):
    angles = angles_rad(2001, speeds_radps=(-4.0, 4.4))
    rows = [
        ('/fine', stamp_ns, maker.pulses(stamp_ns, [wrap_count(count, modulus) for count in counts]))
        for stamp_ns, *counts, _ in samples_of(angles, 1024)
    ]
    config = tmp_path / 'config.yaml'
    config.write_text(f'counter_modulus: {modulus}\n')
    path = write_ros2(tmp_path / 'a', rows) if maker.is_ros2 else write_ros1(tmp_path / 'a.bag', rows)
    run(path, '--pulses-ppr', 1024, '--ppr', 64, 100, '--out', tmp_path / 'out', '--config', config)
    for ppr, most_off in ((64, 0), (100, 1)):
        found = counts_of(tmp_path / 'out' / f'a_{ppr}ppr.bag')
        expected = [sample[1:3] for sample in samples_of(angles, ppr)]
        if modulus:  # a wrapped count shows travel only: its steps are those of the drive, up to an unknown start
            found, expected = (np.diff(counts, axis=0) for counts in (found, expected))
        differences = wrap_count(np.subtract(found, expected), modulus)
        assert np.abs(differences).max() <= most_off
        assert np.count_nonzero(differences) <= (1 + (modulus > 0)) * 1.5 * 0.25 * ppr / 1024 * differences.size


def read(*reports, **params):
    """Angles (n, 2) and restarts of reports: stamp [ms], left, right."""
    wheels = PulseWheels('/p', JOINTS, False, OdometryParams(**params), 'about', [])
    for stamp_ms, *counts in reports:
        wheels.add(Message('/p', 0, ROS1.raw(ROS1.pulses(stamp_ms * 1_000_000, counts))))
    return [drive.wheel_angles_rad for drive, _ in wheels.drives()], wheels.restarts


def test_an_angle_is_the_middle_of_its_pulse_and_unwrapped():
    [found], restarts = read((0, 0, 15), (500, 15, 0), ppr=PerWheel(left=100, right=4), counter_modulus=16)
    pulses = np.array([[0.5, 15.5], [-0.5, 16.5]])
    assert found == pytest.approx(pulses * (2.0 * math.pi / np.array([100.0, 4.0]))) and restarts == 0


@pytest.mark.parametrize('modulus', [0, 65536])
def test_a_restart_of_the_counters_is_no_motion(modulus):
    counted = [(50 * tick, 1000 + 4 * tick, 2000 + 4 * tick) for tick in range(20)]
    [found], restarts = read(*counted, (1000, 2, 2), ppr=100, counter_modulus=modulus)
    assert found[-1] - found[-2] == pytest.approx([4.0 * math.pi / 100.0] * 2) and restarts == 1


@pytest.mark.parametrize('names', [JOINTS[:1], (*JOINTS, JOINTS[0]), ('arm', 'hand')])
def test_counts_without_one_of_each_wheel_are_refused(names):
    wheels = PulseWheels('/p', JOINTS, False, OdometryParams(ppr=100), 'about', [])
    with pytest.raises(InputFault, match='expected left_wheel_joint and right_wheel_joint, each once'):
        wheels.add(Message('/p', 0, ROS1.raw(ROS1.pulses(0, range(len(names)), names))))
