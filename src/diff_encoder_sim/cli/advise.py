"""advise: find the encoder with the fewest pulses per revolution that keeps a robot within a tolerance.

Simulates trials of each test with candidate encoders, until it is known with confidence which candidates meet the
tolerance. Ideal encoders (--ppr) are searched by bisection; real ones (--encoders) are all tried, as more counts need
not be better. Results are kept: the same command runs the trials that are missing, and analyze makes a report of them.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, List, Mapping, Optional, Sequence

from diff_encoder_sim.advice.encoder_search import CRITERIA, Advisor, Tolerance
from diff_encoder_sim.analysis.encoder_labels import encoders_text, is_real, ppr_order, ppr_value
from diff_encoder_sim.analysis.quantities import YAW, X
from diff_encoder_sim.analysis.within_tolerance import REQUIRED_FRACTION, fewest_trials
from diff_encoder_sim.base.bounded_numbers import PULSES_PER_TURN, Between
from diff_encoder_sim.base.command_line import tool_parser
from diff_encoder_sim.base.command_name import as_called
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.number_arguments import number_within, whole_number_within
from diff_encoder_sim.base.paths import package_folder
from diff_encoder_sim.campaign.campaign_definition import Campaign
from diff_encoder_sim.campaign.campaign_loading import load_campaign
from diff_encoder_sim.campaign.campaign_params import MOST_TRIALS
from diff_encoder_sim.campaign.worker import RunTrial
from diff_encoder_sim.cli.amcl_argument import add_amcl, chosen_files
from diff_encoder_sim.cli.candidate_trials import CandidateTrials
from diff_encoder_sim.cli.encoder_arguments import add_encoders, name_campaigns_encoders
from diff_encoder_sim.cli.robot_arguments import add_robot_arguments
from diff_encoder_sim.cli.robot_checks import add_unchecked, with_checks
from diff_encoder_sim.cli.stopping_spread import name_stopping
from diff_encoder_sim.cli.trial_workers import add_workers, run_trials_tool
from diff_encoder_sim.encoders.pulses import ppr_label
from diff_encoder_sim.evaluation.sample_statistics import LEVEL
from diff_encoder_sim.lockstep.trial_run import run_trial
from diff_encoder_sim.robots.xacro_arguments import xacro_arguments
from diff_encoder_sim.trials.pose_source import PoseSource

# An encoder is judged each time that so many trials of each test are done, and after the last.
JUDGED_EVERY, DEFAULT_TRIALS = 30, 60
DEFAULT_OUT = Path('results') / 'advice'


def main(arguments: Optional[Sequence[str]] = None, run: RunTrial = run_trial) -> None:
    """Run the command line; `run` runs one trial on a worker."""
    options = _parse(arguments)
    run_trials_tool('advise', lambda: _advise(options, run))


def _advise(options: argparse.Namespace, run: RunTrial) -> None:
    looks = _looks(options.trials)
    given = {key: getattr(options, key) for key in ('tests', 'ppr', 'encoders', 'trials', 'robot')}
    given['files'] = chosen_files(options)
    campaign = _candidates(options, given)
    campaign = with_checks('advise', campaign, options.unchecked)
    labels, tolerance = _ascending(campaign), Tolerance(options.tolerance, options.yaw_tolerance)
    name_campaigns_encoders(as_called('advise'), campaign)
    name_stopping('advise', campaign, tolerance.position_m, tolerance.yaw_deg)
    with CandidateTrials(options, campaign, run) as trials:
        advisor = Advisor(labels, looks, tolerance, trials.with_encoder)
        found = {source: _found(advisor, labels, source) for source in CRITERIA}
    print(f'{advisor.table()}\n{_legend(tolerance)}\n{_own_encoder(campaign)}\nYes in every test:')
    for source, text in found.items():
        print(f'  {CRITERIA[source]}: {text}')


def _candidates(options: argparse.Namespace, given: Mapping[str, Any]) -> Campaign:
    """Load the candidates; the robot's own encoder is one of them, unless --ppr is given."""
    arguments = xacro_arguments(options.robot_args)
    campaign = load_campaign(options.candidates, package_folder(), given, arguments, options.packages)
    own = campaign.robot and campaign.robot.ppr
    candidates = campaign.params.ppr
    if not own or options.ppr or campaign.params.encoders or f'{own:g}' in map(ppr_label, candidates):
        return campaign
    pprs = [*(ppr.model_dump() for ppr in candidates), own]
    return load_campaign(options.candidates, package_folder(), {**given, 'ppr': pprs}, arguments, options.packages)


