"""How long simulated time waits for topics: no longer than it must, and of what does not come with one warning."""

import io
import logging
import threading

import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

from std_msgs.msg import Header

from diff_encoder_sim.ros import pacing
from diff_encoder_sim.ros.conversions import stamp_from_ns
from diff_encoder_sim.ros.pacing import GraphPacer, WallPacer

MS = 1_000_000
LONG_S = 20.0


class Message:
    """What rospy gives for AnyMsg: the bytes as they came."""

    def __init__(self, stamp_ns):
        buffer = io.BytesIO()
        Header(stamp=stamp_from_ns(stamp_ns)).serialize(buffer)
        self._buff = buffer.getvalue()


@pytest.fixture
def topics(monkeypatch):
    """Callbacks by topic of all pacers made in a test: call them with a stamp."""
    callbacks = {}

    def subscribe(topic, _, callback, callback_args, tcp_nodelay):
        callbacks[topic] = lambda stamp_ns: callback(Message(stamp_ns), callback_args)

    monkeypatch.setattr(pacing.rospy, 'Subscriber', subscribe)
    monkeypatch.setattr(pacing, 'LONGEST_WAIT_S', 0.01)
    return callbacks


def every_50_ms(time_ns):
    return time_ns // (50 * MS) * 50 * MS


def test_time_runs_while_every_topic_has_come_to_what_is_expected(topics, caplog):
    pacer = GraphPacer(['/odom'], every_50_ms, topics_once_begun=['/global_pose'])
    for stamp_ns in range(0, 500 * MS, 50 * MS):
        topics['/odom'](stamp_ns)
        pacer.wait(stamp_ns + 49 * MS)
    assert caplog.records == []  # /global_pose has not begun


def test_a_topic_is_waited_for_until_it_comes(topics, monkeypatch):
    monkeypatch.setattr(pacing, 'LONGEST_WAIT_S', LONG_S)
    pacer = GraphPacer(['/odom'], every_50_ms)
    topics['/odom'](0)
    waiting = threading.Thread(target=pacer.wait, args=(50 * MS,), daemon=True)
    waiting.start()
    waiting.join(0.05)
    assert waiting.is_alive()
    topics['/odom'](50 * MS)
    waiting.join(LONG_S)
    assert not waiting.is_alive()


def test_one_that_does_not_come_is_warned_of_once_and_waited_for_again_when_it_is_back(topics, caplog):
    caplog.set_level(logging.WARNING)
    pacer = GraphPacer(['/odom'], every_50_ms, topics_once_begun=['/global_pose'])
    topics['/odom'](0)
    topics['/global_pose'](0)
    for time_ns in (50 * MS, 100 * MS, 150 * MS):
        topics['/odom'](time_ns)
        pacer.wait(time_ns)
    assert [record.getMessage().split(':')[0] for record in caplog.records] == ['/global_pose']
    assert '0.05 s' in caplog.records[0].getMessage()
    topics['/global_pose'](150 * MS)
    topics['/odom'](200 * MS)
    pacer.wait(200 * MS)
    assert len(caplog.records) == 2


def test_after_a_reset_stamps_of_before_do_not_count(topics, caplog):
    pacer = GraphPacer(['/odom'], every_50_ms)
    topics['/odom'](500 * MS)
    pacer.restart()
    pacer.wait(0)
    assert len(caplog.records) == 1


def test_where_time_starts_before_the_graph_a_topic_is_waited_for_from_its_first_message(topics, caplog):
    pacer = GraphPacer(['/odom'], every_50_ms, is_from_start=False)
    for time_ns in (0, 50 * MS):
        pacer.wait(time_ns)
    pacer.restart()
    pacer.wait(0)
    assert caplog.records == []
    topics['/odom'](0)
    pacer.wait(50 * MS)
    assert len(caplog.records) == 1


@pytest.mark.parametrize(('factor', 'now_s', 'slept_s'), [(1.0, 1.2, 0.3), (2.0, 1.2, None), (0.0, 1.0, None)])
def test_simulated_time_keeps_its_factor_of_wall_time(monkeypatch, factor, now_s, slept_s):
    slept, clock = [], [1.0]
    monkeypatch.setattr(pacing.time, 'monotonic', lambda: clock[0])
    monkeypatch.setattr(pacing.time, 'sleep', slept.append)
    pacer = WallPacer(factor)
    pacer.restart(0)
    clock[0] = now_s
    pacer.wait(500 * MS if factor != 2.0 else 400 * MS)
    assert slept == ([] if slept_s is None else pytest.approx([slept_s]))


def test_lost_time_is_given_up_and_not_caught_up_with(monkeypatch):
    slept, clock = [], [1.0]
    monkeypatch.setattr(pacing.time, 'monotonic', lambda: clock[0])
    monkeypatch.setattr(pacing.time, 'sleep', slept.append)
    pacer = WallPacer(1.0)
    pacer.restart(0)
    clock[0] = 6.0
    pacer.wait(100 * MS)
    assert slept == []
    pacer.wait(110 * MS)
    assert slept == pytest.approx([0.01])
