"""One wheel's encoder, from wheel angles to counts: gear, sensor, decoder and counter, each with its errors."""

from __future__ import annotations

import math
from collections import deque
from typing import Deque, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.wheels.count_faults import CountFaults
from diff_encoder_sim.wheels.decoder import CountsOfStates, counts_of_states
from diff_encoder_sim.wheels.encoder_params import NO_FAULTS, EncoderModel, pulses_from_angle
from diff_encoder_sim.wheels.gear import Gear
from diff_encoder_sim.wheels.wheel_rate import TimedEdge, WheelRate
from diff_encoder_sim.wheels.wheel_sensor import WheelSensor


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
