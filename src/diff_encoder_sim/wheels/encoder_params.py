"""Parameters of a wheel encoder: pulses per revolution, sensor, gear, decoder, faults, measured speed."""

from __future__ import annotations

import math
from operator import attrgetter
from typing import Any, Dict, Iterator, List, Literal, NamedTuple, Optional, Sequence, Tuple

from pydantic import Field, model_validator
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import COUNTER_STATES, PULSES_PER_TURN, Between, Duration_s, Fraction
from diff_encoder_sim.base.params import Params, not_allowed, param
from diff_encoder_sim.base.per_wheel import PerWheel, one_or_both

PulsesPerRevolution = Annotated[PerWheel, one_or_both(PULSES_PER_TURN), param(..., 'pulses per wheel revolution')]
DEFAULT_PPR = PerWheel(left=90, right=90)


def ppr_label(ppr: PerWheel) -> str:
    """Format as 90 if both wheels have 90, else as 40-90 for left and right."""
    left, right = f'{ppr.left:g}', f'{ppr.right:g}'
    return left if left == right else f'{left}-{right}'


def encoder_label(ppr: PerWheel, name: str) -> str:
    """Format a real encoder as `8192 amt102`, its counts per wheel revolution first; an ideal one has no name."""
    return f'{ppr_label(ppr)} {name}' if name else ppr_label(ppr)


def file_label(ppr: PerWheel, name: str) -> str:
    """Format an encoder for names of files: `90ppr`, or `8192_amt102`."""
    return encoder_label(ppr, name).replace(' ', '_') if name else f'{ppr_label(ppr)}ppr'


BurstLength = Annotated[float, Between(1.0, 1e6, 'counts')]
CountRate = Annotated[float, Between(1e-3, 1e9, 'counts/s', or_zero=True)]


class FaultParams(Params):
    """Faults between sensor and counter; none by default."""

    missed: Fraction = param(0.0, 'fraction of the counts that are missed')
    missed_burst: BurstLength = param(1.0, 'counts that are missed in a row, on average')
    extra: Fraction = param(0.0, 'counts too many, as a fraction of all, in the direction of motion')
    extra_burst: BurstLength = param(1.0, 'counts too many in a row, on average')
    max_count_rate: CountRate = param(0.0, 'counts above this rate are lost [counts/s]; 0: no limit')
    dead_channel: Literal['none', 'A', 'B', 'C'] = param('none', 'a channel that stands still; C of hall')
    dead_level: Literal['low', 'high'] = param('low', 'level of the dead channel')
    dead_from: Duration_s = param(0.0, 'since the first sample [s]')
    dead_for: Duration_s = param(0.0, 'how long [s]; 0: to the end')
    dead_every: Duration_s = param(0.0, 'from one beginning to the next [s]; 0: once')
    restart_at: Duration_s = param(
        0.0, 'the controller restarts with counters at zero, since the first sample [s]; 0: never'
    )
    wiring: Literal['straight', 'swapped', 'inverted'] = param('straight', 'A and B swapped, or A inverted')
    wheel: Literal['both', 'left', 'right'] = param('both', 'which has these faults')

    @model_validator(mode='after')
    def _check_dead_times(self) -> FaultParams:
        if self.dead_every and not 0.0 < self.dead_for <= self.dead_every:
            raise not_allowed('dead_for', self.dead_for, f'above 0.0, and at most dead_every, {self.dead_every}')
        return self


NO_FAULTS = FaultParams()


class Sensor(NamedTuple):
    """A kind of sensor."""

    channels: str  # that can be dead; '' if it shows an angle and counts nothing
    keys: Sequence[str]  # of EncoderModel that other kinds have not


SENSORS = {
    'quadrature': Sensor('AB', ('lines', 'decoding', 'duty_cycle', 'phase_error', 'edge_error')),
    'hall': Sensor('ABC', ('pole_pairs', 'sensor_error', 'edge_error')),
    'single_channel': Sensor('A', ('lines', 'decoding', 'duty_cycle', 'edge_error')),
    'absolute': Sensor('', ('bits', 'first_harmonic', 'second_harmonic', 'noise')),
}

