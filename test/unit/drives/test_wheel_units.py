"""Numbers of wheels as angles: units, and counts across wraps and restarts."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.number_units import UNITS
from diff_encoder_sim.drives.sensor_messages import JointValues
from diff_encoder_sim.drives.typestore import noetic_store
from diff_encoder_sim.drives.wheel_units import CountedAngles, WheelAngle, WheelUnit
from diff_encoder_sim.wheels.counter import wrap_count
from diff_encoder_sim.wheels.encoder_params import PerWheel
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from reencoding_drives import ROS1, ROS2, TICK_NS, angles_rad, write_ros1, write_ros2
from reencoding_runs import contents, run, samples_of
from reencoding_sources import ticks

RADIUS_M = 0.1
# Forward, back over the start, and forward again.
ANGLES_RAD = np.cumsum(np.concatenate([np.full(400, 0.05), np.full(900, -0.07), np.full(500, 0.06)])) + 0.3


def angles_of(unit, values):
    wheel = WheelAngle(unit)
    return np.array([wheel.angle_rad(tick * TICK_NS, value) for tick, value in enumerate(values)])


@pytest.mark.parametrize('ppr', [40, 508.8, 2578.33])
@pytest.mark.parametrize('bits', [None, 8, 16, 32])
def test_ticks_of_a_known_motion_are_its_angles_to_half_a_tick(ppr, bits):
    counts = ticks(ANGLES_RAD, ppr, bits)
    found = angles_of(WheelUnit('ticks', RADIUS_M, ppr, 2**bits if bits else 0), counts.tolist())
    offset_rad = (counts[0] - ticks(ANGLES_RAD[0], ppr)) * 2.0 * math.pi / ppr  # of a counter that began elsewhere
    assert np.abs(found - offset_rad - ANGLES_RAD).max() <= math.pi / ppr + 1e-9


def test_ticks_of_each_message_add_up():
    counts = ticks(ANGLES_RAD, 360)
    found = angles_of(WheelUnit('ticks/message', RADIUS_M, 360.0), np.diff(counts, prepend=0).tolist())
    assert np.abs(found - ANGLES_RAD).max() <= math.pi / 360 + 1e-9


@pytest.mark.parametrize(
    ('unit', 'per_rad'), [('rad', 1.0), ('deg', 180.0 / math.pi), ('rev', 0.5 / math.pi), ('m', RADIUS_M)]
)
def test_angles_and_path_are_exact(unit, per_rad):
    assert angles_of(WheelUnit(unit, RADIUS_M), ANGLES_RAD * per_rad) == pytest.approx(ANGLES_RAD, abs=1e-12)


@pytest.mark.parametrize(
    ('unit', 'per_radps'), [('rad/s', 1.0), ('deg/s', 180.0 / math.pi), ('rpm', 30.0 / math.pi), ('m/s', RADIUS_M)]
)
def test_a_speed_that_changes_evenly_is_integrated_exactly(unit, per_radps):
    times_s = np.arange(500) * 0.01
    speeds, angles_rad = 2.0 - 3.0 * times_s, 2.0 * times_s - 1.5 * times_s**2
    assert angles_of(WheelUnit(unit, RADIUS_M), speeds * per_radps) == pytest.approx(angles_rad, abs=1e-9)


def test_time_that_stands_or_goes_back_does_not_turn_a_wheel():
    wheel = WheelAngle(WheelUnit('rad/s', RADIUS_M))
    angles = [wheel.angle_rad(stamp_ns, 3.0) for stamp_ns in (10**9, 2 * 10**9, 2 * 10**9, 10**9, 2 * 10**9)]
    assert angles == pytest.approx([0.0, 3.0, 3.0, 3.0, 6.0])


@pytest.mark.parametrize('unit', UNITS)
def test_a_reversed_wheel_turns_the_other_way(unit):
    forward = WheelUnit(unit, RADIUS_M, 360.0 if unit.startswith('ticks') else None)
    values = [1.0, 5.0, 4.0]
    assert angles_of(forward._replace(is_reversed=True), values) == pytest.approx(-angles_of(forward, values))


@pytest.mark.parametrize('modulus', [0, 256])
@pytest.mark.parametrize('maker', [ROS1, ROS2], ids=['ROS 1', 'ROS 2'])
def test_counts_of_a_finer_encoder_give_the_counts_of_its_divisors(tmp_path, maker, modulus):
    angles = angles_rad(2001, speeds_radps=(-4.0, 4.4))
    rows = [
        ('/fine', stamp_ns, maker.pulses(stamp_ns, [wrap_count(count, modulus) for count in counts]))
        for stamp_ns, *counts, _ in samples_of(angles, 1024)
    ]
    config = tmp_path / 'config.yaml'
    config.write_text(f'counter_modulus: {modulus}\n')
    write, name = (write_ros2, 'a') if maker is ROS2 else (write_ros1, 'a.bag')
    run(
        write(tmp_path / name, rows),
        '--pulses-ppr',
        '1024',
        '--ppr',
        '64',
        '100',
        '--out',
        tmp_path / 'out',
        '--config',
        config,
    )
    found = {
        ppr: [
            noetic_store().deserialize_ros1(b'\0\0\0\0' + raw, 'diff_encoder_sim/msg/EncoderPulse').pulses.tolist()
            for raw in contents(tmp_path / 'out' / (f'a_{ppr}ppr.bag'))['/encoder_pulse']
        ]
        for ppr in (64, 100)
    }
    expected = {
        ppr: [[wrap_count(count, modulus) for count in sample[1:3]] for sample in samples_of(angles, ppr)]
        for ppr in (64, 100)
    }
    if modulus == 0:
        assert found[64] == expected[64]
        differences = np.subtract(found[100], expected[100])
        assert set(np.abs(differences).ravel()) <= {0, 1}
        assert np.count_nonzero(differences) <= 1.5 * 0.25 * 100 / 1024 * differences.size
    # A wrapped count tells travel alone: the steps are those of the drive, up to its unknown start.
    steps = np.diff(np.array(found[64]), axis=0)
    assert [[wrap_count(int(step), modulus) for step in pair] for pair in steps] == np.diff(
        [sample[1:3] for sample in samples_of(angles, 64)], axis=0
    ).tolist()


def counted_by(**params):
    return CountedAngles(('l', 'r'), OdometryParams(**params))


def at(stamp_ms, left, right):
    return JointValues(stamp_ms * 1_000_000, ('l', 'r'), [left, right])


def test_an_angle_is_the_middle_of_its_pulse_and_other_joints_are_left_out():
    counted = counted_by(ppr=PerWheel(left=100, right=4), counter_modulus=16)
    first = counted.angles(JointValues(5, ('arm', 'r', 'l'), [7, 15, 0]))
    assert (first.stamp_ns, first.names) == (5, ('l', 'r'))
    assert first.values == pytest.approx([0.5 * math.pi / 50.0, 15.5 * math.pi / 2.0])
    wrapped = counted.angles(JointValues(500_000_005, ('r', 'l'), [0, 15]))
    assert wrapped.values == pytest.approx([-0.5 * math.pi / 50.0, 16.5 * math.pi / 2.0])
    assert counted.restarts == 0


@pytest.mark.parametrize('modulus', [0, 65536])
def test_a_restart_of_the_counters_is_no_motion(modulus):
    counted = counted_by(ppr=100, counter_modulus=modulus)
    for tick in range(20):
        last = counted.angles(at(50 * tick, 1000 + 4 * tick, 2000 + 4 * tick))
    again = counted.angles(at(1000, 2, 2))
    assert np.subtract(again.values, last.values) == pytest.approx([4.0 * math.pi / 100.0] * 2)
    assert counted.restarts == 1


def test_a_report_that_is_repeated_or_late_turns_no_wheel():
    counted = counted_by(ppr=100)
    angles = [counted.angles(at(*report)).values for report in ((0, 5, 5), (100, 9, 9), (100, 9, 9), (50, 7, 7))]
    assert angles[1] == angles[2] == angles[3]
    assert counted.angles(at(150, 11, 11)).values == pytest.approx([11.5 * math.pi / 50.0] * 2)


def test_time_that_goes_back_is_another_drive_and_no_restart():
    counted = counted_by(ppr=100)
    counted.angles(at(5000, 900, 900))
    assert counted.angles(at(0, 3, 4)).values == pytest.approx([3.5 * math.pi / 50.0, 4.5 * math.pi / 50.0])
    assert counted.restarts == 0


@pytest.mark.parametrize(('names', 'values'), [(('l',), [1]), (('l', 'l', 'r'), [1, 2, 3]), (('l', 'r'), [1])])
def test_counts_without_one_of_each_wheel_are_refused(names, values):
    with pytest.raises(InputFault, match='expected l and r, each once'):
        counted_by(ppr=100).angles(JointValues(0, names, values))
