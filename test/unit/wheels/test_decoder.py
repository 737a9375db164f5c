"""What decoders count of the sensor's edges."""

import pytest

from diff_encoder_sim.wheels.encoder import counts_of_states
from diff_encoder_sim.wheels.encoder_params import EncoderModel


def counted(states, wiring='straight', is_dead=False, **keys):
    model = EncoderModel.from_mapping(keys, 'encoder')
    counts = counts_of_states(model, is_dead, wiring)
    return [counts.count(state) - counts.count(0) for state in states]


FORWARD = list(range(-4, 9))


@pytest.mark.parametrize(('decoding', 'edges'), [('x1', 4), ('x2', 2), ('x4', 1)])
def test_a_line_has_one_two_or_four_counts(decoding, edges):
    assert counted(FORWARD, decoding=decoding) == [state // edges for state in FORWARD]


def test_three_halls_have_six_counts_a_pole_pair():
    assert counted(FORWARD, sensor='hall') == FORWARD


@pytest.mark.parametrize('decoding', ['x1', 'x2', 'x4'])
@pytest.mark.parametrize('wiring', ['swapped', 'inverted'])
def test_wrong_wiring_counts_backward(decoding, wiring):
    assert counted([400], wiring, decoding=decoding) == [-400 // {'x1': 4, 'x2': 2, 'x4': 1}[decoding]]


def test_a_dead_channel_leaves_edges_that_come_and_go():
    dead = {'faults': {'dead_channel': 'B'}}
    assert counted(range(9), is_dead=True, **dead) == [0, 0, -1, -1, 0, 0, -1, -1, 0]
    assert counted(range(9), is_dead=True, decoding='x2', **dead) == [0, 0, -1, -1, 0, 0, -1, -1, 0]
    assert set(counted(range(9), is_dead=True, decoding='x2', faults={'dead_channel': 'A'})) == {0}


def test_by_the_command_a_dead_channel_leaves_half():
    assert counted([400], is_dead=True, direction='command', faults={'dead_channel': 'B'}) == [200]
    assert counted([400], direction='command') == [400]


def test_a_dead_hall_leaves_a_third():
    assert counted([600], sensor='hall', is_dead=True, faults={'dead_channel': 'C'}) == [200]


@pytest.mark.parametrize(('decoding', 'expected'), [('x1', 100), ('x2', 200)])
def test_one_channel_has_two_edges_a_line(decoding, expected):
    assert counted([400], sensor='single_channel', decoding=decoding) == [expected]
