"""What many encoders count on one drive, and where odometry ends: `CountingWheel` for arrays of draws."""

from __future__ import annotations

import math
from typing import Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.wheels.encoder import CountsOfStates, Gear, WheelSensor, counts_of_states, drawn_phases_rad
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER, NO_FAULTS, EncoderModel, FaultParams


def drawn_counts(
    model: EncoderModel, ppr: float, angles_rad: np.ndarray, times_s: np.ndarray, rngs: Sequence[np.random.Generator]
) -> np.ndarray:
    """Return what each encoder has counted since the first angle.

    As `CountingWheel`, whose errors are drawn from the same generators, but for what is told there angle by angle:
    missed and extra counts are drawn for an interval at once, counting by command knows the wheel's own direction,
    and a restart, after which odometry goes on, is left out.

    Args:
        model: of gear, sensor, decoder and faults.
        ppr: counts per revolution of the wheel.
        angles_rad: (draws, n) of the wheel, as an encoder's samples have them.
        times_s: (n,) of the samples.
        rngs: of each encoder; draws have them in turn.

    Returns:
        (draws, n) counts; whole numbers as floats.
    """
    if model == IDEAL_ENCODER:
        return _since_the_first(np.floor(angles_rad * (ppr / (2.0 * math.pi))))
    play_rad = [Gear(model.shaft_turns_per_wheel_turn, model.backlash, rng).begins_rad for rng in rngs]
    phases_rad, offsets = _sensors(model, ppr / model.shaft_turns_per_wheel_turn, rngs)
    places = _places(model, ppr, _shaft_angles(model, np.array(play_rad), angles_rad), phases_rad)
    if model.noise:
        places = places + model.noise * rngs[0].standard_normal(places.shape)
    steps = _steps(model, _states(places, offsets), times_s)
    if model.counts_by_command:
        steps = np.abs(steps) * _directions(angles_rad)
    if model.faults != NO_FAULTS:
        steps = _faulty(model.faults, steps, times_s, rngs[0])
    counts = np.zeros(angles_rad.shape)
    np.cumsum(steps, axis=1, out=counts[:, 1:])
    rounded: np.ndarray = np.rint(counts)
    return rounded


def _since_the_first(counts: np.ndarray) -> np.ndarray:
    since: np.ndarray = counts - counts[:, :1]
    return since


def _sensors(
    model: EncoderModel, counts_per_shaft_turn: float, rngs: Sequence[np.random.Generator]
) -> Tuple[np.ndarray, Optional[np.ndarray]]:
    """Draw (encoders, 3) phases of waves and (encoders, edges) offsets, or one row of them where all are alike."""
    if model.edge_error or model.sensor_error:
        sensors = [WheelSensor(model, counts_per_shaft_turn, rng) for rng in rngs]
        phases_rad = [sensor.wave_phases_rad for sensor in sensors]
        return np.array(phases_rad), np.array([sensor.edge_offsets for sensor in sensors])
    # Nothing is drawn for such edges.
    offsets = WheelSensor(model, counts_per_shaft_turn, np.random.default_rng(0)).edge_offsets
    return np.array([drawn_phases_rad(rng) for rng in rngs]), None if offsets is None else offsets[np.newaxis]


def _shaft_angles(model: EncoderModel, begins_rad: np.ndarray, angles_rad: np.ndarray) -> np.ndarray:
    ratio = model.shaft_turns_per_wheel_turn
    if not model.backlash:
        return ratio * angles_rad
    begins_rad = angles_rad[:, 0] + np.resize(begins_rad, len(angles_rad))
    shaft_rad: np.ndarray = ratio * (2.0 * angles_rad - _followed(model.backlash, begins_rad, angles_rad))
    return shaft_rad


def _places(model: EncoderModel, ppr: float, shaft_rad: np.ndarray, phases_rad: np.ndarray) -> np.ndarray:
    """Return where shafts are shown to be, in edges."""
    shown_rad = shaft_rad
    for wave, phase_rad in zip(model.waves, np.resize(phases_rad, (len(shaft_rad), 3)).T):
        shown_rad = shown_rad + wave.amplitude_rad * np.sin(wave.per_turn * shaft_rad + phase_rad[:, np.newaxis])
    edges_per_rad = ppr / model.shaft_turns_per_wheel_turn * model.edges_per_count / (2.0 * math.pi)
    places = shown_rad * edges_per_rad
    gap = model.hysteresis * model.edges_per_count
    return _followed(gap, places[:, 0], places) if gap else places


