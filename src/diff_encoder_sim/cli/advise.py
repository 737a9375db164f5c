"""advise: the smallest encoder with which a robot ends its tests within a tolerance."""

from __future__ import annotations

import argparse
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import List, Optional, Sequence

from distributed import Client

from diff_encoder_sim.advice.encoder_search import WORDS, Advisor, Tolerance
from diff_encoder_sim.analysis.campaign_dataset import data_of
from diff_encoder_sim.analysis.dataset import TrialData, ppr_value
from diff_encoder_sim.analysis.quantities import YAW, X
from diff_encoder_sim.analysis.within_tolerance import REQUIRED_FRACTION, fewest_trials
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.paths import package_folder
from diff_encoder_sim.campaign.campaign_definition import Campaign, TrialJob
from diff_encoder_sim.campaign.campaign_loading import load_campaign
from diff_encoder_sim.campaign.engine import run_campaign
from diff_encoder_sim.campaign.manifest import describe_run
from diff_encoder_sim.campaign.progress import progress_on
from diff_encoder_sim.campaign.store import ResultStore
from diff_encoder_sim.campaign.worker import RunTrial
from diff_encoder_sim.cli.trial_workers import add_workers, count, positive, run_trials_tool, told, unrun_text, workers
from diff_encoder_sim.encoders.pulses import ppr_label
from diff_encoder_sim.evaluation.sample_statistics import LEVEL
from diff_encoder_sim.lockstep.trial_run import run_trial

# Trials of each test after which to look whether an encoder is decided: every so many, at most so
# many.
LOOK_EVERY, DEFAULT_TRIALS = 30, 60
DEFAULT_OUT = Path('results') / 'advice'


def main(arguments: Optional[Sequence[str]] = None, run: RunTrial = run_trial) -> None:
    """Entry point of the executable; `run` runs one trial on a worker."""
    options = _parse(arguments)
    run_trials_tool('advise', lambda: _advise(options, run))


def _advise(options: argparse.Namespace, run: RunTrial) -> None:
    looks = _looks(options.trials)
    campaign = load_campaign(
        options.candidates,
        package_folder(),
        {'tests': options.tests, 'ppr': options.ppr, 'trials': options.trials, 'robot': options.robot},
    )
    labels, tolerance = _ascending(campaign), Tolerance(options.tolerance, options.yaw_tolerance)
    _warn_of_goal_tolerance(campaign, tolerance)
    with _Bench(options, campaign, run) as bench:
        advisor = Advisor(labels, looks, tolerance, bench.trials_with)
        found = {source: advisor.smallest(source) for source in WORDS}
    print(
        f'{advisor.table()}\nyes: at least {100 * REQUIRED_FRACTION:.0f} % of the trials end within '
        f'{tolerance.position_m:g} m in x and y and {tolerance.yaw_deg:g} degrees, with '
        f'{100 * LEVEL:.0f} % confidence;\nno: fewer do; ?: undecided.\n\nYes in every test:'
    )
    for source, label in found.items():
        print(f'  {WORDS[source]}: {_answer(labels, label)}')


def _answer(labels: Sequence[str], label: Optional[str]) -> str:
    if label is None:
        return f'with no encoder up to {labels[-1]} PPR'
    return f'from {label} PPR on' + (', the smallest candidate' if label == labels[0] else '')


def _looks(trials: int) -> List[int]:
    """After how many trials to look; an error where so few cannot show the required share."""
    if trials < fewest_trials():
        raise ConfigError(
            f'--trials: given {trials}; allowed: from {fewest_trials()}, as fewer '
            f'cannot show a share of {100 * REQUIRED_FRACTION:.0f} %'
        )
    return [*range(LOOK_EVERY, trials, LOOK_EVERY), trials]


