#!/usr/bin/env python3
"""Advice for odometry against a known truth: robots with random geometry, slip and encoder errors.

Each robot is advised as advise does it. The truth is on fresh seeds: many sampled drives of each candidate near the
requirement. Every fifth robot is driven by the simulator, the others roll on wheels by kinematics.
"""

from __future__ import annotations

import functools
import math
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
import yaml
from bench import CONFIG, ROOT, parser, print_header, print_table
from scipy import stats

from diff_encoder_sim.advice import drive_draws
from diff_encoder_sim.advice.answers import Answer, Kind, Requirement
from diff_encoder_sim.advice.drive_draws import DrawnRobot, DriveDraws, ErrorFreeDrive, drawn_robot, scripted
from diff_encoder_sim.advice.odometry_answer import OdometryCurves, odometry_answer
from diff_encoder_sim.advice.odometry_study import Candidate, equivalent_counts, recommended
from diff_encoder_sim.base.per_wheel import PerWheel
from diff_encoder_sim.navigation.goal_stopping import StopSpread
from diff_encoder_sim.trials.robot_params import load_robot, load_robot_config, override
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from drawn_drives import encoder_of, robot_of, rolled
from generated_robots import Recipe, urdf_of

SIMULATED_EVERY = 5  # the others roll on wheels by kinematics
SHARES = (0.8, 0.95)
# What an encoder of these counts may just reach is asked for, times a factor.
COUNTS, FACTORS = (12.0, 12_000.0), (0.75, 1.5)


class SyntheticRobot(NamedTuple):
    """A robot with an encoder of unknown counts, its drive, and what is asked of it."""

    text: str
    drive: ErrorFreeDrive
    robot: DrawnRobot
    encoder: EncoderParams
    requirement: Requirement


def synthetic_robot(number, folder):
    """Robot `number`; files of simulated ones are written to a folder."""
    rng = np.random.default_rng([16, number])
    radius_m, separation_m = 0.5 * _between(rng, 0.06, 0.4), _between(rng, 0.15, 1.0)
    errors, (encoder_text, encoder) = _wheel_errors(rng), _encoder(rng)
    kind, segments = _segments(rng)
    limits = {'speed': _between(rng, 0.3, 1.0), 'acceleration': 0.7, 'angular_speed': 1.0, 'angular_acceleration': 4.0}
    if number % SIMULATED_EVERY == 0:
        drive, robot = _simulated(folder, radius_m, separation_m, errors, rolled(*segments, **limits))
    else:
        drive = rolled(*segments, separation_m=separation_m, start={'yaw': rng.uniform(-math.pi, math.pi)}, **limits)
        robot = robot_of(radius_m, separation_m, _stop(rng), **errors)
    params = encoder_of(1000, encoder)
    requirement = _requirement(rng, DriveDraws(drive, robot, number), params)
    text = (
        f'{kind} of {drive.wheel_way_m:.1f} m, D {2.0 * radius_m:.2f}, L {separation_m:.2f} m, {encoder_text}, '
        f'{", ".join(f"{key} {value:.1g}" for key, value in errors.items()) or "no errors of the wheels"}'
    )
    return SyntheticRobot(text, drive, robot, params, requirement)


def _between(rng, low, high):
    """Evenly on a logarithmic scale."""
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def _wheel_errors(rng):
    drawn = {
        'left_radius_error': rng.normal(0.0, 3e-4),
        'right_radius_error': rng.normal(0.0, 3e-4),
        'wheel_separation_error': rng.normal(0.0, 2e-3),
        'radius_spread': _between(rng, 1e-5, 1e-3),
        'wheel_separation_spread': _between(rng, 1e-4, 1e-2),
        'left_slip': _between(rng, 1e-5, 1e-3),
        'right_slip': _between(rng, 1e-5, 1e-3),
        'slip_noise': _between(rng, 1e-9, 1e-5),
    }
    return {key: value for key, value in drawn.items() if rng.uniform() < 0.4}


def _encoder(rng):
    kinds = [
        ('ideal', {}),
        ('edges', {'edge_error': rng.uniform(0.05, 0.3)}),
        ('eccentricity', {'eccentricity': _between(rng, 1e-4, 2e-2)}),
        ('missed counts', {'faults': {'missed': _between(rng, 1e-6, 1e-3)}}),
        ('bursts', {'faults': {'missed': _between(rng, 1e-6, 1e-3), 'missed_burst': 20.0, 'extra': 1e-5}}),
        ('hysteresis', {'hysteresis': rng.uniform(0.5, 3.0)}),
        ('backlash', {'side': 'motor', 'gear_ratio': 30.0, 'backlash': _between(rng, 1e-4, 1e-2)}),
        (
            'absolute',
            {'sensor': 'absolute', 'noise': rng.uniform(0.0, 1.0), 'first_harmonic': _between(rng, 0.01, 1.0)},
        ),
        ('hall', {'sensor': 'hall', 'edge_error': rng.uniform(0.05, 0.2)}),
        ('all', {'edge_error': 0.1, 'eccentricity': 1e-3, 'hysteresis': 0.5, 'faults': {'missed': 1e-5}}),
    ]
    weights = np.array([6.0, *np.ones(len(kinds) - 1)])
    return kinds[rng.choice(len(kinds), p=weights / weights.sum())]


