"""Numbers of wheels as angles, and both wheels at the same instants."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.per_wheel import PerWheel
from diff_encoder_sim.drives.number_units import UNITS
from diff_encoder_sim.drives.wheel_source import WheelNumbers, WheelSeries, paired_drives
from reencoding_drives import TICK_NS
from reencoding_sources import ticks

RADII_M = (0.1, 0.11)
# Forward, back over the start, and forward again.
ANGLES_RAD = np.cumsum(np.concatenate([np.full(400, 0.05), np.full(900, -0.07), np.full(500, 0.06)])) + 0.3


def series(values, stamps_ns=None):
    stamps_ns = TICK_NS * np.arange(len(values)) if stamps_ns is None else np.asarray(stamps_ns)
    return WheelSeries(stamps_ns, stamps_ns, np.asarray(values, float))


def angles_of(unit, values, stamps_ns=None, ppr=None, side=0, **others):
    numbers = WheelNumbers(unit, RADII_M, ppr and PerWheel(left=ppr, right=ppr), **others)
    return numbers.angles(side, series(values, stamps_ns)).values


@pytest.mark.parametrize('ppr', [40, 508.8])
@pytest.mark.parametrize('bits', [None, 8, 16])
def test_ticks_of_a_known_motion_are_its_angles_to_half_a_tick(ppr, bits):
    counts = ticks(ANGLES_RAD, ppr, bits)
    found = angles_of('ticks', counts, ppr=ppr, moduli=(2**bits if bits else 0, 1))
    offset_rad = (counts[0] - ticks(ANGLES_RAD[0], ppr)) * 2.0 * math.pi / ppr  # of a counter that began elsewhere
    assert np.abs(found - offset_rad - ANGLES_RAD).max() <= math.pi / ppr + 1e-9


def test_ticks_of_each_message_add_up():
    found = angles_of('ticks/message', np.diff(ticks(ANGLES_RAD, 360), prepend=0), ppr=360.0)
    assert np.abs(found - ANGLES_RAD).max() <= math.pi / 360 + 1e-9


@pytest.mark.parametrize(
    ('unit', 'per_rad', 'speed_unit', 'per_radps'),
    [
        ('rad', 1.0, 'rad/s', 1.0),
        ('deg', 180.0 / math.pi, 'deg/s', 180.0 / math.pi),
        ('rev', 0.5 / math.pi, 'rpm', 30.0 / math.pi),
        ('m', RADII_M[0], 'm/s', RADII_M[1]),
    ],
)
def test_angles_and_evenly_changing_speeds_are_exact(unit, per_rad, speed_unit, per_radps):
    assert angles_of(unit, ANGLES_RAD * per_rad) == pytest.approx(ANGLES_RAD, abs=1e-12)
    times_s = np.arange(500) * 0.01
    found = angles_of(speed_unit, (2.0 - 3.0 * times_s) * per_radps, side=1)
    assert found == pytest.approx(2.0 * times_s - 1.5 * times_s**2, abs=1e-9)


def test_time_that_stands_or_goes_back_does_not_turn_a_wheel():
    found = angles_of('rad/s', [3.0] * 5, 10**9 * np.array([1, 2, 2, 1, 2]))
    assert found - found[0] == pytest.approx([0.0, 3.0, 3.0, 3.0, 6.0])


@pytest.mark.parametrize('unit', UNITS)
def test_a_reversed_wheel_turns_the_other_way(unit):
    ppr = 360.0 if unit.startswith('ticks') else None
    found = [angles_of(unit, [1.0, 5.0, 4.0], ppr=ppr, reversed_sides=sides) for sides in (['right'], ['left'])]
    assert found[1] == pytest.approx(-found[0]) and found[0].any()


def at_rate(speed, rate_hz, late_s=0.0, duration_s=10.0):
    times_s = np.arange(late_s, duration_s, 1.0 / rate_hz)
    return series(speed * times_s, np.round(1e9 * times_s).astype(np.int64))


@pytest.mark.parametrize(('rate_hz', 'late_s'), [(10.0, 0.05), (100.0, 0.003), (7.0, 0.02)])
def test_a_wheel_that_turns_evenly_is_interpolated_exactly(rate_hz, late_s):
    [(drive, times_ns)], left_out = paired_drives(at_rate(2.0, 10.0), at_rate(3.0, rate_hz, late_s))
    assert left_out == 0 and len(drive) >= 98 and np.array_equal(times_ns, drive.stamps_ns)
    expected = 1e-9 * np.outer(drive.stamps_ns, (2.0, 3.0))
    assert drive.wheel_angles_rad == pytest.approx(expected, abs=1e-6)


def test_nothing_is_made_up_across_a_gap_or_after_a_wheel_is_lost():
    right = at_rate(3.0, 10.0)
    right = right.at((right.stamps_ns <= 2 * 10**9) | (right.stamps_ns >= 6 * 10**9))
    [(drive, _)], left_out = paired_drives(at_rate(2.0, 10.0, 0.05), right)
    assert not ((drive.stamps_ns > 2 * 10**9) & (drive.stamps_ns < 6 * 10**9)).any()
    assert left_out == 40 and drive.stamps_ns[-1] > 9.8e9
    for wheels in ((4.0, 10.0), (10.0, 4.0)):
        [(drive, _)], left_out = paired_drives(*(at_rate(2.0, 10.0, duration_s=each) for each in wheels))
        assert drive.stamps_ns[-1] == 3.9e9 and left_out in (49, 50)


def test_repeated_and_overtaken_stamps_are_left_out():
    left = series([1.0, 9.0, 9.0], [1_500_000_000, 1_500_000_000, 1_200_000_000])
    [(drive, _)], _ = paired_drives(left, series([7.0, 8.0], [10**9, 2 * 10**9]))
    assert (drive.stamps_ns.tolist(), drive.wheel_angles_rad.tolist()) == ([1_500_000_000], [[1.0, 7.5]])


@pytest.mark.parametrize('late_ns', [0, 1])
def test_time_that_is_set_back_begins_another_drive(late_ns):
    stamps_ns = 10**8 * np.array([100, 105, 20, 25])
    drives, _ = paired_drives(series(range(4), stamps_ns), series(range(4), stamps_ns + late_ns))
    assert len(drives) == 2
    assert late_ns or [drive.stamps_ns[-1] for drive, _ in drives] == [10**8 * 105, 10**8 * 25]
