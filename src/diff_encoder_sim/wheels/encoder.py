"""One encoder, from wheel angles to counts: equation (1); with errors, gear, sensor, decoder, faults and counter."""

from __future__ import annotations

import math
from collections import deque
from typing import Callable, Deque, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.wheels.encoder_params import (
    DEGREES_PER_HALL_EDGE,
    NO_FAULTS,
    EncoderModel,
    FaultParams,
    Wiring,
    pulses_from_angle,
)
from diff_encoder_sim.wheels.wheel_rate import TimedEdge, WheelRate


class IdealWheel:
    """Equation (1)."""

    def __init__(self, ppr: float) -> None:
        self._ppr, self._angle_rad = ppr, 0.0

    def turn_to(self, stamp_ns: int, angle_rad: float) -> None:
        """Turn the wheel."""
        self._angle_rad = angle_rad

    def count(self) -> int:
        """Return the count at the last angle."""
        return pulses_from_angle(self._angle_rad, self._ppr)

    def rate_radps(self, stamp_ns: int) -> Optional[float]:
        """Return that no speed is measured."""
        return None


class _Turned(NamedTuple):
    """The sensor at one instant."""

    stamp_ns: int
    place: float  # [edges]
    state: int


class CountingWheel:
    """An encoder as an `EncoderModel` has it. Every angle counts, whether it is reported or not."""

    def __init__(self, model: EncoderModel, ppr: float, rng: np.random.Generator, rate: Optional[WheelRate]) -> None:
        """Draw this wheel's own errors.

        Args:
            model: of gear, sensor, decoder and faults; those of this wheel.
            ppr: counts per revolution of the wheel.
            rng: of this wheel.
            rate: measures the speed; None where nobody asks for it.
        """
        self._model = model
        self._gear = Gear(model.shaft_turns_per_wheel_turn, model.backlash, rng)
        self._sensor = WheelSensor(model, ppr / model.shaft_turns_per_wheel_turn, rng)
        self._sound = counts_of_states(model, False, model.faults.wiring)
        self._may_die = model.faults.dead_channel != 'none'
        self._faulty = counts_of_states(model, self._may_die, model.faults.wiring)
        self._faults = CountFaults(model.faults, rng) if model.faults != NO_FAULTS else None
        self._rate, self._edges_per_count = rate, model.edges_per_count
        # Before and after the last two changes of the count: the last two edges are in them.
        self._crossings: Deque[Tuple[_Turned, _Turned]] = deque(maxlen=2)
        self._by_command = model.counts_by_command
        self._commanded = 1
        self._first_ns = 0
        self._turned: Optional[_Turned] = None
        self._count = 0
        self._was_restarted = False

    def command(self, direction: int) -> None:
        """Take the commanded direction, +1 or -1, where counting goes by it; 0 changes nothing."""
        self._commanded = direction or self._commanded

    def turn_to(self, stamp_ns: int, angle_rad: float) -> None:
        """Turn the wheel, at an even speed since the stamp before."""
        place = self._sensor.place(self._gear.shaft_angle_rad(angle_rad))
        now, before = _Turned(stamp_ns, place, self._sensor.state(place)), self._turned
        self._turned = now
        if before is None:
            self._first_ns = stamp_ns
            self._count = self._sound.count(now.state)
            return
        if now.state != before.state:
            self._add(before, now)
        self._restart_when_due(stamp_ns)

    def count(self) -> int:
        """Return the counter, before it wraps."""
        return self._count

    def rate_radps(self, stamp_ns: int) -> Optional[float]:
        """Return the measured speed; None where none is."""
        if self._rate is None:
            return None
        while self._crossings:
            self._rate.take_edges(*self._timed_edges(*self._crossings.popleft()))
        return self._rate.report(stamp_ns)

    def _add(self, before: _Turned, now: _Turned) -> None:
        decoder = self._decoder(now.stamp_ns) if self._may_die else self._sound
        counts = decoder.between(before.state, now.state)
        if self._by_command:
            counts = abs(counts) * self._commanded
        if self._rate and before.state // self._edges_per_count != now.state // self._edges_per_count:
            self._crossings.append((before, now))
        if self._faults:
            counts = self._faults.counted(counts, before.stamp_ns, now.stamp_ns)
        self._count += counts

    def _decoder(self, stamp_ns: int) -> CountsOfStates:
        faults = self._model.faults
        since_s = (stamp_ns - self._first_ns) / NANOSECONDS_PER_SECOND - faults.dead_from
        if since_s < 0.0:
            return self._sound
        if faults.dead_every:
            since_s = math.fmod(since_s, faults.dead_every)
        return self._faulty if since_s < (faults.dead_for or math.inf) else self._sound

    def _restart_when_due(self, stamp_ns: int) -> None:
        at_s = self._model.faults.restart_at
        if at_s and not self._was_restarted and stamp_ns - self._first_ns >= at_s * NANOSECONDS_PER_SECOND:
            self._count, self._was_restarted = 0, True

    def _timed_edges(self, before: _Turned, now: _Turned) -> Tuple[Optional[TimedEdge], TimedEdge]:
        """Return the last two counted edges of an interval, or the only one, as if no count was missed."""
        edges, direction = self._edges_per_count, 1 if now.state > before.state else -1
        # The counted edge at or before each place; turning backward, the one after it was crossed last.
        first, last = before.state // edges, now.state // edges
        crossed = last if direction > 0 else last + 1
        one_before = crossed - direction
        is_new = one_before > first if direction > 0 else one_before <= first

        def timed(edge: int) -> TimedEdge:
            way = now.place - before.place
            # Noise changes the state of a wheel that stands: when, nobody can tell.
            passed = (self._sensor.place_of_edge(edge * edges) - before.place) / way if way else 1.0
            time_ns = before.stamp_ns + min(max(passed, 0.0), 1.0) * (now.stamp_ns - before.stamp_ns)
            return TimedEdge(time_ns, edge if direction > 0 else edge - 1, direction)

        return timed(one_before) if is_new else None, timed(crossed)


