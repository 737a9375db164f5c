"""Between two looks at /clock nothing is read, and a look can be had at any time."""

import threading
import time

import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

from rosgraph_msgs.msg import Clock

from diff_encoder_sim.ros import node as room

LONG_S = 20.0


@pytest.fixture(autouse=True)
def fixture_fresh(monkeypatch):
    """A process that has not begun yet, with pauses that only a look ends."""
    for name in ('_is_wanted', '_is_pausing', '_every_tick', '_has_looked'):
        monkeypatch.setattr(room, name, threading.Event())
    monkeypatch.setattr(room, '_listeners', [])
    monkeypatch.setattr(room, 'PAUSE_S', LONG_S)


def tick():
    """A thread of rospy's that has read a tick."""
    thread = threading.Thread(target=room._take, args=(Clock(),), daemon=True)
    thread.start()
    return thread


def wait_for_pause():
    deadline_s = time.monotonic() + LONG_S
    while not room.is_clock_pausing():
        assert time.monotonic() < deadline_s
        time.sleep(0.001)


def test_after_each_tick_the_thread_pauses_until_a_look_is_wanted():
    heard = []
    room.listen_to_clock(heard.append)
    for count in (1, 2):
        thread = tick()
        wait_for_pause()
        assert len(heard) == count  # before the pause
        room.look_at_clock()
        thread.join(LONG_S)
        assert not thread.is_alive() and not room.is_clock_pausing()


def test_a_pause_ends_by_itself(monkeypatch):
    monkeypatch.setattr(room, 'PAUSE_S', 0.001)
    thread = tick()
    thread.join(LONG_S)
    assert not thread.is_alive()


def test_a_node_that_needs_every_tick_has_no_pause():
    first = tick()
    wait_for_pause()
    room.read_every_tick()
    for thread in (first, tick(), tick()):
        thread.join(LONG_S)
        assert not thread.is_alive()


def test_waiting_for_the_clock_ends_with_the_next_tick(monkeypatch):
    monkeypatch.setattr(room.rospy.rostime, 'is_wallclock', lambda: False)
    first = tick()
    wait_for_pause()
    waiting = threading.Thread(target=room.wait_for_clock, daemon=True)
    waiting.start()
    first.join(LONG_S)
    assert not first.is_alive() and waiting.is_alive()  # the pause is over, and nothing was read yet
    tick()
    waiting.join(LONG_S)
    assert not waiting.is_alive()


def test_nobody_waits_for_a_clock_that_is_not_simulated(monkeypatch):
    monkeypatch.setattr(room.rospy.rostime, 'is_wallclock', lambda: True)
    waiting = threading.Thread(target=room.wait_for_clock, daemon=True)
    waiting.start()
    waiting.join(LONG_S / 4)
    assert not waiting.is_alive()


@pytest.mark.parametrize('is_wallclock', [True, False])
def test_only_where_time_is_simulated_the_clock_is_subscribed_to(monkeypatch, is_wallclock):
    topics = []
    monkeypatch.setattr(room.rospy.rostime, 'is_wallclock', lambda: is_wallclock)
    monkeypatch.setattr(room.rospy, 'Subscriber', lambda topic, *_, **__: topics.append(topic))
    room.pause_between_ticks()
    assert topics == ([] if is_wallclock else ['/clock'])
