"""Encoder of one wheel, from wheel angle to counts: equation (1), or gear, sensor, decoder and faults.

An ideal encoder is the floor of equation (1). `turn` simulates an encoder with errors and measures the wheel speed.

Errors are sampled by a counter-based generator: a hash of the seed, wheel, draw, purpose, and edge number, run number
or time. They do not depend on the order of calls or the rate of angles.
"""

from __future__ import annotations

import math
from typing import Any, Dict, Tuple, Union

import numpy as np

from diff_encoder_sim.base.kernels import compiled
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.wheels.decoder import counts_in_cycle
from diff_encoder_sim.wheels.encoder_params import DEGREES_PER_HALL_EDGE, WAVES_PER_TURN, CountingParams

SIDES = ('left', 'right')


def pulses_from_angle(angle_rad: Union[float, np.ndarray], ppr: float) -> Any:
    """Return the pulses at a wheel angle or an array of angles: the floor of equation (1), so -0.1 pulse is -1."""
    return np.floor(angle_rad * ppr / (2.0 * math.pi))


# Methods of speed measurement: counts per period; time between edges; both (Ohmae
# et al., A microprocessor-controlled high-accuracy wide-range speed regulator for motor drives, IEEE Transactions on
# Industrial Electronics, 1982).
METHODS = ('M', 'T', 'MT')
T, MT = 1, 2

# Without an edge for this time [s], the wheel is at standstill, as after a timer overflow of a motor controller. The
# speed is then at most one count in this time, 0.3 rad/s at 40 PPR.
STANDSTILL_AFTER_S = 0.5

# The state of an encoder: one row for each draw of each wheel.
WHEEL = np.dtype(
    [
        ('key', 'u8'),  # of sampled errors
        ('has_begun', 'i8'),
        ('first_ns', 'i8'),
        ('stamp_ns', 'i8'),
        ('gear_rad', 'f8'),  # gear angle behind the backlash
        ('shown', 'f8'),  # position behind the hysteresis [edges]
        ('place', 'f8'),  # [edges]
        ('state', 'i8'),  # last edge at or before the position, turning forward
        ('count', 'i8'),
        ('commanded', 'i8'),  # direction
        ('left', 'i8', 2),  # counts to the end of a run, of missed and of extra counts
        ('run', 'i8', 2),  # run number; even: burst of affected counts; odd: gap
        ('unused', 'f8'),  # remainder of the counts that the maximum rate allows
        ('until_ns', 'i8'),
        ('rate_radps', 'f8'),
        ('edge_ns', 'f8'),  # when the last counted edge was crossed
        ('edge', 'i8'),  # its number; turning backward: the previous number
        ('edge_direction', 'i8'),  # 0 before the first
        ('reported_ns', 'f8'),  # `edge_ns` at the last report; 0 before the first
        ('reported_edge', 'i8'),
    ],
    align=True,
)


def kinds_of(params: CountingParams) -> np.ndarray:
    """Return the constants of the left and the right encoder, (2,) of a structured type."""
    both = [_constants(params, side) for side in SIDES]
    fields = [(name, np.asarray(value).dtype, np.shape(value)) for name, value in both[0].items()]
    return np.array([tuple(constants.values()) for constants in both], np.dtype(fields, align=True))


