"""Stamps: possible or not; new, stale, restart."""

import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.stamps import STAMP_LIMIT_S, Step, Timeline, check_stamp

NS = 10**9


@pytest.mark.parametrize(
    ('stamp_ns', 'now_ns'),
    [
        (0, 0),
        (0, 5 * NS),  # however old
        (15 * NS, 5 * NS),
        (STAMP_LIMIT_S * NS - 1, 0),  # the clock is not known
        (STAMP_LIMIT_S * NS - 1, (STAMP_LIMIT_S - 1) * NS),
    ],
)
def test_a_stamp_up_to_ten_seconds_ahead_that_tf_can_hold_is_possible(stamp_ns, now_ns):
    check_stamp(stamp_ns, now_ns)


@pytest.mark.parametrize('now_ns', [0, 5 * NS, 2**32 * NS - 1])
@pytest.mark.parametrize('stamp_ns', [STAMP_LIMIT_S * NS, 2**32 * NS - 1])
def test_a_stamp_that_tf_cannot_hold_is_refused_whatever_the_clock(stamp_ns, now_ns):
    with pytest.raises(InputFault, match=r'^stamp \d+\.\d{3} s; allowed: below 2147483648 s'):
        check_stamp(stamp_ns, now_ns)


def test_a_stamp_farther_ahead_of_the_clock_is_refused():
    with pytest.raises(InputFault, match=r'^stamp 17\.000 s is 12\.0 s ahead of the clock; allowed: up to 10 s$'):
        check_stamp(17 * NS, 5 * NS)
    with pytest.raises(InputFault, match='up to 1 s$'):
        check_stamp(7 * NS, 5 * NS, most_ahead_s=1.0)


def test_stamps_are_sorted_into_new_stale_and_restart():
    timeline = Timeline(tolerance_ns=100)
    given = [0, 50, 50, 40, 1000, 901, 900, 899, 950]
    assert [timeline.advance(stamp) for stamp in given] == [
        Step.NEW,
        Step.NEW,
        Step.STALE,
        Step.STALE,
        Step.NEW,
        Step.STALE,
        Step.STALE,
        Step.RESTART,
        Step.NEW,
    ]
    assert timeline.newest_ns == 950
