"""campaign: run many simulated trials, of several tests and encoders, faster than real time, into one results folder.

Trials run in lockstep in worker processes. Results are kept if the campaign is stopped or killed: the same command runs
the missing trials.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Optional, Sequence

from diff_encoder_sim.base.bounds import PULSES_PER_TURN, TRIALS
from diff_encoder_sim.base.command_line import faults_of_trials, number_within, tool_parser, whole_number_within
from diff_encoder_sim.cli.arguments import add_amcl, add_encoders, add_robot_arguments, add_unchecked, add_workers
from diff_encoder_sim.drives.topics import BAG_FORMATS

if TYPE_CHECKING:
    from diff_encoder_sim.trials.trial_run import RunTrials


API = 'api.campaigns'  # imported by the command on demand


def parse(arguments: Optional[Sequence[str]] = None) -> argparse.Namespace:
    """Read the command line."""
    examples = [
        '--config quick --out results/quick',
        '--config paper --out results/sl --tests SL --ppr 40 90 --trials 10',
        '--config paper --amcl amcl_accurate --out results/paper_accurate',
        '--config quick --encoders amt102 pololu_25d --out results/encoders',
        '--config quick --robot burger --out results/burger',
        '--config quick --robot my_robot.yaml --out results/my_robot',
    ]
    parser = tool_parser('campaign', __doc__, examples)
    parser.add_argument(
        '--config',
        required=True,
        metavar='NAME|FILE',
        help='campaign: quick, paper, accurate, ... (files of config/campaigns/), or a .yaml file',
    )
    parser.add_argument(
        '--out',
        required=True,
        type=Path,
        metavar='DIR',
        help='results folder: new, or with results of the same campaign, which is then completed',
    )
    _add_overrides(parser)
    add_workers(parser)
    add_unchecked(parser)
    parser.add_argument('--resume', action='store_true', help='fail if DIR has no results yet')
    return parser.parse_args(arguments)


def _add_overrides(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group('overrides of the campaign file (--ppr or --encoders: of both)')
    group.add_argument('--tests', nargs='+', metavar='TEST', help='tests: SL, SMT, DLD, or .yaml files')
    ideal = 'ideal encoders, in pulses per wheel revolution'
    group.add_argument('--ppr', nargs='+', type=number_within(PULSES_PER_TURN), metavar='N', help=ideal)
    add_encoders(group)
    group.add_argument(
        '--trials', type=whole_number_within(TRIALS), metavar='N', help='trials of each test with each encoder'
    )
    group.add_argument('--nav', choices=('embedded', 'scripted'), help='navigated, or a drive without feedback')
    add_robot_arguments(group)
    add_amcl(group)
    group.add_argument(
        '--record',
        choices=('full', 'minimal', 'none'),
        help='topics in the bags: all; without scans and other bulk; or no bags',
    )
    group.add_argument(
        '--bag-format', choices=BAG_FORMATS, help='bags of ROS 1, or MCAP files of ROS 2 (default: ros1)'
    )


@faults_of_trials('campaign')
def main(arguments: Optional[Sequence[str]] = None, run: Optional[RunTrials] = None) -> None:
    """Run the command line; `run` replaces the lockstep trials on a worker."""
    from diff_encoder_sim.api.campaigns import CampaignOptions, complete

    table, summary, unrun = complete(CampaignOptions.of(vars(parse(arguments))), sys.argv, run)
    print(f'{table}\n{summary}')
    if unrun:
        sys.exit(unrun)
