#!/usr/bin/env python3
"""What keeps the true pose from the goal: stopping, localization or both, by test and PPR.

accuracy.py results/paper results/accurate    of campaigns that were run before
accuracy.py --trials 3                        runs `paper` and `accurate` itself, and counts AMCL's particles
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import os
import tempfile
from pathlib import Path
from typing import Dict, Iterable, Iterator, List, NamedTuple, Sequence, Tuple

import numpy as np
from checkout import ROOT, print_header
from counts import COUNT
from tabulate import tabulate

from diff_encoder_sim.analysis.quantities import QUANTITIES
from diff_encoder_sim.analysis.results_loading import load_results
from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import FinalErrors, TrialPlan
from diff_encoder_sim.trials.campaign_cells import Campaign, RequestedTrial
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.lockstep_trial import LockstepTrial
from diff_encoder_sim.trials.trial_run import final_errors
from diff_encoder_sim.trials.trials_csv import PARTS
from diff_encoder_sim.wheels.encoder_params import ppr_label

CAUSES = ['truth\noutside', 'by\nstopping', 'by local-\nization', 'only\ntogether', 'AMCL\nparticles']
SPREADS = [
    f'{what}\n{part}'
    for what in ('estimate\n- goal', 'truth\n- estimate', 'odometry\n- truth')
    for part in ('along [mm]', 'across [mm]', 'yaw [deg]')
]
LEGEND = """Outside: more than 0.05 m in x or y or 3 degrees from the goal. Of these, "by stopping" would be with
perfect localization, "by localization" with a perfect stop (both may hold), "only together" with neither alone.
Along and across: of the heading at the goal."""

Cell = Tuple[str, str]  # test with what the campaign varies, PPR


class End(NamedTuple):
    """Where one trial ended: differences along the goal's heading, across it to the left, and in heading."""

    truth: Pose2D  # minus goal
    stopping: Pose2D  # estimate minus goal
    localization: Pose2D  # truth minus estimate
    odometry: Pose2D  # odometry minus truth
    particles: float  # of AMCL, median over its updates; NaN where they were not counted


def main() -> None:
    """Print a table for each folder, or for each campaign that is run."""
    arguments = _arguments()
    if arguments.results:
        print_header('final poses of campaigns')
        for folder in arguments.results:
            _print(str(folder), _ends_in(folder))
    else:
        print_header(f'final poses of {arguments.trials} trials of each test and PPR in lockstep')
        for name in arguments.campaigns:
            _print(name, _ends_of(name, arguments))
    print(LEGEND)


def _ends_in(folder: Path) -> Dict[Cell, List[End]]:
    results = load_results([folder])
    ends: Dict[Cell, List[End]] = {}
    for row in results.trials.to_dict('records'):
        goal, varied = results.requested[row['test']].goal(), [(key, row[key]) for key in results.varied]
        errors = {source: Pose2D(*(row[f'{source.value}_{part}'] for part in PARTS)) for source in PoseSource}
        known = {source: error for source, error in errors.items() if not math.isnan(error.x_m)}
        ends.setdefault((_label(row['test'], varied), row['ppr']), []).extend(_end(known, goal, math.nan))
    return ends


def _ends_of(name: str, arguments: argparse.Namespace) -> Dict[Cell, List[End]]:
    replaced = {key: getattr(arguments, key) for key in ('tests', 'ppr', 'trials')}
    campaign = load_campaign(name, ROOT, replaced)
    ends: Dict[Cell, List[End]] = {}
    with tempfile.TemporaryDirectory() as folder, multiprocessing.Pool(arguments.workers) as pool:
        runs = pool.imap(_run, ((campaign, job, folder) for job in campaign.trials()))
        for job, found in zip(campaign.trials(), runs):
            cell = job.cell
            label = _label(cell.test.name, cell.varied_texts())
            ends.setdefault((label, ppr_label(cell.ppr)), []).extend(found)
    return ends


def _label(test: str, varied: Iterable[Tuple[str, str]]) -> str:
    return ', '.join((test, *(f'{key.rpartition(".")[2]} {text}' for key, text in varied)))