def _constants(params: CountingParams, side: str) -> Dict[str, Any]:
    model, ppr = params.encoder.of_wheel(side), getattr(params.counts_per_turn, side)
    faults, per_count, counts_per_turn = model.faults, model.edges_per_count, ppr / model.shaft_turns_per_wheel_turn
    may_die = faults.dead_channel != 'none'
    cycles = [counts_in_cycle(model, is_dead) for is_dead in (False, may_die)]
    return {
        'ratio': model.shaft_turns_per_wheel_turn,
        'backlash_rad': model.backlash,
        'edges_per_turn': counts_per_turn * per_count,  # per shaft turn, as the next one
        'counts_per_turn': round(counts_per_turn),  # whole if edges are uneven
        'edges_per_count': per_count,
        'waves_rad': model.waves_rad,
        'waves_per_turn': WAVES_PER_TURN,
        'hysteresis': model.hysteresis * per_count,  # [edges], as all positions
        'noise': model.noise,
        'pattern': model.edge_pattern(),  # places of a line's edges, minus 0 to 3
        'is_uneven': model.has_uneven_edges,
        'is_sampled': bool(model.edge_error or model.sensor_error),
        'edge_error': model.edge_error * per_count,
        'sensor_error': model.sensor_error / DEGREES_PER_HALL_EDGE,
        # Largest shift of an edge beyond others, within 6 standard deviations [counts].
        'reach': int(6.0 * math.sqrt(2.0 * model.edge_variance)),
        'edges_per_cycle': len(cycles[0]) - 1,
        'per_cycle': [cycle[-1] for cycle in cycles],  # counts; sound, with a dead channel
        'within_cycle': [cycle[:-1] + [0] * (7 - len(cycle)) for cycle in cycles],  # the count at each edge
        'counts_by_command': model.counts_by_command,
        'dead_from_s': faults.dead_from if may_die else math.inf,
        'dead_for_s': faults.dead_for or math.inf,
        'dead_every_s': faults.dead_every or math.inf,
        'hits': ((faults.missed, faults.missed_burst), (faults.extra, faults.extra_burst)),  # fraction, mean in a row
        'counts_per_ns': faults.max_count_rate / 1e9,  # at most; 0: no limit
        'restart_ns': round(faults.restart_at * 1e9) or 2**62,  # since the first angle
        'method': METHODS.index(params.velocity_method),
        'tick_ns': 1e9 / params.velocity_clock,
        'rad_per_count': 2.0 * math.pi / ppr,
    }


def new_wheels(seed: int, draws: int) -> np.ndarray:
    """Return (draws, 2) WHEEL states of both wheels before the first angle; errors depend on the draw number."""
    wheels = np.zeros((draws, 2), WHEEL)
    for wheel, side in enumerate(SIDES):
        wheels['key'][:, wheel] = generator(seed, f'{side}_encoder').integers(0, 2**64, draws, dtype=np.uint64)
    wheels['commanded'] = 1
    return wheels


# Purposes of sampled numbers.
MISSED, EXTRA, PHASE, PLAY, EDGE, HALL_SENSOR, NOISE = range(7)