class Play:
    """Follows what moves it once a gap is taken up: its output lags by half of the gap."""

    def __init__(self, gap: float, place: float) -> None:
        """Begin at `place`, at most half a gap from the first input."""
        self._half, self._place = 0.5 * gap, place

    def follow(self, moved_to: float) -> float:
        """Move the input, and return the output."""
        if moved_to - self._place > self._half:
            self._place = moved_to - self._half
        elif self._place - moved_to > self._half:
            self._place = moved_to + self._half
        return self._place


class Gear:
    """Turns the wheel's angle into that of the shaft with the sensor.

    The motor drives the wheel, so it is ahead by half of the play in the direction of motion, and crosses all of it
    while the wheel turns back by as much.
    """

    def __init__(self, ratio: float, backlash_rad: float, rng: np.random.Generator) -> None:
        """Draw where in the play the gear begins."""
        self._ratio, self._backlash_rad = ratio, backlash_rad
        self.begins_rad: float = rng.uniform(-0.5, 0.5) * backlash_rad  # the wheel's angle less that of its play
        self._play: Optional[Play] = None

    def shaft_angle_rad(self, wheel_angle_rad: float) -> float:
        """Turn the wheel."""
        if not self._backlash_rad:
            return self._ratio * wheel_angle_rad
        if self._play is None:
            self._play = Play(self._backlash_rad, wheel_angle_rad + self.begins_rad)
        return self._ratio * (2.0 * wheel_angle_rad - self._play.follow(wheel_angle_rad))


