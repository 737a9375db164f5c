"""The encoder: equation (1), the counter's width, sampling on stamps, and bad messages."""

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.encoders.counter import count_difference, wrap_count
from diff_encoder_sim.encoders.pulses import ppr_label, pulses_from_angle
from diff_encoder_sim.encoders.sampling import BoundarySampler
from diff_encoder_sim.encoders.wheel_encoder import DiffEncoder, EncoderParams, EncoderSample

NAMES = ['left_wheel_joint', 'right_wheel_joint']
MS = 1_000_000


def turn(pulses, ppr):
    """Angle [rad] in the middle of a pulse."""
    return 2 * math.pi * (pulses + 0.5) / ppr


@pytest.mark.parametrize(
    ('angle_in_pulses', 'pulses'),
    [(0.0, 0), (0.99, 0), (1.01, 1), (-0.1, -1), (-1.0 - 1e-9, -2), (89.5, 89), (-90.5, -91)],
)
@pytest.mark.parametrize('ppr', [40, 90, 1024, 4096])
def test_equation_1_floors_at_positive_and_negative_angles(angle_in_pulses, pulses, ppr):
    assert pulses_from_angle(2 * math.pi * angle_in_pulses / ppr, ppr) == pulses


@pytest.mark.parametrize(
    ('pulses', 'shown'), [(32767, 32767), (32768, -32768), (-32768, -32768), (-32769, 32767), (65536, 0)]
)
def test_an_int16_counter_wraps_as_int16_does(pulses, shown):
    assert wrap_count(pulses, 65536) == shown