# Counts per line of each decoding; a line has four edges.
COUNTS_PER_LINE = {'x1': 1, 'x2': 2, 'x4': 4}
EDGES_PER_LINE = 4
EDGES_PER_POLE_PAIR = 6
DEGREES_PER_HALL_EDGE = 360.0 / EDGES_PER_POLE_PAIR
# More than any commercial encoder.
MOST_COUNTS_PER_TURN = 2**20

# Periods per turn of the sensor's shaft: eccentricity and both harmonics.
WAVES_PER_TURN = (1, 1, 2)

# Minimum distance of two edges of a line [edges].
SHORTEST_STATE = 0.05

# Maximum slope of periodic errors; at 1 the measured angle stops while the shaft turns.
STEEPEST = 0.99

# A Gaussian error exceeds this number of standard deviations once in 500 million readings.
RARE_DEVIATIONS = 6.0

Counts = Annotated[float, Between(0.0, 1000.0, 'counts')]
Degrees = Annotated[float, Between(0.0, 20.0, 'degrees')]


class EncoderModel(Params):
    """Sensor, gear and decoder of a wheel encoder.

    Errors of size zero are omitted. Values that differ between wheels are sampled by the trial's seed: positions of
    edges and sensors, phases of periodic errors, and the initial gear position within the backlash.
    """

    sensor: Literal['quadrature', 'hall', 'single_channel', 'absolute'] = param(
        'quadrature', 'channels A and B; three of a motor; only A; an angle'
    )
    lines: Optional[Annotated[int, Between(1, MOST_COUNTS_PER_TURN)]] = param(
        None, "periods of a channel in a turn of the sensor's shaft; none: by ppr"
    )
    decoding: Literal['x1', 'x2', 'x4'] = param('x4', 'counts per line: rising edges of A, all of A, all')
    pole_pairs: Optional[Annotated[int, Between(1, 10_000)]] = param(None, 'of hall: six counts each')
    bits: Optional[Annotated[int, Between(1, 24, 'bits')]] = param(
        None, 'of absolute: 2^bits counts in a turn of its shaft'
    )
    side: Literal['wheel', 'motor'] = param('wheel', 'gear side of the sensor')
    gear_ratio: Annotated[float, Between(1e-2, 1e4)] = param(1.0, 'turns of the motor per turn of the wheel')
    backlash: Annotated[float, Between(0.0, 1.0, 'rad')] = param(
        0.0, 'play between motor and wheel, at the wheel [rad]'
    )
    direction: Literal['phases', 'command'] = param(
        'phases', 'of counting: by the order of edges, or by the commanded speed (always of single_channel)'
    )
    duty_cycle: Annotated[float, Between(0.1, 0.9)] = param(0.5, 'fraction of a line that a channel is high')
    phase_error: Annotated[float, Between(-80.0, 80.0, 'degrees')] = param(
        0.0, 'B after A, minus 90 [electrical degrees]'
    )
    edge_error: Annotated[float, Between(0.0, 0.3, 'counts')] = param(
        0.0, "standard deviation of each edge's place [counts]"
    )
    sensor_error: Degrees = param(0.0, "of hall: standard deviation of each sensor's place [electrical degrees]")
    eccentricity: Annotated[float, Between(0.0, 0.5, 'rad')] = param(
        0.0, "amplitude of an error once per turn of the sensor's shaft [rad of it]"
    )
    first_harmonic: Degrees = param(
        0.0, 'of absolute: amplitude of its non-linearity once per turn [degrees of its shaft]'
    )
    second_harmonic: Degrees = param(0.0, 'of absolute: twice per turn')
    noise: Counts = param(0.0, 'of absolute: standard deviation of a reading [counts]')
    hysteresis: Counts = param(0.0, 'how far the sensor turns back before it shows that [counts]')
    faults: FaultParams = NO_FAULTS

    @property
    def counts_per_shaft_turn(self) -> Optional[int]:
        """Return the counts in a turn of the sensor's shaft; None if ppr specifies them."""
        if self.pole_pairs:
            return EDGES_PER_POLE_PAIR * self.pole_pairs
        if self.bits:
            return 1 << self.bits
        return COUNTS_PER_LINE[self.decoding] * self.lines if self.lines else None

    @property
    def shaft_turns_per_wheel_turn(self) -> float:
        """Return the gear ratio; 1 if the sensor is on the wheel side."""
        return self.gear_ratio if self.side == 'motor' else 1.0

    @property
    def counts_per_wheel_turn(self) -> Optional[float]:
        """Return the pulses per revolution of the wheel, not always an integer; None if ppr specifies them."""
        counts = self.counts_per_shaft_turn
        return None if counts is None else counts * self.shaft_turns_per_wheel_turn

    def of_wheel(self, side: str) -> EncoderModel:
        """Return the model of the `left` or `right` wheel; faults may affect only one."""
        return self if self.faults.wheel in ('both', side) else self.model_copy(update={'faults': NO_FAULTS})

    @property
    def edges_per_count(self) -> int:
        """Return the number of sensor edges per count."""
        return EDGES_PER_LINE // COUNTS_PER_LINE[self.decoding]

    @property
    def counts_that_repeat(self) -> int:
        """Return the period of the edge pattern in counts; 1 if all edges are equal."""
        if self.sensor_error:
            return EDGES_PER_POLE_PAIR // 2
        return COUNTS_PER_LINE[self.decoding] if any(self.edge_pattern()) else 1

    @property
    def counts_by_command(self) -> bool:
        """Return whether the counting direction follows the commanded speeds."""
        return self.direction == 'command' or self.sensor == 'single_channel'

    @property
    def has_uneven_edges(self) -> bool:
        """Return whether edges have uneven positions, which repeat with each turn of the shaft."""
        return bool(self.edge_error or self.sensor_error or any(self.edge_pattern()))

    def edge_pattern(self) -> List[float]:
        """Return the offsets of a line's four edges from even positions [edges]."""
        longer, later = EDGES_PER_LINE * self.duty_cycle - 2.0, self.phase_error / 90.0
        return [0.0, later, longer, later + longer]

    @property
    def edge_variance(self) -> float:
        """Return the variance of a reading due to edge positions and noise [pulses^2]; independent in each reading."""
        pattern = self.edge_pattern()[:: self.edges_per_count]  # counted edges
        mean = sum(pattern) / len(pattern)
        of_pattern = sum(((place - mean) / self.edges_per_count) ** 2 for place in pattern) / len(pattern)
        return self.edge_error**2 + (self.sensor_error / DEGREES_PER_HALL_EDGE) ** 2 + self.noise**2 + of_pattern

    @property
    def waves_rad(self) -> Tuple[float, float, float]:
        """Return the amplitudes of errors with 1, 1 and 2 periods per turn of the sensor's shaft."""
        return self.eccentricity, math.radians(self.first_harmonic), math.radians(self.second_harmonic)

    def pulse_variance(self, counts_per_wheel_turn: float) -> float:
        """Return the mean variance of a reading [pulses^2] (docs/encoders.md), without the 1/12 of rounding."""
        counts_per_rad = counts_per_wheel_turn / (2.0 * math.pi)
        of_shaft = counts_per_rad / self.shaft_turns_per_wheel_turn
        variance = self.edge_variance + self.hysteresis**2 / 12.0
        variance += sum((amplitude_rad * of_shaft) ** 2 / 2.0 for amplitude_rad in self.waves_rad)
        return variance + (self.backlash * counts_per_rad) ** 2 / 12.0

    def most_jump(self, counts_per_wheel_turn: float) -> float:
        """Return the largest change of a reading without motion, except in rare cases [pulses]."""
        play = self.hysteresis + self.backlash * counts_per_wheel_turn / (2.0 * math.pi)
        return play + RARE_DEVIATIONS * math.sqrt(2.0 * self.edge_variance)

    @property
    def speed_variance(self) -> float:
        """Return the relative variance of the measured speed due to periodic errors."""
        return sum((amplitude * turns) ** 2 / 2.0 for amplitude, turns in zip(self.waves_rad, WAVES_PER_TURN))

    @model_validator(mode='after')
    def _check_rules(self) -> EncoderModel:
        for key, is_allowed, allowed in self._rules():
            if not is_allowed:
                raise not_allowed(key, attrgetter(key)(self), allowed)
        return self

    def _rules(self) -> Iterator[Tuple[str, Any, str]]:
        """Yield keys, whether their values are allowed, and what the other keys allow."""
        with_sensor = f'with sensor {self.sensor}'
        for key in dict.fromkeys(key for sensor in SENSORS.values() for key in sensor.keys):
            kinds = [kind for kind, sensor in SENSORS.items() if key in sensor.keys]
            is_default = getattr(self, key) == type(self).model_fields[key].default
            yield key, self.sensor in kinds or is_default, f'with sensor {_either(kinds)}, not {self.sensor}'
        yield 'decoding', (self.sensor, self.decoding) != ('single_channel', 'x4'), f'x1 or x2, {with_sensor}'
        channels = SENSORS[self.sensor].channels
        yield 'direction', channels or self.direction == 'phases', f'phases, {with_sensor}'
        # Order of edges: B rises, A falls, B falls, A rises. Rounded as in the message.
        later = self.phase_error / 90.0
        least = round((1.0 + SHORTEST_STATE + later) / EDGES_PER_LINE, 3)
        most = round((3.0 - SHORTEST_STATE - later) / EDGES_PER_LINE, 3)
        in_order = least <= self.duty_cycle <= most
        yield 'duty_cycle', in_order, f'{least} to {most}, with phase_error {self.phase_error}'
        # The measured angle must be monotonic.
        most_deg = round(math.degrees(STEEPEST - self.eccentricity - math.radians(self.first_harmonic)) / 2.0, 3)
        others = f'eccentricity {self.eccentricity} and first_harmonic {self.first_harmonic}'
        yield 'second_harmonic', self.second_harmonic <= most_deg, f'up to {most_deg}, with {others}'
        for key, without in (('gear_ratio', 1.0), ('backlash', 0.0)):
            is_without = getattr(self, key) == without
            yield key, self.side == 'motor' or is_without, f'{without} with side wheel, or side motor'
        most_lines = MOST_COUNTS_PER_TURN // COUNTS_PER_LINE[self.decoding]
        yield 'lines', (self.lines or 0) <= most_lines, f'up to {most_lines}, with decoding {self.decoding}'
        dead = ['none', *channels]
        yield 'faults.dead_channel', self.faults.dead_channel in dead, f'{_either(dead)}, {with_sensor}'
        for key in ('missed', 'extra', 'max_count_rate', 'restart_at'):
            allowed = f'0.0 {with_sensor}, which shows its angle and counts nothing'
            yield f'faults.{key}', channels or not getattr(self.faults, key), allowed
        is_wired = len(channels) > 1 or self.faults.wiring != 'swapped'
        yield 'faults.wiring', is_wired, f'straight or inverted, {with_sensor}'


