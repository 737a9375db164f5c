"""Reading /clock now and then, in place of waking up for each of its ticks.

rospy reads each tick as it comes, in a thread of each node: at rtf:=0 that was a third of what the graph cost. Between
two looks the ticks wait in the socket, and the newest of them is taken: the clock is late by at most PAUSE_S of wall
time. docs/adr/0033-live-graph.md
"""

from __future__ import annotations

import threading
from typing import Callable, List

import rospy
from rosgraph_msgs.msg import Clock

PAUSE_S = 0.02  # of wall time

_listeners: List[Callable[[Clock], None]] = []
_is_wanted = threading.Event()
_is_pausing = threading.Event()
_every_tick = threading.Event()
_has_looked = threading.Event()


def pause_between_ticks() -> None:
    """Begin, where time is simulated: rospy's own thread of /clock pauses after each look."""
    if not rospy.rostime.is_wallclock():
        # Shares rospy's connection, and its queue of one.
        rospy.Subscriber('/clock', Clock, _take, tcp_nodelay=True)


def listen_to_clock(listener: Callable[[Clock], None]) -> None:
    """Call back with what each look finds, before the pause."""
    _listeners.append(listener)


def read_every_tick() -> None:
    """Make no pauses: the node needs the clock as it comes."""
    _every_tick.set()
    look_at_clock()


def read_now_and_then() -> None:
    """Make pauses again."""
    _every_tick.clear()


def is_clock_pausing() -> bool:
    """Return whether newer ticks may be waiting."""
    return _is_pausing.is_set()


def look_at_clock() -> None:
    """End the pause: the clock is needed as it is now."""
    _is_wanted.set()


def wait_for_clock() -> None:
    """Where time is simulated, have ticks that wait read first: for what seems to be too far ahead of the clock."""
    if not rospy.rostime.is_wallclock():
        _has_looked.clear()
        look_at_clock()
        _has_looked.wait(PAUSE_S)  # in vain where the clock stands


def _take(message: Clock) -> None:
    _is_wanted.clear()
    for listener in _listeners:
        listener(message)
    _has_looked.set()
    if not _every_tick.is_set():
        _is_pausing.set()
        _is_wanted.wait(PAUSE_S)
        _is_pausing.clear()