class WheelSensor:
    """Turns the shaft's angle into a place among the sensor's edges, of which there are a whole number in a turn."""

    def __init__(self, model: EncoderModel, counts_per_turn: float, rng: np.random.Generator) -> None:
        """Draw this sensor's own errors.

        Args:
            model: the kind of sensor and its errors.
            counts_per_turn: of its shaft; whole, where edges are not even.
            rng: of this wheel.
        """
        self._edges_per_turn = counts_per_turn * model.edges_per_count
        self.wave_phases_rad = drawn_phases_rad(rng)
        self._waves = list(zip(model.waves, self.wave_phases_rad))
        self.edge_offsets = _edge_offsets(model, round(counts_per_turn), rng)
        self._offsets: Optional[List[float]] = None if self.edge_offsets is None else self.edge_offsets.tolist()
        self._noise, self._rng = model.noise, rng
        self._hysteresis = model.hysteresis * model.edges_per_count
        self._play: Optional[Play] = None

    def place(self, shaft_angle_rad: float) -> float:
        """Return where the shaft is shown to be, in edges since the angle 0."""
        shown_rad = shaft_angle_rad
        for (amplitude_rad, per_turn), phase_rad in self._waves:
            shown_rad += amplitude_rad * math.sin(per_turn * shaft_angle_rad + phase_rad)
        place = shown_rad * self._edges_per_turn / (2.0 * math.pi)
        if not self._hysteresis:
            return place
        if self._play is None:
            self._play = Play(self._hysteresis, place)
        return self._play.follow(place)

    def state(self, place: float) -> int:
        """Return the last edge at or before a place, turning forward; noise is new each time."""
        if self._noise:
            place += self._noise * self._rng.standard_normal()
        state, offsets = math.floor(place), self._offsets
        if offsets is None:
            return state
        edges = len(offsets)
        while place < state + offsets[state % edges]:
            state -= 1
        while place >= state + 1 + offsets[(state + 1) % edges]:
            state += 1
        return state

    def place_of_edge(self, state: int) -> float:
        """Return where an edge is."""
        return state if self._offsets is None else state + self._offsets[state % len(self._offsets)]


def drawn_phases_rad(rng: np.random.Generator) -> List[float]:
    """Draw the phases of a sensor's waves, before all else of it."""
    phases_rad: List[float] = rng.uniform(0.0, 2.0 * math.pi, 3).tolist()
    return phases_rad


def _edge_offsets(model: EncoderModel, counts: int, rng: np.random.Generator) -> Optional[np.ndarray]:
    """Return (n,) how far each edge of a turn is from its place, in edges, in order; None where all are in theirs."""
    pattern = model.edge_pattern()
    if not model.has_uneven_edges:
        return None
    edges = np.arange(counts * model.edges_per_count)
    offsets = np.zeros(len(edges))
    if pattern:
        offsets += np.resize(pattern, len(edges))
    if model.sensor_error:
        # The edges of a cycle are the three sensors' in turn, twice.
        placed = rng.normal(0.0, model.sensor_error / DEGREES_PER_HALL_EDGE, 3)
        offsets += placed[edges % 3]
    errors = rng.normal(0.0, model.edge_error * model.edges_per_count, counts)
    # Edges between those that are counted are moved in proportion, so that they stay in their order.
    offsets += np.interp(edges / model.edges_per_count, np.arange(counts + 1), np.append(errors, errors[0]))
    return _in_order(offsets)


def _in_order(offsets: np.ndarray) -> np.ndarray:
    """Return the offsets with edges that lie before earlier ones moved onto them."""
    places = np.arange(len(offsets)) + offsets
    before = places[-1] - len(offsets)  # the last of the turn before
    return np.maximum.accumulate(np.maximum(places, before)) - np.arange(len(offsets))


Levels = Tuple[int, ...]  # of the channels A, B (, C): 0 low, 1 high

# The channels between one edge and the next, turning forward: A rises with the first state, B with the second.
QUADRATURE: Sequence[Levels] = ((1, 0), (1, 1), (0, 1), (0, 0))
HALL: Sequence[Levels] = ((1, 0, 1), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1))
CHANNELS = 'ABC'