def _run(task: Tuple[Campaign, RequestedTrial, str]) -> List[End]:
    """Run one trial; a list, empty for one that did not come to its goal."""
    campaign, job, folder = task
    files, trial = campaign.files.materialise(folder), job.definition()
    plan = TrialPlan(trial=trial, bag='', **files.worlds[trial.test.name]._asdict())
    loop = LockstepTrial(plan, files.robot, job.cell.robot_params)
    counts = [len(report.estimate.particles) for report in loop.run() if report.estimate is not None]
    return list(
        _end(final_errors(trial, loop.true_pose_in_map, loop.last_report), trial.goal(), float(np.median(counts)))
    )


def _end(errors: FinalErrors, goal: Pose2D, particles: float) -> Iterator[End]:
    """Yield the end of a trial, or nothing where a pose is missing."""
    found = [errors.get(source) for source in (PoseSource.GLOBAL, PoseSource.WORLD, PoseSource.ODOM)]
    estimate, truth, odometry = (pose and _along(pose, goal.yaw_rad) for pose in found)
    if estimate and truth and odometry:
        yield End(truth, estimate, _minus(truth, estimate), _minus(odometry, truth), particles)


def _along(error: Pose2D, heading_rad: float) -> Pose2D:
    """Turn an error in the map's axes to those along and across a heading."""
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    return Pose2D(cos * error.x_m + sin * error.y_m, cos * error.y_m - sin * error.x_m, error.yaw_rad)


def _minus(one: Pose2D, other: Pose2D) -> Pose2D:
    return Pose2D(one.x_m - other.x_m, one.y_m - other.y_m, wrap_angle(one.yaw_rad - other.yaw_rad))


def _is_outside(error: Pose2D) -> bool:
    return any(abs(error[each.component]) * each.scale > each.tolerance for each in QUANTITIES)


def _print(title: str, ends: Dict[Cell, List[End]]) -> None:
    pooled: Dict[Cell, List[End]] = {}
    for (test, _), found in ends.items():
        pooled.setdefault((test, 'all'), []).extend(found)
    every = {**ends, **(pooled if len(pooled) < len(ends) else {})}
    _print_table(title, CAUSES, {cell: _causes(found) for cell, found in every.items()})
    _print_table(
        f'{title}: mean and standard deviation', SPREADS, {cell: _spreads(found) for cell, found in every.items()}
    )


def _print_table(title: str, heads: Sequence[str], rows: Dict[Cell, List[str]]) -> None:
    print(title)
    table = [[*cell, *row] for cell, row in rows.items()]
    print(tabulate(table, ['test', 'PPR', *heads], disable_numparse=True, stralign='right'), end='\n\n', flush=True)


def _causes(ends: Sequence[End]) -> List[str]:
    outside = [end for end in ends if _is_outside(end.truth)]
    stopping = sum(_is_outside(end.stopping) for end in outside)
    localization = sum(_is_outside(end.localization) for end in outside)
    together = sum(not (_is_outside(end.stopping) or _is_outside(end.localization)) for end in outside)
    particles = np.array([end.particles for end in ends])
    return [
        f'{len(outside)}/{len(ends)}',
        *(str(count) for count in (stopping, localization, together)),
        '-' if np.isnan(particles).any() else f'{np.median(particles):.0f}',
    ]


def _spreads(ends: Sequence[End]) -> List[str]:
    parts = zip(*((end.stopping, end.localization, end.odometry) for end in ends))
    return [text for poses in parts for text in _moments(poses)]


def _moments(poses: Sequence[Pose2D]) -> List[str]:
    """Return mean and standard deviation along [mm], across [mm] and of the heading [degrees]."""
    values = np.array(poses) * (1e3, 1e3, math.degrees(1.0))
    deviations = values.std(axis=0, ddof=1) if len(values) > 1 else np.full(3, math.nan)
    return [
        f'{mean:+.{digits}f} ± {deviation:.{digits}f}'
        for mean, deviation, digits in zip(values.mean(axis=0), deviations, (1, 1, 2))
    ]


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('results', nargs='*', type=Path, help='results folders of campaigns')
    group = parser.add_argument_group('without results folders')
    group.add_argument('--campaigns', nargs='+', default=['paper', 'accurate'])
    group.add_argument('--tests', nargs='+', default=['SL', 'SMT', 'DLD'])
    group.add_argument('--ppr', nargs='+', type=float, default=[40.0, 90.0, 1024.0, 4096.0])
    group.add_argument('--trials', type=COUNT, default=3)
    group.add_argument('--workers', type=COUNT, default=os.cpu_count())
    return parser.parse_args()


if __name__ == '__main__':
    main()