def _segments(rng):
    kind = ('line', 'turns', 'route')[rng.integers(3)]
    sign = 1.0 if rng.uniform() < 0.5 else -1.0
    if kind == 'line':
        return kind, [('straight', _between(rng, 2.0, 30.0))]
    if kind == 'turns':
        return kind, [('turns', sign * _between(rng, 0.25, 5.0))]
    segments = []
    for _ in range(rng.integers(2, 5)):
        segments += [('straight', rng.uniform(0.5, 5.0)), ('turns', rng.uniform(-0.4, 0.4))]
    return kind, segments


def _stop(rng):
    if rng.uniform() < 0.2:
        return StopSpread(0.09, 0.1)  # latched within tolerances
    return StopSpread(rng.uniform(0.003, 0.03), rng.uniform(0.005, 0.05))


def _simulated(folder, radius_m, separation_m, errors, like):
    """The drive by the simulator, and the robot as it is read of its files."""
    size_m = 0.7 * separation_m
    recipe = Recipe(
        mass_kg=20.0 * separation_m,
        com_m=(-0.1 * size_m, 0.0, radius_m),
        body_m=(size_m, 0.5 * size_m, 0.1),
        body_x_m=-0.2 * size_m,
        radius_m=radius_m,
        separation_m=separation_m,
        wheel_mass_kg=0.5 * separation_m,
        casters_m=((-0.5 * size_m, 0.0),),
        laser_m=(0.0, 0.0, 2.0 * radius_m + 0.2),
    )
    path = folder / f'{radius_m:.9f}.urdf'
    path.write_text(urdf_of(recipe, folder), encoding='utf-8')
    setup = load_robot(str(path), folder, ROOT, {})
    params = override(
        load_robot_config(ROOT / 'config'),
        {**setup.settings, **{f'simulator.wheel_errors.{key}': value for key, value in errors.items()}},
    )
    source = setup.file.source
    return scripted(like.requested.test, source, params), drawn_robot(source, params)


def _requirement(rng, draws, params):
    """What an encoder of random counts can just do, more, or less."""
    share = SHARES[rng.integers(len(SHARES))]
    counts = float(round(_between(rng, *COUNTS)))
    step = params.encoder.counts_that_repeat * params.encoder.shaft_turns_per_wheel_turn
    ppr = step * max(1, round(counts / step))
    (errors,) = draws.errors([params.model_copy(update={'ppr': encoder_of(ppr).ppr})], 400)
    shown = np.abs(errors)
    factor = _between(rng, *FACTORS)
    position_m = factor * float(np.quantile(shown[:, :2].max(axis=1), share))
    yaw_rad = factor * rng.uniform(1.0, 2.0) * float(np.quantile(shown[:, 2], share))
    return Requirement(share, _rounded(position_m), math.radians(_rounded(math.degrees(yaw_rad))), 0.95)


def _rounded(value):
    """As people write a tolerance; not finer than what can be asked for."""
    return max(1e-5, float(f'{value:.2g}'))


# Of the truth: for all candidates, and for those whose share is as near as this to the required one.
FEW, MANY, NEAR = 1000, 20_000, 0.04
# Draws of one seed; others end in other places.
OF_ONE_SEED = 1000
FRESH = 1_000_000  # added to seeds

AIMS = {'meets the share': 0.95, 'within one step of the smallest that does': 0.80}


class Judged(NamedTuple):
    number: int
    text: str
    share: float
    answer: Answer
    rank: Optional[int]  # of the recommended candidate
    truth: np.ndarray  # shares by rank
    endless: float  # share with an encoder of endless resolution
    advice_s: float

    @property
    def smallest(self) -> Optional[int]:
        enough = np.flatnonzero(self.truth >= self.share)
        return int(enough[0]) if len(enough) else None

    @property
    def meets(self) -> bool:
        return self.rank is not None and self.truth[self.rank] >= self.share

    @property
    def steps(self) -> float:
        return math.inf if self.rank is None or self.smallest is None else self.rank - self.smallest

    @property
    def kind(self) -> str:
        is_finer = self.answer.kind is Kind.FROM and self.rank is None
        return 'FROM more than the finest candidate has' if is_finer else self.answer.kind.name

    @property
    def is_right(self) -> bool:
        if self.answer.kind is Kind.FROM:
            return self.meets if self.rank is not None else self.smallest in (None, len(self.truth) - 1)
        if self.answer.kind is Kind.NOT_THE_LIMIT:
            return (self.endless >= self.share) == self.answer.of_encoder and self.smallest is None
        return True


