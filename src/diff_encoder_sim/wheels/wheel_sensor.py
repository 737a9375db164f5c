"""The sensor on its shaft: where its edges are, and what it shows of an angle."""

from __future__ import annotations

import math
from typing import List, Optional

import numpy as np

from diff_encoder_sim.wheels.encoder_params import DEGREES_PER_HALL_EDGE, EncoderModel
from diff_encoder_sim.wheels.gear import Play


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
