"""Both encoders behind one motor controller: its reports at 20 Hz of stamps, and bad messages."""

import math

import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.wheels.report_link import EncoderSample
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder

NAMES = ['left_wheel_joint', 'right_wheel_joint']
MS = 1_000_000


def turn(pulses, ppr):
    """Angle [rad] in the middle of a pulse."""
    return 2 * math.pi * (pulses + 0.5) / ppr


def test_reports_come_at_20_hz_with_the_stamp_of_the_sample():
    encoder = ReportingEncoder(EncoderParams(ppr=90))
    samples = []
    for stamp in range(0, 201, 10):
        samples += encoder.update(stamp * MS, NAMES, [turn(stamp, 90), turn(-stamp, 90)])
    assert samples == [EncoderSample(ms * MS, ms, -ms) for ms in (0, 50, 100, 150, 200)]


@pytest.mark.parametrize(
    ('params', 'names', 'pulses', 'counts'),
    [
        ({'counter_modulus': 65536}, NAMES, (32768, -32769), (-32768, 32767)),
        ({'left_joint': 'l', 'right_joint': 'r'}, ['arm', 'r', 'caster', 'l'], (9, 7, 9, 3), (3, 7)),
    ],
)
def test_counters_have_their_width_and_joints_any_name_and_order(params, names, pulses, counts):
    encoder = ReportingEncoder(EncoderParams(ppr=10, **params))
    assert encoder.update(0, names, [turn(each, 10) for each in pulses]) == (EncoderSample(0, *counts),)


def test_a_joint_whose_angle_falls_counts_up_when_the_robot_drives_forward():
    encoder = ReportingEncoder(EncoderParams(ppr=10, right_reversed=True))
    for stamp, pulses in enumerate((0, 3, -4)):
        sample = encoder.update(stamp * 50 * MS, NAMES, [turn(pulses, 10), -turn(pulses, 10)])
        assert sample == (EncoderSample(stamp * 50 * MS, pulses, pulses),)


def test_wheels_may_come_in_separate_messages_interleaved_with_others():
    encoder = ReportingEncoder(EncoderParams(ppr=10))
    samples = []
    for stamp in range(0, 151, 10):
        for offset, names in ((0, NAMES[:1]), (1, ['arm']), (2, NAMES[1:])):
            samples += encoder.update((stamp + offset) * MS, names, [turn(stamp + offset, 10)])
    # The right wheel's first message, 2 ms after a boundary, only opens a period.
    assert samples == [EncoderSample(boundary * MS, boundary, boundary) for boundary in (50, 100, 150)]


@pytest.mark.parametrize('late_by', [1, 3, 19])
def test_a_wheel_whose_messages_come_late_is_waited_for(late_by):
    encoder = ReportingEncoder(EncoderParams(ppr=10))
    stamps = [index * 50 for index in range(60)]
    samples = []
    for index, stamp in enumerate(stamps):
        samples += encoder.update(stamp * MS, NAMES[:1], [turn(stamp, 10)])
        if index >= late_by:
            late = stamps[index - late_by]
            samples += encoder.update(late * MS, NAMES[1:], [turn(-late, 10)])
    assert samples == [EncoderSample(stamp * MS, stamp, -stamp) for stamp in stamps[:-late_by]]


@pytest.mark.parametrize('messages', [[NAMES], [NAMES[:1], NAMES[1:]]])
def test_time_that_jumps_back_restarts_with_one_warning(messages, caplog):
    encoder, samples, stamps_ms = ReportingEncoder(EncoderParams(ppr=10)), [], (5000, 5050, 0, 50, 100)
    for stamp in stamps_ms:
        for names in messages:
            samples += encoder.update(stamp * MS, names, [turn(stamp, 10)] * len(names))
    assert samples == [EncoderSample(stamp * MS, stamp, stamp) for stamp in stamps_ms]
    assert [record.levelname for record in caplog.records] == ['WARNING']
    assert 'went back' in caplog.text


@pytest.mark.parametrize(
    ('names', 'angles', 'complaint'),
    [(NAMES, [math.nan, 0.0], 'left_wheel_joint.*nan'), (NAMES, [0.0], 'right_wheel_joint.*nan')],
)
def test_a_bad_message_is_refused_and_leaves_the_state(names, angles, complaint):
    encoder = ReportingEncoder(EncoderParams(ppr=10))
    encoder.update(0, NAMES, [turn(1, 10)] * 2)
    with pytest.raises(InputFault, match=complaint):
        encoder.update(50 * MS, names, angles)
    assert encoder.update(50 * MS, NAMES, [turn(2, 10)] * 2) == (EncoderSample(50 * MS, 2, 2),)


def test_a_misspelt_joint_is_named_once_it_is_overdue():
    encoder = ReportingEncoder(EncoderParams(ppr=10, left_joint='left_wheel_jiont'))
    for stamp in range(0, 1001, 50):
        assert encoder.update(stamp * MS, NAMES, [0.0, 0.0]) == ()
    with pytest.raises(InputFault, match="'left_wheel_jiont' not seen.*did you mean 'left_wheel_j"):
        encoder.update(1050 * MS, NAMES, [0.0, 0.0])


def test_stamps_that_no_node_sets_are_reported():
    encoder = ReportingEncoder(EncoderParams(ppr=10))
    for _ in range(100):
        encoder.update(0, NAMES, [0.0, 0.0])
    with pytest.raises(InputFault, match=r'stamps do not advance: 0\.000 s'):
        encoder.update(0, NAMES, [0.0, 0.0])
