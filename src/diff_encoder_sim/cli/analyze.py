"""analyze: how far /odom was from /world_pose in recorded trials, beside the closed form."""
from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import List, Optional, Sequence

from diff_encoder_sim.analysis.errors import odometry_error
from diff_encoder_sim.analysis.table import (AnalysedTrial, goal_table, pooled_table,
                                             trial_table)
from diff_encoder_sim.cli.run import run_tool
from diff_encoder_sim.errors import ConfigError
from diff_encoder_sim.recording.reading import read_trial

LEGEND = ('error: /odom minus /world_pose at the end, along (x) and across (y) the start heading.\n'
          'sigma: what whole pulses alone cause, one standard deviation over all wheel phases\n'
          '       (closed form; straight line of length S: sigma y = (S d/L) sqrt(1/6)).')

GOAL_LEGEND = ('seconds: simulated. Then where each source says that the robot ended, minus the goal: '
               'distance, and\nheading; /odom as seen from the true start.')


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Entry point of the executable."""
    run_tool('analyze', lambda: _analyze(_parse(arguments)))


def _analyze(options: argparse.Namespace) -> None:
    analysed: List[AnalysedTrial] = []
    problems = 0
    for path in _bags(options.paths):
        try:
            recording = read_trial(path)
            analysed.append(AnalysedTrial(recording, odometry_error(recording)))
        except ConfigError as error:
            problems += 1
            print(f'analyze: {error}', file=sys.stderr)
    if analysed:
        analysed.sort(key=_order)
        print('\n\n'.join(text for text in (trial_table(analysed), pooled_table(analysed), LEGEND,
                                            goal_table(analysed), GOAL_LEGEND) if text))
    if problems:
        sys.exit(1)


def _order(trial: AnalysedTrial) -> tuple:
    about = trial.recording.trial
    return about.test.name, about.odom, about.ppr.left, about.ppr.right, about.number


def _bags(paths: Sequence[Path]) -> List[Path]:
    """The bags named, and those in the folders named.

    Raises:
        ConfigError: a folder has no bag in it.
    """
    bags: List[Path] = []
    for path in paths:
        if not path.is_dir():
            bags.append(path)
            continue
        found = sorted(path.rglob('*.bag'))
        if not found:
            raise ConfigError(f'{path}: no .bag file in this folder')
        bags += found
    return bags


def _parse(arguments: Optional[Sequence[str]]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog='analyze', description=__doc__,
                                     epilog='example: analyze bags/ results/one.bag')
    parser.add_argument('paths', nargs='+', type=Path, metavar='BAG|DIR',
                        help='bags of trials, or folders to search for them')
    return parser.parse_args(arguments)
