"""Which time states of models get while the clock is read now and then."""

import pytest
from rosgraph_msgs.msg import Clock

from diff_encoder_sim.drives.message_encoders import encode_names, encode_pose, encode_sequence, encode_twist
from diff_encoder_sim.ros import gazebo_states as room
from diff_encoder_sim.ros.conversions import stamp_from_ns
from diff_encoder_sim.ros.encoded_topics import encoded_class

MS = 1_000_000
STATES = (
    encode_names(('floor', 'alto'))
    + encode_sequence([encode_pose((1.0, 2.0, 0.0), (0.0, 0.0, 0.0, 1.0))] * 2)
    + encode_sequence([encode_twist((0.3, 0.0, 0.0), (0.0, 0.0, 0.1))] * 2)
)


class Graph:
    """A reader of the clock and of states, what it calls back with, and whether it may pause, pauses or looks."""

    def __init__(self, monkeypatch, period_s=0.05):
        self.dated_ms, self.may_pause, self.is_pausing, self.has_looked = [], True, False, False
        for name, value in {
            'subscriber': lambda *_: None,
            'listen_to_clock': lambda _: None,
            'is_clock_pausing': lambda: self.is_pausing,
            'look_at_clock': lambda: setattr(self, 'has_looked', True),
            'read_every_tick': lambda is_enabled=True: setattr(self, 'may_pause', not is_enabled),
        }.items():
            monkeypatch.setattr(room.node, name, value)
        self.reader = room.ModelStateReader(room.ModelStatesParams(states_period=period_s), self._on_state)

    def _on_state(self, stamp_ns, pose, velocity):
        assert (pose, velocity) == ((1.0, 2.0, 0.0), (0.3, 0.0, 0.1))
        self.dated_ms.append(stamp_ns // MS)

    def clock(self, now_ms):
        self.has_looked = False
        self.reader._on_clock(Clock(stamp_from_ns(now_ms * MS)))

    def states(self, **header):
        message = encoded_class(room.ModelStates)(STATES)
        message._connection_header = header
        self.reader._on_states(message)
        return self.dated_ms


@pytest.fixture
def graph(monkeypatch):
    """It has begun: states at 0."""
    begun = Graph(monkeypatch)
    assert not begun.may_pause
    begun.clock(0)
    assert begun.states() == [0]
    assert begun.may_pause  # the next multiple is known
    return begun


def test_without_pauses_the_nearest_multiple_is_the_time(graph):
    graph.clock(40)
    assert graph.states() == [0, 50]
    graph.clock(60)
    assert graph.states() == [0, 50]  # ahead of the clock
    graph.clock(100)
    assert graph.dated_ms == [0, 50, 100]


def test_in_a_pause_states_wait_for_a_look_that_finds_their_tick(graph):
    graph.is_pausing = True
    for read_ms, found_ms in ((0, 50), (80, 100), (100, 160)):
        if read_ms:
            graph.clock(read_ms)
        before = list(graph.dated_ms)
        assert graph.states() == before and graph.has_looked
        graph.clock(found_ms)
        assert len(graph.dated_ms) == len(before) + 1
    assert graph.dated_ms == [0, 50, 100, 150]
    # After their tick they do not wait: no others may come before they are answered.
    for read_ms, dated_ms in ((200, 200), (270, 250)):
        graph.clock(read_ms)
        assert graph.states()[-1] == dated_ms


def test_the_first_states_after_a_reset_are_not_dated_by_the_time_before(graph):
    graph.clock(50)
    graph.states()
    graph.is_pausing = True
    graph.clock(90)
    assert graph.states() == [0, 50] and graph.has_looked
    graph.clock(0)
    assert graph.dated_ms == [0, 50, 0]


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
    assert graph.may_pause == (given_s != 0.0 and (given_s is not None or bool(header)))
