"""Numbers of a known motion become its wheel angles."""

import math

import numpy as np
import pytest

from diff_encoder_sim.drives.wheel_units import UNITS, WheelAngle, WheelUnit
from reencoding_drives import TICK_NS
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


def test_ticks_as_fractions_are_those_that_have_passed():
    unit = WheelUnit('ticks', RADIUS_M, 10.0)
    assert angles_of(unit, [2.0, 2.9, -0.1]) == pytest.approx(np.array([2.5, 2.5, -0.5]) * 0.2 * math.pi)


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


def test_speeds_begin_at_the_angle_that_is_given():
    assert angles_of(WheelUnit('rad/s', RADIUS_M, start_rad=2.0), [0.0, 0.0]) == pytest.approx([2.0, 2.0])


def test_time_that_stands_or_goes_back_does_not_turn_a_wheel():
    wheel = WheelAngle(WheelUnit('rad/s', RADIUS_M))
    angles = [wheel.angle_rad(stamp_ns, 3.0) for stamp_ns in (10**9, 2 * 10**9, 2 * 10**9, 10**9, 2 * 10**9)]
    assert angles == pytest.approx([0.0, 3.0, 3.0, 3.0, 6.0])


@pytest.mark.parametrize('unit', UNITS)
def test_a_reversed_wheel_turns_the_other_way(unit):
    forward = WheelUnit(unit, RADIUS_M, 360.0 if unit.startswith('ticks') else None)
    values = [1.0, 5.0, 4.0]
    assert angles_of(forward._replace(is_reversed=True), values) == pytest.approx(-angles_of(forward, values))