@compiled
def _mixed(key: Any) -> Any:
    """Return the output of splitmix64 at a state (Steele, Lea and Flood, 2014)."""
    key = (key ^ (key >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    key = (key ^ (key >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return key ^ (key >> np.uint64(31))


@compiled
def _hash(key: Any, purpose: int, number: int) -> Any:
    """Return 64 reproducible bits."""
    step = np.uint64(0x9E3779B97F4A7C15)
    return _mixed(_mixed(key + np.uint64(purpose + 1) * step) + np.uint64(number) * step)


@compiled
def _uniform(key: Any, purpose: int, number: int) -> Any:
    """Return a reproducible number between 0 and 1, both excluded."""
    return (np.float64(_hash(key, purpose, number) >> np.uint64(12)) + 0.5) / 4503599627370496.0  # 2^52


@compiled
def _normal(key: Any, purpose: int, number: int) -> Any:
    """Return a standard normal sample, of two uniform ones with 32 bits each (Box and Muller, 1958)."""
    bits = _hash(key, purpose, number)
    radius_share = (np.float64(bits >> np.uint64(32)) + 0.5) / 4294967296.0  # 2^32
    turn_share = np.float64(bits & np.uint64(0xFFFFFFFF)) / 4294967296.0
    return math.sqrt(-2.0 * math.log(radius_share)) * math.cos(2.0 * math.pi * turn_share)


@compiled
def _followed(place: float, moved_to: float, gap: float) -> float:
    """Return the position of the driven part: it lags by half of the gap."""
    return min(max(place, moved_to - 0.5 * gap), moved_to + 0.5 * gap)


@compiled
def _place(kind: Any, wheel: Any, angle_rad: float) -> Any:
    """Turn gear and sensor, and return the measured shaft position in edges since the angle 0.

    The motor drives the wheel: it leads by half of the backlash in the direction of motion, and crosses all of it when
    the direction reverses.
    """
    shaft_rad = kind.ratio * angle_rad
    if kind.backlash_rad:
        if not wheel.has_begun:
            wheel.gear_rad = angle_rad + (_uniform(wheel.key, PLAY, 0) - 0.5) * kind.backlash_rad
        wheel.gear_rad = _followed(wheel.gear_rad, angle_rad, kind.backlash_rad)
        shaft_rad = kind.ratio * (2.0 * angle_rad - wheel.gear_rad)
    shown_rad = shaft_rad
    for wave in range(3):
        if kind.waves_rad[wave]:
            phase_rad = 2.0 * math.pi * _uniform(wheel.key, PHASE, wave)
            shown_rad += kind.waves_rad[wave] * math.sin(kind.waves_per_turn[wave] * shaft_rad + phase_rad)
    place = shown_rad * kind.edges_per_turn / (2.0 * math.pi)
    if kind.hysteresis:
        if not wheel.has_begun:
            wheel.shown = place
        wheel.shown = _followed(wheel.shown, place, kind.hysteresis)
        place = wheel.shown
    return place


@compiled
def _nominal_place(kind: Any, edge: int) -> Any:
    return edge + kind.pattern[edge % 4]


@compiled
def _place_of_count(kind: Any, key: Any, count: int) -> Any:
    """Return the sampled position of a counted edge, not before an earlier edge."""
    place = _nominal_place(kind, count * kind.edges_per_count)
    if not kind.is_sampled:
        return place
    most = -math.inf
    for earlier in range(count, count - 1 - kind.reach, -1):
        place = _nominal_place(kind, earlier * kind.edges_per_count)
        if kind.edge_error:
            place += kind.edge_error * _normal(key, EDGE, earlier % kind.counts_per_turn)
        if kind.sensor_error:
            # In a cycle each of the three sensors has two edges.
            place += kind.sensor_error * _normal(key, HALL_SENSOR, earlier % 3)
        most = max(most, place)
    return most


@compiled
def _place_of_edge(kind: Any, key: Any, edge: int) -> Any:
    """Return the position of an edge [edges]; interpolated between counted edges."""
    if not kind.is_uneven:
        return float(edge)
    count = edge // kind.edges_per_count
    counted = count * kind.edges_per_count
    place = _place_of_count(kind, key, count)
    if edge == counted:
        return place
    nominal, following = _nominal_place(kind, counted), _nominal_place(kind, counted + kind.edges_per_count)
    passed = (_nominal_place(kind, edge) - nominal) / (following - nominal)
    return place + passed * (_place_of_count(kind, key, count + 1) - place)


@compiled
def _state(kind: Any, wheel: Any, stamp_ns: int, place: float) -> int:
    """Return the last edge at or before a position, turning forward; noise is independent in each call."""
    if kind.noise:
        place += kind.noise * _normal(wheel.key, NOISE, stamp_ns - wheel.first_ns)
    state = math.floor(place)
    if kind.is_uneven:
        while place < _place_of_edge(kind, wheel.key, state):
            state -= 1
        while place >= _place_of_edge(kind, wheel.key, state + 1):
            state += 1
    return state


@compiled
def _count_at(kind: Any, decoder: int, state: int) -> Any:
    cycles, edge = state // kind.edges_per_cycle, state % kind.edges_per_cycle
    return kind.per_cycle[decoder] * cycles + kind.within_cycle[decoder, edge]


# More edges in one call are a jump of the angle: faults are not sampled.
MOST_HITS = 100_000


@compiled
def _hits(kind: Any, wheel: Any, fault: int, counts: int) -> int:
    """Return how many next counts MISSED or EXTRA affects: gaps and bursts alternate, with geometric lengths."""
    fraction, burst, hits = kind.hits[fault, 0], kind.hits[fault, 1], 0
    if counts * fraction > MOST_HITS:
        return int(counts * fraction)
    while counts > 0 and fraction:
        is_burst = wheel.run[fault] % 2 == 0
        taken = min(counts, wheel.left[fault])
        counts -= taken
        hits += taken if is_burst else 0
        wheel.left[fault] -= taken
        if wheel.left[fault] == 0:
            wheel.run[fault] += 1
            mean = burst * (1.0 - fraction) / fraction if is_burst else burst - 1.0
            sampled = math.log(_uniform(wheel.key, fault, wheel.run[fault]))
            longer = sampled / math.log1p(-1.0 / (mean + 1.0)) if mean > 0.0 else 0.0
            wheel.left[fault] = int(min(longer, 1e18)) + (not is_burst)
    return hits


@compiled
def _counted(kind: Any, wheel: Any, stamp_ns: int, counts: int) -> int:
    """Return the signed counts since the previous stamp after faults."""
    number = abs(counts) - _hits(kind, wheel, MISSED, abs(counts)) + _hits(kind, wheel, EXTRA, abs(counts))
    if kind.counts_per_ns:
        idle_ns, took_ns = wheel.stamp_ns - wheel.until_ns, stamp_ns - wheel.stamp_ns
        allowed = min(wheel.unused + idle_ns * kind.counts_per_ns, 1.0) + took_ns * kind.counts_per_ns
        number = min(number, int(allowed))
        wheel.unused, wheel.until_ns = min(allowed - number, 1.0), stamp_ns
    return number if counts >= 0 else -number


@compiled
def _speed(kind: Any, first_ns: float, last_ns: float, counts: int) -> Any:
    """Return the speed between two edges, limited by the resolution of the clock."""
    ticks = math.floor(last_ns / kind.tick_ns) - math.floor(first_ns / kind.tick_ns)
    return counts * kind.rad_per_count / (max(ticks, 1) * kind.tick_ns / 1e9)


@compiled
def _crossed_ns(kind: Any, wheel: Any, edge: int, stamp_ns: int, place: float) -> Any:
    """Return the time of a counted edge since the previous stamp."""
    way = place - wheel.place
    # Noise changed the state at standstill, at an unknown time.
    passed = (_place_of_edge(kind, wheel.key, edge * kind.edges_per_count) - wheel.place) / way if way else 1.0
    return wheel.stamp_ns + min(max(passed, 0.0), 1.0) * (stamp_ns - wheel.stamp_ns)


@compiled
def _time_edges(kind: Any, wheel: Any, stamp_ns: int, place: float, state: int) -> None:
    """Store the last crossed edge, ignoring missed counts; T measures from the previous edge."""
    direction = 1 if state > wheel.state else -1
    # The counted edge at or before each position; turning backward, the next edge was crossed last.
    first, last = wheel.state // kind.edges_per_count, state // kind.edges_per_count
    crossed = last if direction > 0 else last + 1
    crossed_ns, before = _crossed_ns(kind, wheel, crossed, stamp_ns, place), crossed - direction
    if kind.method == T and (before > first if direction > 0 else before <= first):
        before_ns = _crossed_ns(kind, wheel, before, stamp_ns, place)
        wheel.rate_radps = _speed(kind, before_ns, crossed_ns, direction)
    elif kind.method == T and wheel.edge_direction:
        # After a reversal it is the same edge.
        counts = last - wheel.edge if direction == wheel.edge_direction else 0
        wheel.rate_radps = _speed(kind, wheel.edge_ns, crossed_ns, counts)
    wheel.edge_ns, wheel.edge, wheel.edge_direction = crossed_ns, last, direction


@compiled
def _rate_radps(kind: Any, wheel: Any, stamp_ns: int) -> float:
    """Return the speed at a report; without a new edge at most one count since the last edge, then zero."""
    if not wheel.edge_direction:
        return 0.0
    if kind.method == MT:
        if wheel.reported_ns and wheel.reported_ns != wheel.edge_ns:
            wheel.rate_radps = _speed(kind, wheel.reported_ns, wheel.edge_ns, wheel.edge - wheel.reported_edge)
        wheel.reported_ns, wheel.reported_edge = wheel.edge_ns, wheel.edge
    since_s = (stamp_ns - wheel.edge_ns) / 1e9
    if since_s > STANDSTILL_AFTER_S:
        return 0.0
    fastest_radps = kind.rad_per_count / since_s if since_s > 0.0 else math.inf
    return math.copysign(min(abs(wheel.rate_radps), fastest_radps), wheel.rate_radps)


@compiled
def _turn(kind: Any, wheel: Any, stamp_ns: int, angle_rad: float) -> None:
    """Turn a wheel: gear, sensor, decoder, faults."""
    if not wheel.has_begun:
        wheel.first_ns = stamp_ns
    place = _place(kind, wheel, angle_rad)
    state = _state(kind, wheel, stamp_ns, place)
    if not wheel.has_begun:
        wheel.count = _count_at(kind, 0, state)
        wheel.unused, wheel.until_ns, wheel.has_begun = 1.0, stamp_ns, 1
    elif state != wheel.state:
        since_s = (stamp_ns - wheel.first_ns) / 1e9 - kind.dead_from_s
        decoder = int(since_s >= 0.0 and np.fmod(since_s, kind.dead_every_s) < kind.dead_for_s)
        counts = _count_at(kind, decoder, state) - _count_at(kind, decoder, wheel.state)
        if kind.counts_by_command:
            counts = abs(counts) * wheel.commanded
        if kind.method and wheel.state // kind.edges_per_count != state // kind.edges_per_count:
            _time_edges(kind, wheel, stamp_ns, place, state)
        wheel.count += _counted(kind, wheel, stamp_ns, counts)
    if wheel.stamp_ns - wheel.first_ns < kind.restart_ns <= stamp_ns - wheel.first_ns:
        wheel.count = 0
    wheel.stamp_ns, wheel.place, wheel.state = stamp_ns, place, state


@compiled
def turn(
    kinds: np.ndarray, wheels: np.ndarray, stamp_ns: int, left_rad: float, right_rad: float, is_read: bool
) -> Tuple[int, int, float, float]:
    """Turn (2,) wheels of (2,) `kinds_of` to accumulated angles, at constant speed since the previous stamp.

    If `is_read`, return the left and right counters, before they wrap, and the measured speeds [rad/s]; else zeros.
    """
    _turn(kinds[0], wheels[0], stamp_ns, left_rad)
    _turn(kinds[1], wheels[1], stamp_ns, right_rad)
    if not is_read:
        return 0, 0, 0.0, 0.0
    rates_radps = _rate_radps(kinds[0], wheels[0], stamp_ns), _rate_radps(kinds[1], wheels[1], stamp_ns)
    return wheels[0].count, wheels[1].count, rates_radps[0], rates_radps[1]


@compiled(nogil=True)
def turn_through(
    kinds: np.ndarray,
    wheels: np.ndarray,
    stamps_ns: np.ndarray,
    angles_rad: np.ndarray,
    phases_rad: np.ndarray,
    commands: np.ndarray,
    read_ns: np.ndarray,
) -> Tuple[np.ndarray, np.ndarray]:
    """Turn both wheels of each draw through a drive; return (draws, m, 2) counts and (draws, m, 2) measured speeds.

    Args:
        kinds: (2,) of `kinds_of`.
        wheels: (draws, 2) of WHEEL.
        stamps_ns: (n,).
        angles_rad: (1 or draws, n, 2), linear between stamps.
        phases_rad: (draws, 2), added to the angles of each draw.
        commands: (n, 2) newest commanded speeds, which set the directions; 0: unchanged.
        read_ns: (m,) times at which counters are read, ascending.
    """
    counts = np.zeros((len(wheels), len(read_ns), 2), np.int64)
    rates_radps = np.zeros(counts.shape)
    for draw in range(len(wheels)):
        for side in range(2):
            kind, wheel, row = kinds[side], wheels[draw, side], 0
            angles = angles_rad[draw % len(angles_rad), :, side] + phases_rad[draw, side]
            for reading, now_ns in enumerate(read_ns):
                while row < len(stamps_ns) and stamps_ns[row] <= now_ns:
                    if kind.counts_by_command and commands[row, side]:
                        wheel.commanded = int(np.sign(commands[row, side]))
                    _turn(kind, wheel, stamps_ns[row], angles[row])
                    row += 1
                if stamps_ns[row - 1] < now_ns:
                    if kind.counts_by_command and commands[row, side]:
                        wheel.commanded = int(np.sign(commands[row, side]))
                    passed = (now_ns - stamps_ns[row - 1]) / (stamps_ns[row] - stamps_ns[row - 1])
                    _turn(kind, wheel, now_ns, angles[row - 1] + passed * (angles[row] - angles[row - 1]))
                counts[draw, reading, side] = wheel.count
                rates_radps[draw, reading, side] = _rate_radps(kind, wheel, now_ns)
    return counts, rates_radps
