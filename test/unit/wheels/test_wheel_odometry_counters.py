"""Counters that wrap change nothing, whatever their width, with real encoders and measured speeds."""

import math

import pytest

from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder
from encoder_drives import JOINTS, TICK_NS

TICKS, TURNS = 600, 3.0


def angles_rad(index):
    """Forward, back and forth again by some turns, each wheel in its own way."""
    passed = 2.0 * math.pi * index / TICKS
    return TURNS * 2.0 * math.pi * math.sin(passed), TURNS * 2.0 * math.pi * math.sin(passed + 0.3)


def drive(modulus, start_rad, lines):
    """The odometry after a drive that begins at an angle, its estimates, and the counters of both wheels."""
    shared = {
        'encoder': {'lines': lines, 'edge_error': 0.05, 'eccentricity': 0.01},
        'counter_modulus': modulus,
        'velocity_method': 'MT',
    }
    reporting = ReportingEncoder(EncoderParams.from_mapping({**shared, 'report': {'latency': 0.02}}, 'test'))
    odometry = WheelOdometry(OdometryParams.from_mapping(shared, 'test'))
    estimates, counters = [], []
    for index in range(TICKS):
        angles = [start_rad + angle for angle in angles_rad(index)]
        for sample in reporting.update(index * TICK_NS, JOINTS, angles):
            assert sample.wheel_rates_radps is not None
            estimates.append(odometry.update(*sample))
            counters.append((sample.left_pulses, sample.right_pulses))
    return odometry, estimates, counters


@pytest.mark.parametrize(('bits', 'lines'), [(8, 90), (16, 1024), (24, 1024), (32, 1024)])
@pytest.mark.parametrize('sign', [1, -1])
def test_pose_and_twist_are_those_of_a_counter_that_never_wraps(bits, lines, sign):
    """The drive begins where the counter wraps, at either end of its range, so that it goes over that and back."""
    start_rad = sign * 2 ** (bits - 1) / (4 * lines) * 2.0 * math.pi
    wrapped, estimates, counters = drive(2**bits, start_rad, lines)
    endless, expected, _ = drive(0, start_rad, lines)
    for wheel in zip(*counters):
        assert -(2 ** (bits - 1)) <= min(wheel) < 0 <= max(wheel) < 2 ** (bits - 1)
        assert max(abs(later - earlier) for earlier, later in zip(wheel, wheel[1:])) > 2 ** (bits - 1)  # a wrap
    assert (wrapped.counts, wrapped.restarts) == (endless.counts, endless.restarts) and wrapped.restarts == 0
    assert [estimate.base_pose_in_odom for estimate in estimates] == [each.base_pose_in_odom for each in expected]
    assert [estimate[2:4] for estimate in estimates] == [each[2:4] for each in expected]
