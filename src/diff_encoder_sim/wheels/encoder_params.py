"""Parameters of a wheel encoder: pulses per revolution, sensor, gear, decoder, faults, measured speed."""

from __future__ import annotations

import math
from typing import Any, Dict, List, Literal, Optional, Sequence, Tuple, Union

from pydantic import BeforeValidator, Field, model_validator
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import (
    COUNTER_STATES,
    PULSES_PER_TURN,
    Between,
    Duration_s,
    Fraction,
    PulsesPerTurn,
    is_number,
)
from diff_encoder_sim.base.params import Params, not_allowed


class PerWheel(Params):
    """One positive number for each wheel."""

    left: PulsesPerTurn = Field(description='of the left wheel')
    right: PulsesPerTurn = Field(description='of the right wheel')

    @property
    def plain(self) -> Union[float, Dict[str, float]]:
        """Return the value as users write it: one number if both wheels are equal, integers without a point."""
        left, right = (int(each) if each == int(each) else each for each in (self.left, self.right))
        return left if left == right else {'left': left, 'right': right}


def _same_for_both(value: Any) -> Any:
    if isinstance(value, (dict, PerWheel)):
        return value
    if not (is_number(value) and PULSES_PER_TURN.allows(value)):
        raise ValueError(f'{PULSES_PER_TURN}, or {{left: ..., right: ...}}')
    return {'left': value, 'right': value}


PulsesPerRevolution = Annotated[
    PerWheel, BeforeValidator(_same_for_both), Field(description='pulses per wheel revolution')
]
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


VelocityMethod = Annotated[
    Literal['M', 'T', 'MT'],
    Field(description='of the twist: counts per period (M), time between edges (T), or both (MT)'),
]
VelocityClock_Hz = Annotated[
    float, Between(1.0, 1e9, 'Hz'), Field(description='of the clock that times edges for T and MT [Hz]')
]
DEFAULT_CLOCK_HZ = 1e6

CounterModulus = Annotated[
    int, COUNTER_STATES, Field(description='counts before the counter wraps: 65536 for int16, 0 for no wrap')
]


Side = Literal['both', 'left', 'right']
Wiring = Literal['straight', 'swapped', 'inverted']
BurstLength = Annotated[float, Between(1.0, 1e6, 'counts')]

# Counts per line of each decoding; a line has four edges.
COUNTS_PER_LINE = {'x1': 1, 'x2': 2, 'x4': 4}
EDGES_PER_LINE = 4
EDGES_PER_POLE_PAIR = 6
DEGREES_PER_HALL_EDGE = 360.0 / EDGES_PER_POLE_PAIR
# More than any commercial encoder.
MOST_COUNTS_PER_TURN = 2**20

# Minimum distance of two edges of a line [edges].
SHORTEST_STATE = 0.05

# Maximum slope of periodic errors; at 1 the measured angle stops while the shaft turns.
STEEPEST = 0.99

# A Gaussian error exceeds this number of standard deviations once in 500 million readings.
RARE_DEVIATIONS = 6.0


class FaultParams(Params):
    """Faults between sensor and counter; none by default."""

    missed: Fraction = Field(0.0, description='fraction of the counts that are missed')
    missed_burst: BurstLength = Field(1.0, description='counts that are missed in a row, on average')
    extra: Fraction = Field(0.0, description='counts too many, as a fraction of all, in the direction of motion')
    extra_burst: BurstLength = Field(1.0, description='counts too many in a row, on average')
    max_count_rate: Annotated[float, Between(1e-3, 1e9, 'counts/s', or_zero=True)] = Field(
        0.0, description='counts above this rate are lost [counts/s]; 0: no limit'
    )
    dead_channel: Literal['none', 'A', 'B', 'C'] = Field('none', description='a channel that stands still; C of hall')
    dead_level: Literal['low', 'high'] = Field('low', description='level of the dead channel')
    dead_from: Duration_s = Field(0.0, description='since the first sample [s]')
    dead_for: Duration_s = Field(0.0, description='how long [s]; 0: to the end')
    dead_every: Duration_s = Field(0.0, description='from one beginning to the next [s]; 0: once')
    restart_at: Duration_s = Field(
        0.0, description='the controller restarts with counters at zero, since the first sample [s]; 0: never'
    )
    wiring: Wiring = Field('straight', description='A and B swapped, or A inverted')
    wheel: Side = Field('both', description='which has these faults')

    @model_validator(mode='after')
    def _check_dead_times(self) -> FaultParams:
        if self.dead_every and not 0.0 < self.dead_for <= self.dead_every:
            raise not_allowed('dead_for', self.dead_for, f'above 0.0, and at most dead_every, {self.dead_every}')
        return self


NO_FAULTS = FaultParams()


_LINES, _ABSOLUTE = ('quadrature', 'single_channel'), ('absolute',)
SENSORS_OF_KEYS = {
    **dict.fromkeys(('lines', 'decoding', 'duty_cycle'), _LINES),
    'phase_error': ('quadrature',),
    **dict.fromkeys(('pole_pairs', 'sensor_error'), ('hall',)),
    **dict.fromkeys(('bits', 'first_harmonic', 'second_harmonic', 'noise'), _ABSOLUTE),
    'edge_error': ('quadrature', 'hall', 'single_channel'),
}

