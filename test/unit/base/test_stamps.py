"""Stamps: new, stale, restart."""

from diff_encoder_sim.base.stamps import Step, Timeline


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


def test_a_stale_stamp_does_not_move_the_newest():
    timeline = Timeline(tolerance_ns=10)
    timeline.advance(100)
    timeline.advance(95)
    assert timeline.newest_ns == 100
