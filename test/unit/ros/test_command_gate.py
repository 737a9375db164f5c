"""When commands take effect."""

import logging
import threading

import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

from diff_encoder_sim.navigation.navigator_inputs import ControlRate
from diff_encoder_sim.ros.pacing import STANDSTILL, AnsweredTimes, CommandGate
from diff_encoder_sim.wheels.sampling import BoundaryTimes

MS = 1_000_000
TICK_NS, PERIOD_NS, DELAY_NS = 10 * MS, 50 * MS, 20 * MS
LONG_S, SHORT_S = 20.0, 0.01
SLOW, FAST = (0.1, 0.0), (0.2, 0.0)


def answered_times(report_hz=20.0, control_hz=20.0):
    return AnsweredTimes(BoundaryTimes(report_hz, TICK_NS), 1.0 / control_hz)


def gate(is_periodic=True, patience_s=SHORT_S, is_expected=True, is_from_start=True):
    times = answered_times() if is_periodic else None
    return CommandGate(times, DELAY_NS, patience_s, lambda: is_expected, is_from_start)


def take_in_thread(some_gate, sim_time_ns):
    """A take that is waiting: (thread, list that its result goes to)."""
    taken = []
    thread = threading.Thread(target=lambda: taken.append(some_gate.take(sim_time_ns)), daemon=True)
    thread.start()
    return thread, taken


def test_without_a_period_the_newest_command_is_taken_at_once_and_once():
    free = gate(is_periodic=False)
    assert free.take(0) is None
    free.put(SLOW)
    free.put(FAST)
    assert free.take(10 * MS) == FAST
    assert free.take(20 * MS) is None


def test_with_a_period_commands_take_effect_a_delay_after_each_boundary_only():
    periodic = gate()
    times_ns = []
    for tick in range(20):
        periodic.put(SLOW)
        if periodic.take(tick * 10 * MS) is not None:
            times_ns.append(tick * 10)
    assert times_ns == [20, 70, 120, 170]


def test_a_controller_is_waited_for():
    patient = gate(patience_s=LONG_S)
    thread, taken = take_in_thread(patient, DELAY_NS)
    thread.join(0.05)
    assert thread.is_alive()  # nothing has come
    patient.put(SLOW)
    thread.join(LONG_S)
    assert taken == [SLOW]


def test_nobody_is_waited_for_where_no_controller_is_connected():
    lonely = gate(patience_s=LONG_S, is_expected=False)
    thread, taken = take_in_thread(lonely, DELAY_NS)
    thread.join(0.5 * LONG_S)
    assert taken == [None]


def test_patience_ends_with_one_warning_until_the_controller_is_back(caplog):
    periodic = gate()
    periodic.put(SLOW)
    assert periodic.take(DELAY_NS) == SLOW
    with caplog.at_level(logging.WARNING):
        for period in range(1, 4):
            assert periodic.take(DELAY_NS + period * PERIOD_NS) is None
    assert len(caplog.records) == 1  # only the first was waited for
    assert '0.07 s' in caplog.records[0].getMessage()
    periodic.put(FAST)
    assert periodic.take(DELAY_NS + 4 * PERIOD_NS) == FAST
    with caplog.at_level(logging.WARNING):
        assert periodic.take(DELAY_NS + 5 * PERIOD_NS) is None
    assert len(caplog.records) == 2  # it was waited for again


def test_a_robot_at_rest_is_not_waited_with_for_long(caplog):
    """Between two goals nobody commands; the full patience would stall the simulation."""
    resting = gate(patience_s=LONG_S, is_from_start=False)
    resting.put(STANDSTILL)
    assert resting.take(DELAY_NS) == STANDSTILL
    thread, taken = take_in_thread(resting, DELAY_NS + PERIOD_NS)
    thread.join(0.5 * LONG_S)
    assert taken == [None]
    assert caplog.records == []


def test_a_controller_that_starts_later_is_not_waited_for_at_the_start():
    late = gate(patience_s=LONG_S, is_from_start=False)
    thread, taken = take_in_thread(late, DELAY_NS)
    thread.join(0.5 * LONG_S)
    assert taken == [None]


def test_clear_forgets_what_has_not_taken_effect():
    periodic = gate()
    periodic.put(SLOW)
    periodic.clear()
    assert periodic.take(DELAY_NS) is None


# ---- at other rates than 20 Hz


@pytest.mark.parametrize('control_hz', [5.0, 10.0, 20.0, 33.3, 50.0, 100.0])
@pytest.mark.parametrize('report_hz', [7.0, 10.0, 15.0, 20.0, 33.3, 50.0, 100.0, 200.0])
def test_a_controller_at_any_rate_is_never_waited_for_in_vain(report_hz, control_hz, caplog):
    """It answers each report that its own rate picks, at once, or two ticks later: time has to wait for neither."""
    reports = BoundaryTimes(report_hz, TICK_NS)
    for lag_ns in (0, DELAY_NS):
        control = ControlRate(control_hz)
        rated = CommandGate(answered_times(report_hz, control_hz), DELAY_NS, SHORT_S, lambda: True, True)
        answers = []  # times at which the command is sent
        for now_ns in range(0, 3000 * MS, TICK_NS):
            if reports.newest_ns(now_ns) == now_ns and control.is_due(now_ns):
                answers.append(now_ns + lag_ns)
            while answers and answers[0] <= now_ns:
                answers.pop(0)
                rated.put(FAST)
            rated.take(now_ns)
    assert caplog.records == []


@pytest.mark.parametrize('report_hz', [7.0, 10.0, 15.0, 20.0, 33.3, 50.0, 100.0, 200.0])
def test_a_command_takes_effect_two_ticks_after_the_report_that_it_answers(report_hz):
    times, control = answered_times(report_hz), ControlRate(20.0)
    reports = BoundaryTimes(report_hz, TICK_NS)
    rated = CommandGate(times, DELAY_NS, LONG_S, lambda: True, True)
    sent_ns, taken_ns = [], []
    for now_ns in range(0, 2000 * MS, TICK_NS):
        if reports.newest_ns(now_ns) == now_ns and control.is_due(now_ns):
            sent_ns.append(now_ns)
            rated.put((float(now_ns), 0.0))
        command = rated.take(now_ns)
        if command is not None:
            taken_ns.append(now_ns)
            assert command[0] == now_ns - DELAY_NS
    assert taken_ns == [stamp_ns + DELAY_NS for stamp_ns in sent_ns if stamp_ns + DELAY_NS < 2000 * MS]


def test_after_a_reset_the_first_report_is_answered_again():
    periodic = gate()
    for now_ns in range(0, 130 * MS, TICK_NS):
        periodic.put(SLOW)
        periodic.take(now_ns)
    periodic.clear()
    periodic.put(FAST)
    assert periodic.take(0) is None
    assert periodic.take(DELAY_NS) == FAST
