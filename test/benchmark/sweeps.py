#!/usr/bin/env python3
"""What scripted trials cost that differ in PPR alone, run as one drive, beside the same trials one by one: processor
time of one process. Checks that the results are equal, and the bags byte for byte."""

from __future__ import annotations

import argparse
import itertools
import sys
import tempfile
import time
from pathlib import Path
from typing import List, Sequence, Tuple

from checkout import ROOT, print_header
from counts import COUNT
from plans import plan_of
from ratios import Ratio, add_json, print_ratios, write_ratios

from diff_encoder_sim.trials.results import TrialRow
from diff_encoder_sim.trials.robot_params import load_robot_params
from diff_encoder_sim.trials.trial_run import run_trials
from diff_encoder_sim.trials.trial_setup import TrialSetup

ROBOT = ROOT / 'urdf' / 'alto.urdf.xacro'
MOST = 1.0 / 3.0


def main() -> None:
    """Print the table."""
    arguments = _arguments()
    print_header(f'{len(arguments.ppr)} PPR in one scripted drive, in {arguments.repeats} rounds')
    of = f'{len(arguments.ppr)} drives'
    with tempfile.TemporaryDirectory() as folder:
        _costs('SL', arguments.ppr[:1], 'full', Path(folder))  # fills caches
        ratios = [
            Ratio(f'{test}, record {mode}', of, _rounds(test, mode, arguments, Path(folder)), MOST)
            for test, mode in itertools.product(arguments.tests, arguments.record)
        ]
    print_ratios(ratios)
    write_ratios(arguments.json, ratios)


def _rounds(test: str, mode: str, arguments: argparse.Namespace, folder: Path) -> List[float]:
    rounds = [_costs(test, arguments.ppr, mode, folder) for _ in range(arguments.repeats)]
    return [together_s / alone_s for together_s, alone_s in rounds]


def _costs(test: str, pprs: Sequence[float], mode: str, folder: Path) -> Tuple[float, float]:
    """Return the processor time [s] of the trials together and alone, which are run around it."""
    half = len(pprs) // 2
    first_s, first = _alone(test, pprs[:half], mode, folder / 'alone')
    together_s, together = _run(test, pprs, mode, folder / 'together')
    second_s, second = _alone(test, pprs[half:], mode, folder / 'alone')
    if together != [*first, *second] or any(
        _bag(folder / 'together', ppr).read_bytes() != _bag(folder / 'alone', ppr).read_bytes()
        for ppr in pprs
        if mode != 'none'
    ):
        sys.exit(f'{test}, record {mode}: the trials of one drive are not those of a drive for each')
    return together_s, first_s + second_s


def _alone(test: str, pprs: Sequence[float], mode: str, folder: Path) -> Tuple[float, List[TrialRow]]:
    runs = [_run(test, [ppr], mode, folder) for ppr in pprs]
    return sum(spent_s for spent_s, _ in runs), [result for _, (result,) in runs]


def _run(test: str, pprs: Sequence[float], mode: str, folder: Path) -> Tuple[float, List[TrialRow]]:
    params = load_robot_params(ROOT / 'config')
    setups = [TrialSetup(plan_of(test, ppr, 1, 'scripted', str(_bag(folder, ppr))), params) for ppr in pprs]
    begin_s = time.process_time()
    results = run_trials(setups, ROBOT, mode)
    return time.process_time() - begin_s, results


def _bag(folder: Path, ppr: float) -> Path:
    return folder / f'{ppr:g}.bag'


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--tests', nargs='+', default=['SL', 'SMT'], help='tests with a script')
    parser.add_argument('--ppr', nargs='+', type=float, default=[40.0, 90.0, 1024.0, 4096.0])
    parser.add_argument('--record', nargs='+', default=['full', 'minimal', 'none'])
    parser.add_argument('--repeats', type=COUNT, default=5, help='rounds of trials alone and together')
    add_json(parser)
    return parser.parse_args()


if __name__ == '__main__':
    main()
