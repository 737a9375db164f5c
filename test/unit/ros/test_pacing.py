"""How long simulated time waits for topics and commands, and when commands take effect."""

import io
import logging
import time
from types import SimpleNamespace

import pytest
from geometry_msgs.msg import Twist, Vector3
from rospy import AnyMsg
from std_msgs.msg import Header

from diff_encoder_sim.navigation.navigator_inputs import STOP, ControlRate
from diff_encoder_sim.ros import pacing
from diff_encoder_sim.ros.messages import stamp_from_ns
from diff_encoder_sim.ros.pacing import CommandGate, ExpectedStamps, GraphPacer, WallPacer
from diff_encoder_sim.wheels.report_link import BoundarySampler

MS = 1_000_000
TICK_NS, PERIOD_NS, DELAY_NS, SCAN_NS, END_NS = 10 * MS, 50 * MS, 20 * MS, 100 * MS, 3000 * MS
RATES_HZ = [7.0, 20.0, 33.3, 100.0, 200.0]
LONG_S, SHORT_S = 20.0, 0.01
SLOW, FAST = (0.1, 0.0), (0.2, 0.0)

# ---- topics


@pytest.fixture
def topics(monkeypatch):
    """Callbacks by topic of all pacers made in a test: call them with a stamp."""
    callbacks = {}

    def subscribe(topic, _, callback, callback_args, tcp_nodelay):
        def come(stamp_ns):
            buffer = io.BytesIO()
            Header(stamp=stamp_from_ns(stamp_ns)).serialize(buffer)
            callback(AnyMsg().deserialize(buffer.getvalue()), callback_args)

        callbacks[topic] = come

    monkeypatch.setattr(pacing.rospy, 'Subscriber', subscribe)
    monkeypatch.setattr(pacing, 'LONGEST_WAIT_S', SHORT_S)
    return callbacks


def every_50_ms(time_ns):
    return time_ns // PERIOD_NS * PERIOD_NS


def test_a_topic_that_does_not_come_is_warned_of_once_and_waited_for_again_when_it_is_back(topics, caplog):
    pacer = GraphPacer(dict.fromkeys(['/odom', '/global_pose'], every_50_ms), ['/odom'])
    for time_ms in range(-50, 160, 10):  # negative stamps are not waited for
        if time_ms % 50 == 0 and time_ms >= 0:
            topics['/odom'](time_ms * MS)
        if time_ms == 0:
            topics['/global_pose'](0)
        pacer.wait(time_ms * MS)
    assert [record.args[:2] for record in caplog.records] == [('/global_pose', 0.05)]
    topics['/global_pose'](150 * MS)
    topics['/odom'](200 * MS)
    pacer.wait(200 * MS)
    assert len(caplog.records) == 2
    pacer.restart()  # stamps of before do not count
    pacer.wait(0)
    assert [record.args[0] for record in caplog.records][2:] == ['/odom']


def test_unless_the_graph_starts_in_a_pause_a_topic_is_waited_for_from_its_first_message(topics, caplog):
    pacer = GraphPacer({'/odom': every_50_ms}, [])
    for time_ns in (0, PERIOD_NS):
        pacer.wait(time_ns)
    assert caplog.records == []
    topics['/odom'](0)
    pacer.wait(100 * MS)
    assert len(caplog.records) == 1


@pytest.mark.parametrize(
    ('factor', 'waits', 'slept_s'),
    [
        (1.0, [(1.2, 500)], 0.3),
        (2.0, [(1.2, 400)], 0.0),
        (0.0, [(1.0, 500)], 0.0),
        (1.0, [(6.0, 100), (6.0, 110)], 0.01),  # lost time is not caught up with
    ],
)
def test_simulated_time_keeps_its_factor_of_wall_time(monkeypatch, factor, waits, slept_s):
    slept, clock = [], [1.0]
    monkeypatch.setattr(pacing.time, 'monotonic', lambda: clock[0])

    def sleep(seconds):
        slept.append(seconds)
        clock[0] += seconds

    monkeypatch.setattr(pacing.time, 'sleep', sleep)
    pacer = WallPacer(factor)
    pacer.restart(0)
    for now_s, time_ms in waits:
        clock[0] = now_s
        pacer.wait(time_ms * MS)
    assert sum(slept) == pytest.approx(slept_s) and max(slept, default=0.0) <= pacing.LONGEST_SLEEP_S


# ---- the stamps that are expected


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
def test_reports_are_waited_for_only_when_they_can_have_come(delay_ms):
    prompt, late = ExpectedStamps(20.0, SCAN_NS), ExpectedStamps(20.0, SCAN_NS, delay_ms * MS)
    for time_ns in range(1000 * MS, END_NS, TICK_NS):
        assert late.report_before(time_ns) == prompt.report_before(time_ns - delay_ms * MS)
        assert late.report_before(time_ns) + delay_ms * MS < time_ns
        assert late.scan_before(time_ns) <= late.reports.newest_ns(time_ns - delay_ms * MS)
        assert late.state_before(time_ns) == prompt.state_before(time_ns)


