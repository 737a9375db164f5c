"""Stamps: possible or not; new, stale, restart."""

import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.stamps import STAMP_LIMIT_S, Step, Timeline, check_stamp

NS = 10**9


@pytest.mark.parametrize(
    ('stamp_ns', 'now_ns', 'refusal'),
    [
        (0, 5 * NS, ''),  # however old
        (15 * NS, 5 * NS, ''),
        (STAMP_LIMIT_S * NS - 1, 0, ''),  # the clock is not known
        (STAMP_LIMIT_S * NS, 0, 'allowed: below 2147483648 s'),
        (STAMP_LIMIT_S * NS, STAMP_LIMIT_S * NS, 'allowed: below 2147483648 s'),
        (17 * NS, 5 * NS, 'is 12.0 s ahead of the clock; allowed: up to 10 s'),
    ],
)
def test_a_stamp_up_to_ten_seconds_ahead_that_tf_can_hold_is_possible(stamp_ns, now_ns, refusal):
    if not refusal:
        check_stamp(stamp_ns, now_ns)
        return
    with pytest.raises(InputFault, match=refusal):
        check_stamp(stamp_ns, now_ns)


def test_stamps_are_sorted_into_new_stale_and_restart():
    timeline = Timeline(tolerance_ns=100)
    found = {stamp: timeline.advance(stamp) for stamp in (0, 50, 40, 1000, 901, 900, 899, 950)}
    assert timeline.advance(950) is Step.STALE
    stale = dict.fromkeys((40, 901, 900), Step.STALE)
    assert found == {0: Step.NEW, 50: Step.NEW, 1000: Step.NEW, **stale, 899: Step.RESTART, 950: Step.NEW}