def _followed(gap: float, begins: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """Return (draws, n) what follows inputs once a gap is taken up, as `Play`."""
    followed = np.empty(inputs.shape)
    place = begins
    for column in range(inputs.shape[1]):
        moved_to = inputs[:, column]
        place = np.clip(place, moved_to - 0.5 * gap, moved_to + 0.5 * gap)
        followed[:, column] = place
    return followed


def _states(places: np.ndarray, offsets: Optional[np.ndarray]) -> np.ndarray:
    """Return the last edge at or before each place, turning forward."""
    states: np.ndarray = np.floor(places).astype(np.int64)
    if offsets is None:
        return states
    while True:
        is_before = places < _places_of(states, offsets)
        is_beyond = places >= _places_of(states + 1, offsets)
        if not (is_before.any() or is_beyond.any()):
            return states
        states += is_beyond.astype(np.int64) - is_before


def _places_of(edges: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    encoders = np.arange(len(edges))[:, np.newaxis] % len(offsets)
    places: np.ndarray = edges + offsets[encoders, edges % offsets.shape[1]]
    return places


def _steps(model: EncoderModel, states: np.ndarray, times_s: np.ndarray) -> np.ndarray:
    """Return (draws, n - 1) what a decoder counts between samples."""
    faults = model.faults
    steps: np.ndarray = np.diff(_counts(counts_of_states(model, False, faults.wiring), states), axis=1)
    if faults.dead_channel != 'none':
        faulty = np.diff(_counts(counts_of_states(model, True, faults.wiring), states), axis=1)
        steps = np.where(_is_dead(faults, times_s)[1:], faulty, steps)
    return steps


def _counts(decoder: CountsOfStates, states: np.ndarray) -> np.ndarray:
    cycles, within = np.divmod(states, len(decoder.within_cycle))
    counts: np.ndarray = decoder.per_cycle * cycles + np.array(decoder.within_cycle)[within]
    return counts


def _is_dead(faults: FaultParams, times_s: np.ndarray) -> np.ndarray:
    since_s = times_s - times_s[0] - faults.dead_from
    within_s = np.fmod(since_s, faults.dead_every) if faults.dead_every else since_s
    is_dead: np.ndarray = (since_s >= 0.0) & (within_s < (faults.dead_for or math.inf))
    return is_dead


def _directions(angles_rad: np.ndarray) -> np.ndarray:
    """Return (draws, n - 1) the signs of motion; 1 at rest, where nothing is counted."""
    signs: np.ndarray = np.where(np.diff(angles_rad, axis=1) < 0.0, -1.0, 1.0)
    return signs


def _faulty(faults: FaultParams, steps: np.ndarray, times_s: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return what the counter gets of signed counts, as `CountFaults`."""
    numbers = np.abs(steps).astype(np.int64)
    counted = numbers - _hits(faults.missed, faults.missed_burst, numbers, rng)
    counted = counted + _hits(faults.extra, faults.extra_burst, numbers, rng)
    if faults.max_count_rate:
        counted = np.minimum(counted, faults.max_count_rate * np.diff(times_s))
    faulty: np.ndarray = np.copysign(counted, steps)
    return faulty


def _hits(fraction: float, burst: float, numbers: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Draw how many of each number of counts are hit, in bursts of geometric lengths."""
    if not fraction:
        return np.zeros_like(numbers)
    begun: np.ndarray = rng.binomial(numbers, fraction / burst)
    if burst == 1.0:
        return begun
    longer = np.zeros_like(begun)
    longer[begun > 0] = rng.negative_binomial(begun[begun > 0], 1.0 / burst)
    hits: np.ndarray = np.minimum(begun + longer, numbers)
    return hits


def final_poses(left_m: np.ndarray, right_m: np.ndarray, wheel_separation_m: float) -> np.ndarray:
    """Return where `WheelOdometry` ends when it is told these ways of the wheels.

    Args:
        left_m: (draws, reports) way of the left wheel since the start, as odometry has it of the counts.
        right_m: likewise.
        wheel_separation_m: as odometry assumes it.

    Returns:
        (draws, 3) x [m], y [m] and yaw [rad], which is not wrapped, of the axle's middle from its pose at the start.
    """
    yaw_rad = (right_m - left_m) / wheel_separation_m
    half_turn_rad = 0.5 * np.diff(yaw_rad, axis=1)
    # A chord is shorter than its arc by sin(t/2) / (t/2); np.sinc has the pi in it.
    chord_m = 0.5 * np.diff(left_m + right_m, axis=1) * np.sinc(half_turn_rad / np.pi)
    chord_yaw_rad = yaw_rad[:, :-1] + half_turn_rad
    x_m, y_m = (chord_m * np.cos(chord_yaw_rad)).sum(axis=1), (chord_m * np.sin(chord_yaw_rad)).sum(axis=1)
    return np.column_stack([x_m, y_m, yaw_rad[:, -1]])


def base_poses(axle_poses: np.ndarray, axle_x_m: float) -> np.ndarray:
    """Return (draws, 3) the poses of the robot's base from its pose at the start.

    Args:
        axle_poses: (draws, 3) of the axle's middle from its pose at the start.
        axle_x_m: how far ahead of the base the axle is.
    """
    x_m, y_m, yaw_rad = axle_poses.T
    return np.column_stack([x_m + axle_x_m * (1.0 - np.cos(yaw_rad)), y_m - axle_x_m * np.sin(yaw_rad), yaw_rad])
