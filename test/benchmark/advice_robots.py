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
from bench import CONFIG, parser, print_header, print_table
from scipy import stats
from synthetic_robots import SyntheticRobot, synthetic_robot

from diff_encoder_sim.advice import drive_draws
from diff_encoder_sim.advice.answers import Answer, Kind
from diff_encoder_sim.advice.drive_draws import DriveDraws
from diff_encoder_sim.advice.listed_encoders import Candidate, equivalent_counts, recommended
from diff_encoder_sim.advice.odometry_answer import OdometryCurves, odometry_answer
from diff_encoder_sim.wheels.encoder_params import PerWheel
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

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
