"""Counts and speeds of a report find each other, whichever comes first; nothing waits for long in vain."""

import random

import pytest

from diff_encoder_sim.wheels.report_link import EncoderSample
from diff_encoder_sim.wheels.speed_pairing import SpeedPairing

PERIOD_NS = 50_000_000


def counts(index):
    return EncoderSample(index * PERIOD_NS, index, -index)


def whole(index):
    return counts(index)._replace(wheel_rates_radps=(float(index), -float(index)))


def take(pairing, words):
    """What is released, by words such as c3 or s3: counts or speeds of report 3."""
    released = []
    for word in words.split():
        report = whole(int(word[1:]))
        if word[0] == 'c':
            released += pairing.take_counts(report._replace(wheel_rates_radps=None), report.stamp_ns * 1e-9)
        else:
            released += pairing.take_speeds(report.stamp_ns, report.wheel_rates_radps)
    return released


def test_in_any_interleaving_of_the_topics_each_report_is_whole_and_in_order():
    for seed in range(200):
        rng, pairing, released = random.Random(seed), SpeedPairing(), []
        at = {'c': 0, 's': 0}
        while min(at.values()) < 40:
            ahead = at['c'] - at['s']
            kind = 's' if ahead >= 9 else 'c' if ahead <= -9 else rng.choice('cs')
            released += take(pairing, f'{kind}{at[kind]}')
            at[kind] += 1
        assert released == [whole(index) for index in range(40)][: len(released)] and len(released) >= 40


@pytest.mark.parametrize(
    ('words', 'expected'),
    [
        ('c0 s0 c1 c2 s2 c3 s3', [whole(0), counts(1), whole(2), whole(3)]),  # speeds of 1 are lost
        ('s0 c0 s1 s2 c2 s3 c3', [whole(0), whole(2), whole(3)]),  # counts of 1 are lost
        ('c0 s0 c1 s1 c0 s0 c2 s2', [whole(0), whole(1), whole(0), whole(2)]),  # 0 comes twice
        ('s0 c0 s2 c2 s1 c1 s3 c3', [whole(0), whole(2), whole(1), whole(3)]),  # 1 comes after 2
        *(
            (f's100 c100{rest} {again}', [whole(100), *left, whole(0), whole(1)])  # time jumps back
            for rest, left in (('', []), (' s103', []), (' c103', []))
            for again in ('c0 s0 c1 s1', 's0 c0 s1 c1')
        ),
    ],
)
def test_lost_repeated_and_late_reports_keep_their_speeds(words, expected):
    found = take(SpeedPairing(), words)
    assert found[:1] + found[-len(expected) + 1 :] == expected


def test_if_speeds_never_come_reports_wait_once(caplog):
    """Half a second, which at 20 Hz are ten reports."""
    pairing = SpeedPairing()
    assert take(pairing, ' '.join(f'c{index}' for index in range(11))) == []
    assert take(pairing, 'c11') == [counts(index) for index in range(12)]
    assert take(pairing, 'c12 c13') == [counts(12), counts(13)]
    assert [record.levelname for record in caplog.records] == ['WARNING']
    assert take(pairing, 's13 c14 s14 c15 s15') == [whole(14), whole(15)]
