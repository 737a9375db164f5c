"""Which time states of models get."""

import pytest
from rosgraph_msgs.msg import Clock

from diff_encoder_sim.drives.message_encoders import encode_names, encode_pose, encode_sequence, encode_twist
from diff_encoder_sim.ros import gazebo_states as room
from diff_encoder_sim.ros.messages import encoded_class, stamp_from_ns

MS = 1_000_000
STATES = (
    encode_names(('floor', 'alto'))
    + encode_sequence([encode_pose((1.0, 2.0, 0.0), (0.0, 0.0, 0.0, 1.0))] * 2)
    + encode_sequence([encode_twist((0.3, 0.0, 0.0), (0.0, 0.0, 0.1))] * 2)
)


class Graph:
    """A reader of the clock and of states, and what it calls back with."""

    def __init__(self, monkeypatch, period_s=0.05):
        self.dated_ms = []
        monkeypatch.setattr(room, 'subscriber', lambda *_: None)
        monkeypatch.setattr(room.node, 'read_every_tick', lambda _: None)
        self.reader = room.ModelStateReader(room.ModelStatesParams(states_period=period_s), self._on_state)

    def _on_state(self, stamp_ns, pose, velocity):
        assert (pose, velocity) == ((1.0, 2.0, 0.0), (0.3, 0.0, 0.1))
        self.dated_ms.append(stamp_ns // MS)

    def clock(self, now_ms):
        self.reader._on_clock(Clock(stamp_from_ns(now_ms * MS)))

    def states(self, **header):
        message = encoded_class(room.ModelStates)(STATES)
        message._connection_header = header
        self.reader._on_states(message)
        return self.dated_ms


def test_states_wait_for_the_clock_to_reach_the_next_multiple(monkeypatch):
    graph = Graph(monkeypatch)
    assert graph.states() == []  # the time is not known yet
    graph.clock(40)  # the tick of the first states may come after them
    assert graph.dated_ms == [50]
    graph.clock(110)
    assert graph.states() == [50, 100]
    graph.clock(140)
    assert graph.states() == [50, 100]  # ahead of the clock
    graph.clock(150)
    assert graph.dated_ms == [50, 100, 150]
    graph.clock(190)
    assert graph.states() == [50, 100, 150]  # the first after a reset
    graph.clock(0)
    assert graph.dated_ms == [50, 100, 150, 0]


@pytest.mark.parametrize(
    ('given_s', 'header', 'dated_ms'),
    [
        (None, {'states_period_ns': '50000000'}, 50),
        (None, {}, 60),  # as Gazebo
        (0.0, {'states_period_ns': '50000000'}, 60),
        (0.02, {'states_period_ns': '50000000'}, 60),
    ],
)
def test_the_publishers_period_is_used_unless_one_is_given(monkeypatch, given_s, header, dated_ms):
    graph = Graph(monkeypatch, given_s)
    for now_ms in (0, 60):
        graph.clock(now_ms)
        graph.states(**header)
    assert graph.dated_ms == [0, dated_ms]
