"""The cases of the suite: motions of both wheels, and samples that are lost, late, repeated or wrong."""

from __future__ import annotations

import math
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.conformance.mapping import NodeMapping, Settings, Wheels

Segment = Tuple[float, float, float]  # linear [m/s], angular [rad/s], duration [s]

REST: Segment = (0.0, 0.0, 0.2)
SETTLE_SAMPLES = 3  # at rest at the end: the last message is then that of the last count
HOUR_S, HOUR_RATE_HZ = 3600.0, 2.0
MEMORY_SAMPLES, MEMORY_RATE_HZ = 20_000, 1000.0
HONEST_DRIVES = 40  # 120 degrees of freedom: the mean NEES / 3 of an honest node is within 0.64 to 1.46 in 99.9 %
ROUNDING_NOISE, SLIP_NOISE = 1e-9, 1e-4  # stated variance of the travel per metre [m^2/m]: only rounding; mainly slip
TIME_BACK_S = 1800.0
TWIST = 0.4, 1.0  # linear [m/s] and angular [rad/s]; half a turn


class Case(NamedTuple):
    """Samples of both wheels, relative to the position and time before them."""

    name: str
    times_s: np.ndarray  # (n,) ascending
    travels_m: np.ndarray  # (n, 2) of the left and right rim, as the encoder sees it
    is_motion: bool = False  # one of the 30 motions
    true_travels_m: np.ndarray = np.empty((0, 2))  # (n, 2) of a robot that slips
    order: Optional[Sequence[int]] = None  # rows in the order of sending; None: each once
    nan_row: int = -1  # whose angles are NaN
    restart_row: int = -1  # from which the counters start at zero again
    back_row: int = -1  # from which stamps are TIME_BACK_S earlier
    resets: bool = False  # the node is reset first
    pace: str = 'answered'  # each sample after an answer to the one before; burst: at once; stream; realtime

    @property
    def is_orderly(self) -> bool:
        """Return whether all samples, stamps and counters are right."""
        return max(self.nan_row, self.restart_row, self.back_row) < 0 and self.order is None

    @property
    def rows(self) -> List[int]:
        """Return the rows in the order of sending."""
        return list(range(len(self.times_s))) if self.order is None else list(self.order)


class Round(NamedTuple):
    """Cases of one start of the node."""

    settings: Settings
    first_count: int  # of both wheels
    cases: List[Case]