@pytest.mark.parametrize('rate_hz', RATES_HZ)
def test_a_scan_is_waited_for_when_it_has_its_odometry_and_before_there_is_newer(rate_hz):
    expected, stamps = ExpectedStamps(rate_hz, SCAN_NS), reports(rate_hz)
    assert expected.scan_before(40 * MS) < 0  # the laser's frame is not known yet
    for time_ns in range(50 * MS, END_NS - 300 * MS, TICK_NS):
        scan_ns = expected.scan_before(time_ns)
        published = [stamp_ns for stamp_ns in stamps if stamp_ns < time_ns]  # time_ns itself is yet to come
        if scan_ns >= 0:
            assert scan_ns % SCAN_NS == 0 and any(stamp_ns >= scan_ns for stamp_ns in published)
        for unanswered_ns in range(max(scan_ns, -SCAN_NS) + SCAN_NS, time_ns, SCAN_NS):
            newer = [stamp_ns for stamp_ns in stamps if unanswered_ns <= stamp_ns <= time_ns]
            assert len(newer) <= 1  # that which it is placed by


# ---- commands


class FedGate(CommandGate):
    """A gate whose controller sends commands by a call."""

    def put(self, command):
        self._on_command(Twist(Vector3(x=command[0]), Vector3(z=command[1])))


@pytest.fixture(name='gate')
def fixture_gate(monkeypatch):
    def gate(report_hz=20.0, control_hz=20.0, patience_s=SHORT_S, is_expected=True, is_from_start=True):
        commands = SimpleNamespace(get_num_connections=lambda: int(is_expected))
        monkeypatch.setattr(pacing.rospy, 'Subscriber', lambda *_, **__: commands)
        monkeypatch.setattr(pacing, 'LONGEST_WAIT_S', patience_s)
        period_s = 1.0 / control_hz if control_hz else 0.0
        return FedGate(BoundarySampler(report_hz, TICK_NS), period_s, is_from_start)

    return gate


def test_without_a_period_the_newest_command_is_taken_at_once_and_once(gate):
    free = gate(control_hz=0.0)
    for command in (SLOW, FAST):
        free.put(command)
    assert [free.take(time_ns) for time_ns in (10 * MS, 20 * MS)] == [FAST, None]


@pytest.mark.parametrize(
    ('options', 'before'),
    [
        ({'is_expected': False}, None),
        ({'is_from_start': False}, None),  # one that starts later
        ({'is_from_start': False}, STOP),  # has nothing to do between two goals
    ],
)
def test_a_robot_at_rest_does_not_stall_the_simulation(gate, options, before, caplog):
    resting, begun_s = gate(patience_s=LONG_S, **options), time.monotonic()
    if before is not None:
        resting.put(before)
        assert resting.take(DELAY_NS) == before
    assert resting.take(DELAY_NS + (PERIOD_NS if before else 0)) is None
    assert time.monotonic() - begun_s < 0.5 * LONG_S and caplog.records == []


def test_patience_ends_with_one_warning_until_the_controller_is_back(gate, caplog):
    periodic = gate()
    periodic.put(SLOW)
    assert periodic.take(DELAY_NS) == SLOW
    with caplog.at_level(logging.WARNING):
        for period in range(1, 4):
            assert periodic.take(DELAY_NS + period * PERIOD_NS) is None
    assert [record.args[1] for record in caplog.records] == [0.07]  # only the first was waited for
    periodic.put(FAST)
    assert periodic.take(DELAY_NS + 4 * PERIOD_NS) == FAST
    assert periodic.take(DELAY_NS + 5 * PERIOD_NS) is None
    assert len(caplog.records) == 2  # it was waited for again


@pytest.mark.parametrize('control_hz', [5.0, 20.0, 33.3, 100.0])
@pytest.mark.parametrize('report_hz', RATES_HZ)
@pytest.mark.parametrize('lag_ns', [0, DELAY_NS])
def test_a_command_takes_effect_two_ticks_after_the_report_that_it_answers(gate, report_hz, control_hz, lag_ns, caplog):
    """A controller at any rate answers each report that its own rate picks, at once, or two ticks later."""
    times, control, rated = BoundarySampler(report_hz, TICK_NS), ControlRate(control_hz), gate(report_hz, control_hz)
    answered_ns, delays_ns = [], []
    for now_ns in range(0, 2000 * MS, TICK_NS):
        if times.newest_ns(now_ns) == now_ns and control.is_due(now_ns):
            answered_ns.append(now_ns)
        while answered_ns and answered_ns[0] + lag_ns <= now_ns:
            rated.put((float(answered_ns.pop(0)), 0.0))
        command = rated.take(now_ns)
        if command is not None:
            delays_ns.append(now_ns - command[0])
    assert caplog.records == []  # it was not waited for in vain
    assert set(delays_ns) == {DELAY_NS} or control_hz > 20.0  # then a newer one may have come


def test_after_a_reset_the_first_report_is_answered_again(gate):
    periodic = gate()
    for now_ns in range(0, 130 * MS, TICK_NS):
        periodic.put(SLOW)
        periodic.take(now_ns)
    periodic.clear()
    periodic.put(FAST)
    assert [periodic.take(0), periodic.take(DELAY_NS)] == [None, FAST]