class CountsOfStates(NamedTuple):
    """The decoder's count as a function of the sensor's state, a whole number of edges since the angle 0."""

    per_cycle: int
    within_cycle: Tuple[int, ...]

    def count(self, state: int) -> int:
        """Return the count at a state; only its differences matter."""
        return self.between(0, state)

    def between(self, before: int, now: int) -> int:
        """Return what is counted from one state to another."""
        per_cycle, within = self
        edges = len(within)
        return per_cycle * (now // edges - before // edges) + within[now % edges] - within[before % edges]


def counts_of_states(model: EncoderModel, is_dead: bool, wiring: Wiring) -> CountsOfStates:
    """Return what is counted.

    Args:
        model: sensor and decoding.
        is_dead: whether the channel that faults name stands still.
        wiring: of this wheel.
    """
    if model.sensor == 'absolute':
        return CountsOfStates(-1 if wiring == 'inverted' else 1, (0,))
    states = HALL if model.sensor == 'hall' else QUADRATURE
    seen = [_wired(_stuck(levels, model, is_dead), wiring) for levels in states]
    step = _step_of(model, states)
    steps = _steps_around(seen, step)
    within = [0]
    for change in steps[1:]:
        within.append(within[-1] + change)
    return CountsOfStates(sum(steps), tuple(within))


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


# More in one call are no motion but a jump of the angle: their number alone is drawn.
MOST_ONE_BY_ONE = 100_000


class HitCounts:
    """Chooses some of the counts, one by one or in bursts, however they are split into calls."""

    def __init__(self, fraction: float, burst: float, rng: np.random.Generator) -> None:
        """Prepare.

        Args:
            fraction: of the counts that are chosen, above 0.
            burst: how many in a row, on average.
            rng: draws the distances between bursts and their lengths, both geometric.
        """
        self._mean_gap = burst * (1.0 - fraction) / fraction
        self._fraction, self._burst, self._rng = fraction, burst, rng
        self._in_gap, self._in_burst = self._draw_gap(), 0

    def take(self, counts: int) -> int:
        """Return how many of the next `counts` are chosen."""
        if counts * self._fraction > MOST_ONE_BY_ONE:
            return int(self._rng.binomial(counts, self._fraction))
        chosen = 0
        while counts > 0:
            if self._in_burst == 0 and self._in_gap >= counts:
                self._in_gap -= counts
                break
            if self._in_burst == 0:
                counts -= self._in_gap
                self._in_gap, self._in_burst = 0, int(self._rng.geometric(1.0 / self._burst))
            within = min(counts, self._in_burst)
            chosen, counts, self._in_burst = chosen + within, counts - within, self._in_burst - within
            if self._in_burst == 0:
                self._in_gap = self._draw_gap()
        return chosen

    def _draw_gap(self) -> int:
        # Beyond 2^62 counts, which no drive has, the draw would overflow.
        return int(self._rng.geometric(1.0 / min(self._mean_gap + 1.0, 2.0**62))) - 1


class CountFaults:
    """Changes the counts on their way from decoder to counter."""

    def __init__(self, params: FaultParams, rng: np.random.Generator) -> None:
        """Prepare for one wheel."""
        self._missed = _hits(params.missed, params.missed_burst, rng)
        self._extra = _hits(params.extra, params.extra_burst, rng)
        self._most_per_ns = params.max_count_rate / NANOSECONDS_PER_SECOND
        self._unused = 0.0  # of the count that the rate allowed and did not get
        self._until_ns = 0

    def counted(self, counts: int, from_ns: int, to_ns: int) -> int:
        """Return what the counter gets of the signed counts of an interval; between intervals nothing was counted."""
        number = abs(counts)
        if self._missed is not None:
            number -= self._missed.take(number)
        if self._extra is not None:
            number += self._extra.take(abs(counts))
        if self._most_per_ns:
            idle_ns = from_ns - self._until_ns
            allowed = min(self._unused + idle_ns * self._most_per_ns, 1.0) + (to_ns - from_ns) * self._most_per_ns
            number = min(number, int(allowed))
            self._unused, self._until_ns = min(allowed - number, 1.0), to_ns
        return number if counts >= 0 else -number


def _hits(fraction: float, burst: float, rng: np.random.Generator) -> Optional[HitCounts]:
    return HitCounts(fraction, burst, rng) if fraction else None