# Periods per turn of the sensor's shaft: eccentricity and both harmonics.
WAVES_PER_TURN = (1, 1, 2)


class EncoderModel(Params):
    """Sensor, gear and decoder of a wheel encoder.

    Errors of size zero are omitted. Values that differ between wheels are sampled by the trial's seed: positions of
    edges and sensors, phases of periodic errors, and the initial gear position within the backlash.
    """

    sensor: Literal['quadrature', 'hall', 'single_channel', 'absolute'] = Field(
        'quadrature', description='channels A and B; three of a motor; only A; an angle'
    )
    lines: Optional[Annotated[int, Between(1, MOST_COUNTS_PER_TURN)]] = Field(
        None, description="periods of a channel in a turn of the sensor's shaft; none: by ppr"
    )
    decoding: Literal['x1', 'x2', 'x4'] = Field('x4', description='counts per line: rising edges of A, all of A, all')
    pole_pairs: Optional[Annotated[int, Between(1, 10_000)]] = Field(None, description='of hall: six counts each')
    bits: Optional[Annotated[int, Between(1, 24, 'bits')]] = Field(
        None, description='of absolute: 2^bits counts in a turn of its shaft'
    )
    side: Literal['wheel', 'motor'] = Field('wheel', description='gear side of the sensor')
    gear_ratio: Annotated[float, Between(1e-2, 1e4)] = Field(
        1.0, description='turns of the motor per turn of the wheel'
    )
    backlash: Annotated[float, Between(0.0, 1.0, 'rad')] = Field(
        0.0, description='play between motor and wheel, at the wheel [rad]'
    )
    direction: Literal['phases', 'command'] = Field(
        'phases', description='of counting: by the order of edges, or by the commanded speed (always of single_channel)'
    )
    duty_cycle: Annotated[float, Between(0.1, 0.9)] = Field(
        0.5, description='fraction of a line that a channel is high'
    )
    phase_error: Annotated[float, Between(-80.0, 80.0, 'degrees')] = Field(
        0.0, description='B after A, minus 90 [electrical degrees]'
    )
    edge_error: Annotated[float, Between(0.0, 0.3, 'counts')] = Field(
        0.0, description="standard deviation of each edge's place [counts]"
    )
    sensor_error: Annotated[float, Between(0.0, 20.0, 'degrees')] = Field(
        0.0, description="of hall: standard deviation of each sensor's place [electrical degrees]"
    )
    eccentricity: Annotated[float, Between(0.0, 0.5, 'rad')] = Field(
        0.0, description="amplitude of an error once per turn of the sensor's shaft [rad of it]"
    )
    first_harmonic: Annotated[float, Between(0.0, 20.0, 'degrees')] = Field(
        0.0, description='of absolute: amplitude of its non-linearity once per turn [degrees of its shaft]'
    )
    second_harmonic: Annotated[float, Between(0.0, 20.0, 'degrees')] = Field(
        0.0, description='of absolute: twice per turn'
    )
    noise: Annotated[float, Between(0.0, 1000.0, 'counts')] = Field(
        0.0, description='of absolute: standard deviation of a reading [counts]'
    )
    hysteresis: Annotated[float, Between(0.0, 1000.0, 'counts')] = Field(
        0.0, description='how far the sensor turns back before it shows that [counts]'
    )
    faults: FaultParams = NO_FAULTS

    @property
    def counts_per_shaft_turn(self) -> Optional[int]:
        """Return the counts in a turn of the sensor's shaft; None if ppr specifies them."""
        if self.sensor == 'hall':
            return EDGES_PER_POLE_PAIR * self.pole_pairs if self.pole_pairs else None
        if self.sensor == 'absolute':
            return 2**self.bits if self.bits else None
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
        if self.faults.wheel in ('both', side):
            return self
        return self.model_copy(update={'faults': NO_FAULTS})

    @property
    def edges_per_count(self) -> int:
        """Return the number of sensor edges per count."""
        return 1 if self.sensor in ('hall', 'absolute') else EDGES_PER_LINE // COUNTS_PER_LINE[self.decoding]

    @property
    def counts_that_repeat(self) -> int:
        """Return the period of the edge pattern in counts; 1 if all edges are equal."""
        if self.sensor_error:
            return EDGES_PER_POLE_PAIR // 2
        return COUNTS_PER_LINE[self.decoding] if self.edge_pattern() else 1

    @property
    def counts_by_command(self) -> bool:
        """Return whether the counting direction follows the commanded speeds."""
        return self.direction == 'command' or self.sensor == 'single_channel'

    @property
    def has_uneven_edges(self) -> bool:
        """Return whether edges have uneven positions, which repeat with each turn of the shaft."""
        return bool(self.edge_error or self.sensor_error or self.edge_pattern())

    def edge_pattern(self) -> Optional[List[float]]:
        """Return the offsets of a line's four edges from even positions [edges]; None if even."""
        if self.sensor in ('hall', 'absolute') or (self.duty_cycle == 0.5 and self.phase_error == 0.0):
            return None
        longer, later = EDGES_PER_LINE * self.duty_cycle - 2.0, self.phase_error / 90.0
        return [0.0, later, longer, later + longer]

    @property
    def edge_variance(self) -> float:
        """Return the variance of a reading due to edge positions and noise [pulses^2]; independent in each reading."""
        pattern = (self.edge_pattern() or [0.0])[:: self.edges_per_count]  # counted edges
        mean = sum(pattern) / len(pattern)
        of_pattern = sum(((place - mean) / self.edges_per_count) ** 2 for place in pattern) / len(pattern)
        return self.edge_error**2 + (self.sensor_error / DEGREES_PER_HALL_EDGE) ** 2 + self.noise**2 + of_pattern

    @property
    def waves_rad(self) -> Tuple[float, float, float]:
        """Return the amplitudes of errors with 1, 1 and 2 periods per turn of the sensor's shaft."""
        return self.eccentricity, math.radians(self.first_harmonic), math.radians(self.second_harmonic)

    def pulse_variance(self, counts_per_wheel_turn: float) -> float:
        """Return the variance of a reading due to sensor errors [pulses^2], without the 1/12 of rounding.

        The mean over a turn (docs/encoders.md), including noise and backlash.
        """
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
    def _check_sensor(self) -> EncoderModel:
        """Check that all keys apply to the sensor."""
        for key, sensors in SENSORS_OF_KEYS.items():
            value = getattr(self, key)
            if self.sensor not in sensors and value != type(self).model_fields[key].default:
                raise not_allowed(key, value, f'with sensor {_either(sensors)}, not {self.sensor}')
        if self.sensor == 'single_channel' and self.decoding == 'x4':
            # The default; a single channel has two edges per line.
            raise not_allowed('decoding', self.decoding, 'x1 or x2, with sensor single_channel')
        if self.sensor == 'absolute' and self.direction == 'command':
            raise not_allowed('direction', self.direction, 'phases, with sensor absolute')
        return self

    @model_validator(mode='after')
    def _check_shape(self) -> EncoderModel:
        """Check that edges are in order and that the measured angle is monotonic."""
        later = self.phase_error / 90.0
        # Order of edges: B rises, A falls, B falls, A rises. Rounded as in the message.
        least = round((1.0 + SHORTEST_STATE + later) / EDGES_PER_LINE, 3)
        most = round((3.0 - SHORTEST_STATE - later) / EDGES_PER_LINE, 3)
        if not least <= self.duty_cycle <= most:
            raise not_allowed('duty_cycle', self.duty_cycle, f'{least} to {most}, with phase_error {self.phase_error}')
        most_deg = round(math.degrees(STEEPEST - self.eccentricity - math.radians(self.first_harmonic)) / 2.0, 3)
        if self.second_harmonic > most_deg:
            others = f'eccentricity {self.eccentricity} and first_harmonic {self.first_harmonic}'
            raise not_allowed('second_harmonic', self.second_harmonic, f'up to {most_deg}, with {others}')
        return self

    @model_validator(mode='after')
    def _check_gear_and_faults(self) -> EncoderModel:
        for key, without in (('gear_ratio', 1.0), ('backlash', 0.0)):
            if self.side == 'wheel' and getattr(self, key) != without:
                raise not_allowed(key, getattr(self, key), f'{without} with side wheel, or side motor')
        most_lines = MOST_COUNTS_PER_TURN // COUNTS_PER_LINE[self.decoding]
        if self.lines is not None and self.lines > most_lines:
            raise not_allowed('lines', self.lines, f'up to {most_lines}, with decoding {self.decoding}')
        faults = self.faults
        channels = {'quadrature': 'AB', 'single_channel': 'A', 'hall': 'ABC', 'absolute': ''}[self.sensor]
        if faults.dead_channel not in ('none', *channels):
            allowed = f'{_either(["none", *channels])}, with sensor {self.sensor}'
            raise not_allowed('faults.dead_channel', faults.dead_channel, allowed)
        for key in ('missed', 'extra', 'max_count_rate', 'restart_at') if self.sensor == 'absolute' else ():
            if getattr(faults, key):
                allowed = '0.0 with sensor absolute, which shows its angle and counts nothing'
                raise not_allowed(f'faults.{key}', getattr(faults, key), allowed)
        if self.sensor in ('single_channel', 'absolute') and faults.wiring == 'swapped':
            raise not_allowed('faults.wiring', faults.wiring, f'straight or inverted, with sensor {self.sensor}')
        return self


def _either(words: Sequence[str]) -> str:
    """Return 'A', 'A or B', or 'A, B or C'."""
    *others, last = words
    return f'{", ".join(others)} or {last}' if others else last


IDEAL_ENCODER = EncoderModel()


def counts_per_turn(ppr: PerWheel, model: EncoderModel) -> PerWheel:
    """Return the counts per wheel revolution: the model's if specified, else `ppr`."""
    counts = model.counts_per_wheel_turn
    return ppr if counts is None else PerWheel(left=counts, right=counts)