class _Bench:
    """Runs the trials of an encoder when it is asked for them. A context."""

    def __init__(self, options: argparse.Namespace, campaign: Campaign, run: RunTrial) -> None:
        self._options = options
        self._campaign = campaign
        self._run_trial = run
        self._client: Optional[Client] = None  # from the first trial on
        self._store = ResultStore(options.out, campaign, describe_run(package_folder(), sys.argv))
        self._opened = ExitStack()
        self._opened.enter_context(self._store)

    def __enter__(self) -> _Bench:
        return self

    def __exit__(self, *error: object) -> None:
        if error[0] is None:
            self._store.finish()
        self._opened.__exit__(*error)

    def trials_with(self, label: str, count: int) -> List[TrialData]:
        """The first so many of each test with an encoder; what has a result is not run again."""
        jobs = [job for job in self._store.pending() if job.trial <= count and self._label(job) == label]
        if jobs:
            self._run(label, jobs)
        return [data_of(row) for row in self._store.rows if row.ppr == label and row.trial <= count]

    def _run(self, label: str, jobs: Sequence[TrialJob]) -> None:
        print(f'{label} PPR', file=sys.stderr)
        if self._client is None:
            self._client = self._opened.enter_context(workers(self._options, len(jobs)))
        progress = progress_on(sys.stderr, len(jobs), [])
        with progress, told(progress):
            unrun = run_campaign(self._client, self._campaign, self._store, progress, jobs, self._run_trial)
        if unrun:
            sys.exit(unrun_text('advise', self._campaign, unrun))

    def _label(self, job: TrialJob) -> str:
        return ppr_label(self._campaign.cells[job.cell_index].ppr)


def _ascending(campaign: Campaign) -> List[str]:
    labels = [ppr_label(ppr) for ppr in campaign.params.ppr]
    for label in labels:
        if ppr_value(label) is None:
            raise ConfigError(f'ppr: given {label}; allowed: one number for both wheels')
    return sorted(labels, key=float)


def _warn_of_goal_tolerance(campaign: Campaign, tolerance: Tolerance) -> None:
    """Navigation stops where its own tolerance allows: no encoder makes it stop nearer."""
    planner = campaign.cells[0].robot_params.navigator.DWAPlannerROS
    if campaign.params.nav == 'embedded' and tolerance.position_m < planner.xy_goal_tolerance:
        print(
            f'advise: navigation stops within {planner.xy_goal_tolerance:g} m of a goal; for '
            f'{tolerance.position_m:g} m set navigation.DWAPlannerROS.xy_goal_tolerance in the '
            f'robot file',
            file=sys.stderr,
        )


def _parse(arguments: Optional[Sequence[str]]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='advise',
        description=__doc__,
        epilog='example: advise --robot my_robot.yaml --tolerance 0.05 --yaw-tolerance 3. Encoders '
        'are tried by halves; the same command again goes on with what is not done yet, and '
        'analyze makes a report of what is.',
    )
    parser.add_argument(
        '--robot',
        '--config',
        metavar='FILE',
        help="a .yaml file like config/alto.yaml, or a xacro or URDF file (default: the package's ALTO)",
    )
    parser.add_argument(
        '--tolerance',
        type=positive,
        default=X.tolerance,
        metavar='M',
        help='of x and of y at the goal (default: %(default)g)',
    )
    parser.add_argument(
        '--yaw-tolerance',
        type=positive,
        default=YAW.tolerance,
        metavar='DEG',
        help='of the heading at the goal (default: %(default)g)',
    )
    parser.add_argument('--tests', nargs='+', metavar='TEST', help='names, or .yaml files')
    parser.add_argument(
        '--ppr', nargs='+', type=positive, metavar='N', help='encoders to choose from, in pulses per revolution'
    )
    parser.add_argument(
        '--candidates',
        default='sweep',
        metavar='NAME|FILE',
        help='campaign file that has the tests and encoders where they are not given (default: %(default)s)',
    )
    parser.add_argument(
        '--trials',
        type=count,
        default=DEFAULT_TRIALS,
        metavar='N',
        help=f'at most, of each test with each encoder (default: %(default)d); most are decided after {LOOK_EVERY}',
    )
    parser.add_argument(
        '--out',
        type=Path,
        default=DEFAULT_OUT,
        metavar='DIR',
        help='new, or with results of the same configuration (default: %(default)s)',
    )
    add_workers(parser)
    return parser.parse_args(arguments)