@given(st.integers(2, 10**6), st.integers(-(10**9), 10**9), st.data())
def test_differences_survive_the_wrap_in_both_directions(modulus, start, data):
    moved = data.draw(st.integers(-(modulus // 2), (modulus - 1) // 2))
    older, newer = wrap_count(start, modulus), wrap_count(start + moved, modulus)
    assert count_difference(newer, older, modulus) == moved
    assert count_difference(newer % modulus, older % modulus, modulus) == moved


@given(st.integers(-(10**12), 10**12), st.integers(-(10**6), 10**6))
def test_without_a_modulus_nothing_wraps(start, moved):
    assert count_difference(wrap_count(start + moved, 0), wrap_count(start, 0), 0) == moved


def stamps_sampled(rate, stamps):
    sampler = BoundarySampler(rate)
    return [stamp for stamp in stamps if sampler.period_index(stamp) is not None]


def test_samples_are_the_first_at_or_after_each_boundary():
    assert stamps_sampled(20, [0, 20 * MS, 40 * MS, 60 * MS, 80 * MS, 100 * MS, 120 * MS]) == [0, 60 * MS, 100 * MS]


def test_the_first_stamp_off_a_boundary_only_opens_its_period():
    assert stamps_sampled(20, [13 * MS, 33 * MS, 53 * MS, 73 * MS]) == [53 * MS]


def test_boundaries_do_not_drift_in_an_hour_of_a_rate_that_is_no_whole_period():
    stamps = range(0, 3600 * 10**9, 10**9 // 100)
    assert len(stamps_sampled(30, stamps)) == 3600 * 30


@given(st.floats(1e-3, 1e6), st.integers(0, 2 * 10**18), st.data())
def test_boundaries_are_exact_for_any_rate(rate, start_ns, data):
    steps_ns = data.draw(st.lists(st.integers(1, max(2, int(3e9 / rate))), max_size=20))
    stamps = [start_ns + sum(steps_ns[:index]) for index in range(len(steps_ns) + 1)]
    exact = Fraction(rate).limit_denominator(10**6) / 10**9
    periods = [stamp * exact // 1 for stamp in stamps]
    sampler = BoundarySampler(rate)
    assert [sampler.period_index(stamp) for stamp in stamps] == [
        period if period not in periods[:index] and (index or stamp * exact == period) else None
        for index, (stamp, period) in enumerate(zip(stamps, periods))
    ]


@given(st.lists(st.integers(1, 200), min_size=5, max_size=60))
def test_no_period_is_sampled_twice_and_none_with_a_stamp_is_left_out(steps_ms):
    stamps = [sum(steps_ms[:index]) * MS for index in range(len(steps_ms))]
    periods = [stamp // (50 * MS) for stamp in stamps_sampled(20, stamps)]
    assert periods == sorted({stamp // (50 * MS) for stamp in stamps})


def test_reports_come_at_20_hz_with_the_stamp_of_the_sample():
    encoder = DiffEncoder(EncoderParams(ppr=90))
    samples = [encoder.update(stamp * MS, NAMES, [turn(stamp, 90), turn(-stamp, 90)]) for stamp in range(0, 201, 10)]
    assert [sample for sample in samples if sample] == [
        EncoderSample(ms * MS, ms, -ms) for ms in (0, 50, 100, 150, 200)
    ]


def test_each_wheel_has_its_own_resolution():
    encoder = DiffEncoder(EncoderParams.from_mapping({'ppr': {'left': 40, 'right': 4096}}, 'test'))
    assert encoder.update(0, NAMES, [math.pi + 1e-9, math.pi + 1e-9]) == EncoderSample(0, 20, 2048)


def test_the_counter_has_the_width_that_was_asked_for():
    encoder = DiffEncoder(EncoderParams(ppr=100, counter_modulus=65536))
    assert encoder.update(0, NAMES, [turn(32768, 100), turn(-32769, 100)]) == EncoderSample(0, -32768, 32767)


def test_joints_may_come_in_any_order_among_others_and_under_any_name():
    encoder = DiffEncoder(EncoderParams(ppr=10, left_joint='l', right_joint='r'))
    names = ['arm', 'r', 'caster', 'l']
    assert encoder.update(0, names, [9.0, turn(7, 10), 9.0, turn(3, 10)]) == EncoderSample(0, 3, 7)


def test_wheels_may_come_in_separate_messages_interleaved_with_others():
    encoder = DiffEncoder(EncoderParams(ppr=10))
    samples = []
    for stamp in range(0, 151, 10):
        for offset, names in ((0, NAMES[:1]), (1, ['arm']), (2, NAMES[1:])):
            samples.append(encoder.update((stamp + offset) * MS, names, [turn(stamp, 10)]))
    # The right wheel's first message, 2 ms after a boundary, only opens its period.
    assert [sample for sample in samples if sample] == [
        EncoderSample((boundary + 2) * MS, boundary, boundary) for boundary in (50, 100, 150)
    ]


def test_a_boundary_that_one_wheel_skips_is_left_out():
    encoder = DiffEncoder(EncoderParams(ppr=10))
    for stamp in (0, 50, 100):
        assert encoder.update(stamp * MS, NAMES[:1], [turn(stamp, 10)]) is None
    assert encoder.update(0, NAMES[1:], [turn(0, 10)]) == EncoderSample(0, 0, 0)
    assert encoder.update(100 * MS, NAMES[1:], [turn(100, 10)]) == EncoderSample(100 * MS, 100, 100)


@pytest.mark.parametrize('late_by', [1, 3, 19])
def test_a_wheel_whose_messages_come_late_is_waited_for(late_by):
    encoder = DiffEncoder(EncoderParams(ppr=10))
    stamps = [index * 50 for index in range(60)]
    samples = []
    for index, stamp in enumerate(stamps):
        samples.append(encoder.update(stamp * MS, NAMES[:1], [turn(stamp, 10)]))
        if index >= late_by:
            late = stamps[index - late_by]
            samples.append(encoder.update(late * MS, NAMES[1:], [turn(-late, 10)]))
    assert [sample for sample in samples if sample] == [
        EncoderSample(stamp * MS, stamp, -stamp) for stamp in stamps[:-late_by]
    ]


def test_repeated_and_overtaken_messages_change_nothing():
    encoder = DiffEncoder(EncoderParams(ppr=10))
    assert encoder.update(1000 * MS, NAMES, [turn(1, 10)] * 2)
    assert encoder.update(1000 * MS, NAMES, [turn(99, 10)] * 2) is None
    assert encoder.update(950 * MS, NAMES, [turn(99, 10)] * 2) is None
    assert encoder.update(1050 * MS, NAMES, [turn(2, 10)] * 2) == EncoderSample(1050 * MS, 2, 2)


def test_time_that_jumps_back_restarts_with_one_warning(caplog):
    encoder = DiffEncoder(EncoderParams(ppr=10))
    encoder.update(5000 * MS, NAMES, [turn(500, 10)] * 2)
    assert encoder.update(0, NAMES, [turn(3, 10)] * 2) == EncoderSample(0, 3, 3)
    assert encoder.update(50 * MS, NAMES, [turn(4, 10)] * 2) == EncoderSample(50 * MS, 4, 4)
    assert [record.levelname for record in caplog.records] == ['WARNING']
    assert 'went back' in caplog.text


@pytest.mark.parametrize(
    ('names', 'angles', 'complaint'),
    [
        (NAMES, [math.nan, 0.0], 'left_wheel_joint.*nan'),
        (NAMES, [0.0, -math.inf], 'right_wheel_joint.*-inf'),
        (NAMES, [0.0, 1e300], 'right_wheel_joint.*1e\\+300'),
        (NAMES + NAMES[:1], [0.0, 0.0, 0.0], 'left_wheel_joint.*named 2 times'),
        (NAMES, [0.0], 'right_wheel_joint.*no position'),
        (NAMES, [], 'left_wheel_joint.*no position'),
    ],
)
def test_a_bad_message_is_refused_and_leaves_the_state(names, angles, complaint):
    encoder = DiffEncoder(EncoderParams(ppr=10))
    encoder.update(0, NAMES, [turn(1, 10)] * 2)
    with pytest.raises(InputFault, match=complaint):
        encoder.update(50 * MS, names, angles)
    assert encoder.update(50 * MS, NAMES, [turn(2, 10)] * 2) == EncoderSample(50 * MS, 2, 2)


def test_a_misspelt_joint_is_named_once_it_is_overdue():
    encoder = DiffEncoder(EncoderParams(ppr=10, left_joint='left_wheel_jiont'))
    for stamp in range(0, 1001, 50):
        assert encoder.update(stamp * MS, NAMES, [0.0, 0.0]) is None
    with pytest.raises(InputFault, match="'left_wheel_jiont' not seen.*did you mean 'left_wheel_j"):
        encoder.update(1050 * MS, NAMES, [0.0, 0.0])


def test_stamps_that_nobody_sets_are_reported():
    encoder = DiffEncoder(EncoderParams(ppr=10))
    for _ in range(100):
        encoder.update(0, NAMES, [0.0, 0.0])
    with pytest.raises(InputFault, match='stamps stand still at 0.000 s'):
        encoder.update(0, NAMES, [0.0, 0.0])
    assert encoder.update(50 * MS, NAMES, [turn(2, 10)] * 2) == EncoderSample(50 * MS, 2, 2)


@pytest.mark.parametrize(('ppr', 'label'), [(90, '90'), ({'left': 40, 'right': 4096}, '40-4096'), (102.4, '102.4')])
def test_ppr_label(ppr, label):
    assert ppr_label(EncoderParams.from_mapping({'ppr': ppr}, '').ppr) == label