def plan(mapping: NodeMapping, wheels: Wheels, settings: Optional[Settings] = None) -> List[Round]:
    """Return all cases that the suite can play to a node: one round with the given settings of a running node."""
    is_fast = mapping.pace == 'fast'
    usual = _usual_cases(wheels, mapping)
    honest = list(_honest_cases(wheels, mapping, ROUNDING_NOISE, 'rounding')) if mapping.reset and is_fast else []
    wild = _wild_cases(mapping, wheels)
    if settings is not None:
        slip = settings.motion_noise_m2_per_m
        honest = list(_honest_cases(wheels, mapping, slip, 'slip')) if honest and slip else []
        return [Round(settings, mapping.first_count, [*usual, *honest, *wild])]
    moduli = [2**bits for bits in mapping.counter_bits]
    first_modulus = moduli[0] if moduli and not mapping.sets_counter else 0
    rounds = [Round(Settings(first_modulus, ROUNDING_NOISE), mapping.first_count, [*usual, *honest])]
    for modulus in moduli or [0]:
        cases = _wrap_cases(modulus, wheels, mapping) if modulus else []
        edge = max(modulus // 2 - 20, 1) if modulus else mapping.first_count + 12345
        rounds.append(Round(Settings(modulus, SLIP_NOISE), edge, cases))
    slip_cases = _honest_cases(wheels, mapping, SLIP_NOISE, 'slip') if honest and mapping.sets_noise else ()
    rounds[-1].cases.extend([*slip_cases, *wild])
    return rounds


def motions(wheels: Wheels) -> Dict[str, List[Segment]]:
    """Return the segments of config/conformance/suite/motions.yaml by name."""
    given = load_yaml(package_folder() / 'config' / 'conformance' / 'suite' / 'motions.yaml')
    about = {'left': 0.5 * wheels.wheel_separation, 'right': -0.5 * wheels.wheel_separation}
    return {name: [(about[v] * w if v in about else v, w, s) for v, w, s in given[name]] for name in given}


def _driven(name: str, segments: Sequence[Segment], wheels: Wheels, period_s: float, **about: Any) -> Case:
    """Return a case that starts and ends at rest; its segments are rounded to whole periods."""
    speeds = [(v, w) for v, w, duration_s in segments for _ in range(max(1, round(duration_s / period_s)))]
    steps_m = np.array(speeds) @ np.array([[1.0, 1.0], [-0.5, 0.5]] * np.array([[1.0], [wheels.wheel_separation]]))
    travels_m = np.vstack([np.zeros(2), np.cumsum(steps_m * period_s, axis=0)])
    travels_m = np.vstack([travels_m, np.repeat(travels_m[-1:], SETTLE_SAMPLES, axis=0)])
    return Case(name, period_s * np.arange(len(travels_m)), travels_m, **about)


def _usual_cases(wheels: Wheels, mapping: NodeMapping) -> List[Case]:
    period_s, is_fast = 1.0 / mapping.rate, mapping.pace == 'fast'
    to_and_fro = [(0.0, 0.5, 0.2), (0.0, -1.0, 0.4)]
    cases = [_driven('across zero', to_and_fro, wheels, period_s)]
    cases += [_driven(name, of_one, wheels, period_s, is_motion=True) for name, of_one in motions(wheels).items()]
    for name, speeds in (('irregular rate', (0.4, 1.5)), ('irregular rate, in place', (0.0, 2.0))):
        cases.append(_irregular(_driven(name, [(*speeds, 1.2)], wheels, period_s, is_motion=True), period_s))
    if is_fast:
        random = generator(1, 'hour')
        legs = random.uniform((0.0, -0.5), (0.5, 0.5), (720, 2)).tolist()
        hour = [(v, w, HOUR_S / 720) for v, w in legs]
        cases.append(_driven('one hour', hour, wheels, 1.0 / HOUR_RATE_HZ, is_motion=True, pace='stream'))
        circle = [(0.2, 0.5, MEMORY_SAMPLES / MEMORY_RATE_HZ)]
        cases.append(_driven('memory', circle, wheels, 1.0 / MEMORY_RATE_HZ, pace='stream'))
    turning = _driven('twist', [(*TWIST, math.pi)], wheels, period_s, pace='burst' if is_fast else 'realtime')
    straight = _straight(wheels, mapping)
    rows = straight.rows
    return [
        *cases,
        turning,
        straight._replace(name='rate', pace='realtime'),
        straight._replace(name='repeated samples', order=sorted(rows + rows[5:9])),
        straight._replace(name='late samples', order=[*rows[:8], 9, 8, 10, 12, 13, 11, *rows[14:]]),
        straight._replace(name='lost samples', order=[*rows[:5], *rows[18:]]),
        straight._replace(name='burst', pace='burst'),
        *([_driven('reset', [REST, (0.4, 1.0, 1.0)], wheels, period_s, resets=True)] if mapping.reset else []),
    ]


def _straight(wheels: Wheels, mapping: NodeMapping) -> Case:
    """Return a straight drive of at least 20 samples, in which some can be wrong: only clause 2.5 judges arcs."""
    return _driven('', [(0.4, 0.0, max(1.0, 20.0 / mapping.rate))], wheels, 1.0 / mapping.rate)


def _irregular(case: Case, period_s: float) -> Case:
    """Return a steady motion with samples at random times; the travels are proportional to the time."""
    moving = len(case.times_s) - SETTLE_SAMPLES
    steps = generator(1, case.name).uniform(0.3, 1.7, moving - 1)
    times = np.concatenate(([0.0], np.cumsum(steps * (moving - 1) / steps.sum())))
    travels_m = np.outer(times / (moving - 1), case.travels_m[-1])
    rest = times[-1] + np.arange(1, SETTLE_SAMPLES + 1)
    at_rest_m = np.repeat(case.travels_m[-1:], SETTLE_SAMPLES, axis=0)
    return case._replace(times_s=period_s * np.concatenate((times, rest)), travels_m=np.vstack((travels_m, at_rest_m)))


def _wrap_cases(modulus: int, wheels: Wheels, mapping: NodeMapping) -> List[Case]:
    """Return drives across the edge of the counters in both directions, below a quarter of all counts per sample.

    A wheel that reaches its speed within a sample accelerates by at most 100 rad/s^2: more looks like a restart.
    """
    speed_mps = min(
        0.5, 0.25 * modulus * wheels.m_per_count * mapping.rate, 50.0 * wheels.wheel_diameter / mapping.rate
    )
    bits = modulus.bit_length() - 1
    return [
        _driven(f'wrap of {bits} bits, {name}', [(sign * speed_mps, 0.0, 1.0)], wheels, 1.0 / mapping.rate)
        for name, sign in (('forward', 1.0), ('reverse', -1.0))
    ]


def _honest_cases(wheels: Wheels, mapping: NodeMapping, noise: float, name: str) -> Iterator[Case]:
    """Yield drives of random arcs from a reset, of a robot that slips as the covariance assumes."""
    random = generator(2, name)
    for number in range(HONEST_DRIVES):
        arcs = random.uniform((0.1, -1.5), (0.4, 1.5), (2, 2)).tolist()
        segments = [REST, *((v, w, 0.7) for v, w in arcs)]
        case = _driven(f'honest {name} {number + 1}', segments, wheels, 1.0 / mapping.rate, resets=True)
        steps_m = np.diff(case.travels_m, axis=0)
        slips_m = random.normal(0.0, np.sqrt(noise * abs(steps_m)))
        counted_m = np.vstack([np.zeros(2), np.cumsum(steps_m + slips_m, axis=0)])
        yield case._replace(travels_m=counted_m, true_travels_m=case.travels_m)


def _wild_cases(mapping: NodeMapping, wheels: Wheels) -> List[Case]:
    """Return the cases after which a node may be unusable."""
    straight = _straight(wheels, mapping)
    cases = [] if mapping.reads_counts else [straight._replace(name='NaN', nan_row=8)]
    cases.append(straight._replace(name='counter restart', restart_row=8))
    return [*cases, *([straight._replace(name='time back', back_row=8)] if mapping.pace == 'fast' else [])]
