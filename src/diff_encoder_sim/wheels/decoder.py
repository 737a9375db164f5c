"""The decoder between an encoder's channels and its counter: the count at each edge of the sensor's cycle."""

from __future__ import annotations

import itertools
from typing import Callable, List, Optional, Sequence, Tuple

from diff_encoder_sim.wheels.encoder_params import EncoderModel, Wiring

# The levels of the channels A, B (, C), 0 or 1, between one edge and the next, turning forward: A rises with the first
# state, B with the second.
Levels = Tuple[int, ...]
QUADRATURE: Sequence[Levels] = ((1, 0), (1, 1), (0, 1), (0, 0))
HALL: Sequence[Levels] = ((1, 0, 1), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1))
CHANNELS = 'ABC'


def counts_in_cycle(model: EncoderModel, is_dead: bool) -> List[int]:
    """Return the decoder's count at each edge of the sensor's cycle, and after all of it.

    Args:
        model: sensor and decoding.
        is_dead: whether the channel that faults name stands still.
    """
    wiring = model.faults.wiring
    if model.sensor == 'absolute':
        return [0, -1 if wiring == 'inverted' else 1]
    states = HALL if model.sensor == 'hall' else QUADRATURE
    seen = [_wired(_stuck(levels, model, is_dead), wiring) for levels in states]
    first, *others = _steps_around(seen, _step_of(model, states))
    return list(itertools.accumulate([0, *others, first]))


def _stuck(levels: Levels, model: EncoderModel, is_dead: bool) -> Levels:
    if not is_dead:
        return levels
    dead = CHANNELS.index(model.faults.dead_channel)
    level = int(model.faults.dead_level == 'high')
    return tuple(level if channel == dead else own for channel, own in enumerate(levels))


def _wired(levels: Levels, wiring: Wiring) -> Levels:
    if wiring == 'swapped':
        return (levels[1], levels[0], *levels[2:])
    return (1 - levels[0], *levels[1:]) if wiring == 'inverted' else levels


Step = Callable[[Levels, Levels], Optional[int]]


def _steps_around(seen: Sequence[Levels], step: Step) -> List[int]:
    """Return what each state of a cycle adds when it is reached turning forward.

    Levels that no sound sensor shows leave the decoder where it was: the first time around tells where.
    """
    steps, known = [0] * len(seen), seen[-1]
    for _ in range(2):
        for place, levels in enumerate(seen):
            change = step(known, levels)
            steps[place] = change or 0
            if change is not None:
                known = levels
    return steps


def _step_of(model: EncoderModel, states: Sequence[Levels]) -> Step:
    if model.counts_by_command:
        channels = 2 if model.sensor == 'quadrature' and model.decoding == 'x4' else 3 if model.sensor == 'hall' else 1
        only_rising = model.decoding == 'x1' and model.sensor != 'hall'
        return lambda before, after: _edges(before[:channels], after[:channels], only_rising)
    if model.sensor == 'hall' or model.decoding == 'x4':
        return lambda before, after: _by_order(states, before, after)
    return lambda before, after: _by_other_channel(before, after, only_low=model.decoding == 'x1')


def _edges(before: Levels, after: Levels, only_rising: bool) -> int:
    """Count edges, whatever their order."""
    return sum(new > old if only_rising else new != old for old, new in zip(before, after))


def _by_order(states: Sequence[Levels], before: Levels, after: Levels) -> Optional[int]:
    """Return +1 or -1 from a state to the next or the last one; None where the levels are no state."""
    if before not in states:
        return 0 if after in states else None
    if after not in states:
        return None
    forward = (states.index(after) - states.index(before)) % len(states)
    return {1: 1, len(states) - 1: -1}.get(forward, 0)


def _by_other_channel(before: Levels, after: Levels, only_low: bool) -> int:
    """Count A's edges, by B's level; with `only_low` those with B low, so that the same edge counts both ways."""
    if before[0] == after[0] or (only_low and after[1]):
        return 0
    return 1 if after[0] != after[1] else -1