def _own_encoder(campaign: Campaign) -> str:
    known = campaign.robot and campaign.robot.ppr
    return f"The robot's own encoder has {known:g} PPR.\n" if known else ''


def _legend(tolerance: Tolerance) -> str:
    return (
        f'yes: at least {100 * REQUIRED_FRACTION:.0f} % of the trials end within {tolerance.position_m:g} m in x and y '
        f'and {tolerance.yaw_deg:g} degrees, with {100 * LEVEL:.0f} % confidence;\nno: fewer do; ?: undecided.'
    )


def _found(advisor: Advisor, labels: Sequence[str], source: PoseSource) -> str:
    """Search the encoders that are sufficient."""
    if any(map(is_real, labels)):
        sufficient = advisor.sufficient(source)
        return f'with {encoders_text(sufficient)}' if sufficient else 'with none of these encoders'
    label = advisor.smallest(source)
    if label is None:
        return f'with no encoder up to {labels[-1]} PPR'
    return f'from {label} PPR on' + (', the smallest candidate' if label == labels[0] else '')


def _looks(trials: int) -> List[int]:
    """Return the numbers of trials after which to judge an encoder.

    Raises:
        ConfigError: so few trials cannot show the required fraction.
    """
    if trials < fewest_trials():
        raise ConfigError(
            f'--trials: given {trials}; allowed: from {fewest_trials()}, as fewer '
            f'cannot show that {100 * REQUIRED_FRACTION:.0f} % of all trials are within the tolerance'
        )
    return [*range(JUDGED_EVERY, trials, JUDGED_EVERY), trials]


def _ascending(campaign: Campaign) -> List[str]:
    labels = [encoder.label for encoder in campaign.encoders]
    for label in labels:
        if ppr_value(label) is None:
            raise ConfigError(f'ppr: given {label}; allowed: one number for both wheels')
    return sorted(labels, key=ppr_order)


def _parse(arguments: Optional[Sequence[str]]) -> argparse.Namespace:
    examples = [
        '--robot my_robot.yaml --tolerance 0.05 --yaw-tolerance 3',
        '--tests SL --ppr 40 90 180 360 --trials 60 --out results/advice_sl',
        '--encoders catalogue --out results/advice_catalogue',
    ]
    parser = tool_parser('advise', __doc__, examples)
    add_robot_arguments(parser, '--config', note=' (default: alto)')
    add_amcl(parser)
    _add_tolerances(parser)
    _add_candidates(parser)
    parser.add_argument(
        '--out',
        type=Path,
        default=DEFAULT_OUT,
        metavar='DIR',
        help='results folder: new, or with results of the same robot, tests and candidates (default: %(default)s)',
    )
    add_workers(parser)
    add_unchecked(parser)
    return parser.parse_args(arguments)


def _add_tolerances(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        '--tolerance',
        type=number_within(Between(1e-6, 1000.0, 'm')),
        default=X.tolerance,
        metavar='M',
        help='allowed error in x and in y at the goal, in metres (default: %(default)g)',
    )
    parser.add_argument(
        '--yaw-tolerance',
        type=number_within(Between(1e-6, 360.0, 'degrees')),
        default=YAW.tolerance,
        metavar='DEG',
        help='allowed error of the heading at the goal, in degrees (default: %(default)g)',
    )


def _add_candidates(parser: argparse.ArgumentParser) -> None:
    parser.add_argument('--tests', nargs='+', metavar='TEST', help='tests: SL, SMT, DLD, or .yaml files')
    parser.add_argument(
        '--ppr',
        nargs='+',
        type=number_within(PULSES_PER_TURN),
        metavar='N',
        help='candidates, ideal encoders in pulses per wheel revolution',
    )
    add_encoders(parser)
    parser.add_argument(
        '--candidates',
        default='sweep',
        metavar='NAME|FILE',
        help='campaign file with the tests and candidates, where these options do not give them (default: %(default)s)',
    )
    parser.add_argument(
        '--trials',
        type=whole_number_within(Between(1, MOST_TRIALS)),
        default=DEFAULT_TRIALS,
        metavar='N',
        help='most trials of each test with each candidate '
        f'(default: %(default)d); most candidates are decided after {JUDGED_EVERY}',
    )
