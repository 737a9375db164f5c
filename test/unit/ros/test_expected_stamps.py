"""What simulated time waits for: at any rate, only for what has been published, and for all of it."""

import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

from diff_encoder_sim.ros.pacing import AnsweredTimes, ExpectedStamps
from diff_encoder_sim.wheels.sampling import BoundarySampler

MS = 1_000_000
TICK_NS, SCAN_NS, END_NS = 10 * MS, 100 * MS, 3000 * MS
RATES_HZ = [7.0, 10.0, 15.0, 20.0, 33.3, 50.0, 100.0, 200.0]


def reports(rate_hz):
    sampler = BoundarySampler(rate_hz)
    return [stamp_ns for stamp_ns in range(0, END_NS, TICK_NS) if sampler.period_index(stamp_ns) is not None]


@pytest.mark.parametrize('rate_hz', RATES_HZ)
def test_time_is_at_most_two_ticks_past_a_report_that_is_not_answered(rate_hz):
    expected, stamps = ExpectedStamps(rate_hz, SCAN_NS), reports(rate_hz)
    for time_ns in range(TICK_NS, END_NS, TICK_NS):
        due = [stamp_ns for stamp_ns in stamps if stamp_ns <= time_ns - 2 * TICK_NS]
        assert max(due, default=-1) == max(expected.report_before(time_ns), -1)


@pytest.mark.parametrize('delay_ms', [10, 45, 130])
def test_reports_and_what_they_place_are_waited_for_only_when_they_can_have_come(delay_ms):
    prompt, late = ExpectedStamps(20.0, SCAN_NS), ExpectedStamps(20.0, SCAN_NS, delay_ms * MS)
    for time_ns in range(1000 * MS, END_NS, TICK_NS):
        assert late.report_before(time_ns) == prompt.report_before(time_ns - delay_ms * MS)
        assert late.report_before(time_ns) + delay_ms * MS < time_ns
        assert late.scan_before(time_ns) <= late.reports.newest_ns(time_ns - delay_ms * MS)
        assert late.state_before(time_ns) == prompt.state_before(time_ns)


@pytest.mark.parametrize('rate_hz', RATES_HZ)
def test_a_scan_is_waited_for_when_it_has_its_odometry_and_before_there_is_newer(rate_hz):
    expected, stamps = ExpectedStamps(rate_hz, SCAN_NS), reports(rate_hz)
    for time_ns in range(50 * MS, END_NS - 300 * MS, TICK_NS):
        scan_ns = expected.scan_before(time_ns)
        published = [stamp_ns for stamp_ns in stamps if stamp_ns < time_ns]  # time_ns itself is yet to come
        if scan_ns >= 0:
            assert scan_ns % SCAN_NS == 0 and any(stamp_ns >= scan_ns for stamp_ns in published)
        for unanswered_ns in range(max(scan_ns, -SCAN_NS) + SCAN_NS, time_ns, SCAN_NS):
            newer = [stamp_ns for stamp_ns in stamps if unanswered_ns <= stamp_ns <= time_ns]
            assert len(newer) <= 1  # that which it is placed by


def test_at_20_hz_all_is_as_it_was_with_50_ms_fixed():
    expected = ExpectedStamps(20.0, SCAN_NS)
    for time_ns in range(TICK_NS, END_NS, TICK_NS):
        for before, lead_ns, period_ns in (
            (expected.report_before, 20 * MS, 50 * MS),
            (expected.state_before, 20 * MS, 50 * MS),
            (expected.scan_before, 50 * MS, SCAN_NS),
        ):
            assert max(before(time_ns), -1) == max((time_ns - lead_ns) // period_ns * period_ns, -1)


def test_nothing_is_waited_for_before_the_lasers_frame_is_known():
    assert all(ExpectedStamps(rate_hz, SCAN_NS).scan_before(40 * MS) < 0 for rate_hz in RATES_HZ)


@pytest.mark.parametrize(
    ('report_hz', 'control_hz', 'expected_ms'),
    [
        (20.0, 20.0, [0, 50, 100, 150, 200, 250]),
        (10.0, 20.0, [0, 100, 200]),
        (50.0, 20.0, [0, 40, 80, 140, 180, 240, 280]),  # as ControlRate picks
        (100.0, 10.0, [0, 50, 150, 250]),
    ],
)
def test_a_controller_answers_the_reports_that_its_rate_picks(report_hz, control_hz, expected_ms):
    times = AnsweredTimes(ExpectedStamps(report_hz, SCAN_NS).reports, 1.0 / control_hz)
    for _ in range(2):
        answered = [time_ns // MS for time_ns in range(0, 300 * MS, TICK_NS) if times.is_answered(time_ns)]
        assert answered == expected_ms
        times.restart()