def _either(words: Sequence[str]) -> str:
    """Return 'A', 'A or B', or 'A, B or C'."""
    *others, last = words
    return f'{", ".join(others)} or {last}' if others else last


IDEAL_ENCODER = EncoderModel()

CounterModulus = Annotated[
    int, COUNTER_STATES, Field(description='counts before the counter wraps: 65536 for int16, 0 for no wrap')
]


class CountingParams(Params):
    """Parameters that encoder and odometry share."""

    ppr: PulsesPerRevolution = DEFAULT_PPR
    counter_modulus: CounterModulus = 0
    encoder: EncoderModel = IDEAL_ENCODER
    velocity_method: Literal['M', 'T', 'MT'] = param(
        'M', 'of the twist: counts per period (M), time between edges (T), or both (MT)'
    )
    velocity_clock: Annotated[float, Between(1.0, 1e9, 'Hz')] = param(
        1e6, 'of the clock that times edges for T and MT [Hz]'
    )

    @property
    def counts_per_turn(self) -> PerWheel:
        """Return the counts per wheel revolution: the encoder's if it has them, else `ppr`."""
        counts = self.encoder.counts_per_wheel_turn
        return self.ppr if counts is None else PerWheel(left=counts, right=counts)

    def values_in_use(self) -> Dict[str, Any]:
        """Return the values by key, with the encoder's resolution."""
        return {**super().values_in_use(), 'ppr': self.counts_per_turn.plain}
