"""The decoder between an encoder's channels and its counter: the count at each edge of the sensor's cycle."""

from __future__ import annotations

import itertools
from typing import List, Optional, Sequence, Tuple

from diff_encoder_sim.wheels.encoder_params import SENSORS, EncoderModel

# Levels of the channels A, B (, C) between consecutive edges, turning forward: A rises with the first state, B with
# the second.
Levels = Tuple[int, ...]
QUADRATURE: Sequence[Levels] = ((1, 0), (1, 1), (0, 1), (0, 0))
HALL: Sequence[Levels] = ((1, 0, 1), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1))


def counts_in_cycle(model: EncoderModel, is_dead: bool) -> List[int]:
    """Return the count at each edge of the sensor's cycle and its end; `is_dead`: its faulty channel is stuck."""
    faults = model.faults
    if not SENSORS[model.sensor].channels:
        return [0, -1 if faults.wiring == 'inverted' else 1]
    seen: List[Levels] = []
    for levels in HALL if model.sensor == 'hall' else QUADRATURE:
        a, b, *c = (
            int(faults.dead_level == 'high') if is_dead and channel == faults.dead_channel else level
            for channel, level in zip('ABC', levels)
        )
        wired = {'straight': (a, b), 'swapped': (b, a), 'inverted': (1 - a, b)}
        seen.append((*wired[faults.wiring], *c))
    # Invalid levels keep the decoder in its last valid state, which the first cycle determines.
    steps, known = [0] * len(seen), seen[-1]
    for _ in range(2):
        for edge, levels in enumerate(seen):
            step = _step(model, known, levels)
            steps[edge] = step or 0
            known = known if step is None else levels
    return list(itertools.accumulate([0, *steps[1:], steps[0]]))


def _step(model: EncoderModel, before: Levels, after: Levels) -> Optional[int]:
    """Return the count of a transition; None if `after` is an invalid state."""
    is_hall = model.sensor == 'hall'
    if model.counts_by_command:
        # Edges in any order.
        channels = 3 if is_hall else 2 if model.sensor == 'quadrature' and model.decoding == 'x4' else 1
        only_rising = model.decoding == 'x1' and not is_hall
        pairs = zip(before[:channels], after[:channels])
        return sum(new > old if only_rising else new != old for old, new in pairs)
    if is_hall or model.decoding == 'x4':
        states = HALL if is_hall else QUADRATURE
        if before not in states or after not in states:
            return 0 if after in states else None
        return {1: 1, len(states) - 1: -1}.get((states.index(after) - states.index(before)) % len(states), 0)
    # A's edges, by B's level; x1 only with B low, so that the same edge counts in both directions.
    if before[0] == after[0] or (model.decoding == 'x1' and after[1]):
        return 0
    return 1 if after[0] != after[1] else -1