def main() -> None:
    arguments = parser(__doc__, robots=200, first=1, workers=2).parse_args()
    print_header(f'Advice for {arguments.robots} synthetic robots against the truth')
    sweep = yaml.safe_load((CONFIG / 'campaigns' / 'sweep.yaml').read_text(encoding='utf-8'))
    candidates = [float(ppr) for ppr in sweep['ppr']]
    began_s = time.monotonic()
    with tempfile.TemporaryDirectory() as folder, ProcessPoolExecutor(
        arguments.workers, initializer=_one_thread
    ) as executor:
        judge = functools.partial(_judged, candidates, Path(folder))
        judged = []
        numbers = range(arguments.first, arguments.first + arguments.robots)
        for each in executor.map(judge, numbers):
            judged.append(each)
            print(f'{len(judged)} of {arguments.robots}: {_line(each, candidates)}', file=sys.stderr, flush=True)
            if not each.is_right or (each.rank is not None and abs(each.steps) > 1):
                print(f'wrong, or more than a step off: {each.text}\n{each.answer}', file=sys.stderr)
    _print_aims(judged)
    _print_kinds(judged)
    advice_s = [each.advice_s for each in judged]
    print(
        f'\nadvice: {np.median(advice_s):.1f} s, at most {max(advice_s):.1f} s, {arguments.workers} at once; all: '
        f'{(time.monotonic() - began_s) / 60.0:.1f} minutes'
    )


def _one_thread() -> None:
    """Leave the other cores to the other workers."""
    drive_draws.usable_cores = lambda: 1


def _judged(counts: Sequence[float], folder: Path, number: int) -> Judged:
    synthetic = synthetic_robot(number, folder)
    pprs = [PerWheel(left=each, right=each) for each in counts]
    encoders = [synthetic.encoder.model_copy(update={'ppr': ppr}) for ppr in pprs]
    began_s = time.monotonic()
    answer, rank = _advised(synthetic, encoders, number)
    advice_s = time.monotonic() - began_s
    every, share = [*encoders, None], synthetic.requirement.share  # None: of endless resolution
    truth = _shares(synthetic, every, number, FEW)
    near = np.flatnonzero(np.abs(truth - share) < NEAR)
    if len(near):
        truth[near] = _shares(synthetic, [every[index] for index in near], number, MANY)
    return Judged(number, synthetic.text, share, answer, rank, truth[:-1], float(truth[-1]), advice_s)


def _advised(synthetic: SyntheticRobot, encoders: Sequence[EncoderParams], number: int) -> Tuple[Answer, Optional[int]]:
    draws = DriveDraws(synthetic.drive, synthetic.robot, number)
    curves = OdometryCurves([draws], synthetic.encoder)
    answer = odometry_answer(curves, synthetic.requirement)
    candidates = [Candidate(f'{each.ppr.left:g}', equivalent_counts(each), each) for each in encoders]
    found = recommended(
        sorted(candidates, key=lambda candidate: candidate.counts), answer, [draws], synthetic.requirement
    )
    return answer, None if found is None else candidates.index(found)


def _shares(
    synthetic: SyntheticRobot, encoders: Sequence[Optional[EncoderParams]], number: int, draws: int
) -> np.ndarray:
    portions = [
        DriveDraws(synthetic.drive, synthetic.robot, FRESH * (1 + portion) + number).errors(encoders, OF_ONE_SEED)
        for portion in range(draws // OF_ONE_SEED)
    ]
    return np.array([np.mean(synthetic.requirement.within(np.concatenate(errors))) for errors in zip(*portions)])


def _print_aims(judged: Sequence[Judged]) -> None:
    advised = [each for each in judged if each.rank is not None]
    if not advised:
        return
    found = dict(zip(AIMS, ([each.meets for each in advised], [abs(each.steps) <= 1 for each in advised])))
    rows = []
    for aim, fraction in AIMS.items():
        interval = stats.binomtest(sum(found[aim]), len(advised)).proportion_ci(0.95, 'wilson')
        percent = f'{100.0 * np.mean(found[aim]):.1f} ({100.0 * interval.low:.1f} to {100.0 * interval.high:.1f})'
        rows.append([aim, f'{sum(found[aim])} of {len(advised)}', percent, f'{100.0 * fraction:.0f}'])
    print_table(rows, ['recommended candidate', 'robots', '% (95 % interval)', 'aim [%]'])
    missing = [100.0 * (each.share - each.truth[each.rank]) for each in advised if not each.meets]
    if missing:
        print(f'Those that do not meet it: by {np.median(missing):.2f} %, at most {max(missing):.2f} % of the trials.')


def _print_kinds(judged: Sequence[Judged]) -> None:
    kinds: Dict[str, List[bool]] = {}
    for each in judged:
        kinds.setdefault(each.kind, []).append(each.is_right)
    rows = [[kind, len(right), len(right) - sum(right)] for kind, right in sorted(kinds.items())]
    print_table(rows, ['answer', 'robots', 'wrong'])


def _line(each: Judged, candidates: Sequence[float]) -> str:
    def of(rank: Optional[int]) -> str:
        return 'none' if rank is None else f'{candidates[rank]:g} ({100.0 * each.truth[rank]:.1f} %)'

    return (
        f'robot {each.number}, {100.0 * each.share:g} % asked for: {each.kind}, {of(each.rank)}; smallest: '
        f'{of(each.smallest)}; endless: {100.0 * each.endless:.1f} %; {each.advice_s:.1f} s'
    )


if __name__ == '__main__':
    main()
