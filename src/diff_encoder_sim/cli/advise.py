"""advise: find the wheel encoder that a robot needs, and other limits of its accuracy.

The odometry of one drive of each test is computed thousands of times at every resolution, which takes a few seconds.
Closed-loop trials with a few candidates then find the lowest resolution at which the estimated and the true pose reach
the goal. Results are kept: the same command runs the missing trials.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Optional, Sequence

from diff_encoder_sim.analysis.quantities import LEVEL, REQUIRED_FRACTION, YAW, X
from diff_encoder_sim.base.bounds import PULSES_PER_TURN, TRIALS, Between
from diff_encoder_sim.base.command_line import number_within, run_trials_tool, tool_parser, whole_number_within
from diff_encoder_sim.cli.arguments import add_amcl, add_encoders, add_robot_arguments, add_unchecked, add_workers

if TYPE_CHECKING:
    from diff_encoder_sim.trials.trial_run import RunTrials

DEFAULT_OUT = Path('results') / 'advice'


API = 'api.advice'  # imported by the command on demand


def parse(arguments: Optional[Sequence[str]] = None) -> argparse.Namespace:
    """Read the command line."""
    examples = [
        '--robot my_robot.yaml --tolerance 0.05 --yaw-tolerance 3',
        '--robot burger --share 0.95 --distance 10 --no-trials',
        '--tests SL --ppr 40 90 180 360 --out results/advice_sl --json advice.json',
        '--encoders catalogue --out results/advice_catalogue',
    ]
    parser = tool_parser('advise', __doc__, examples)
    add_robot_arguments(parser, note=' (default: alto)')
    add_amcl(parser)
    _add_requirement(parser)
    _add_candidates(parser)
    _add_outputs(parser)
    add_workers(parser)
    add_unchecked(parser)
    return parser.parse_args(arguments)


def _add_requirement(parser: argparse.ArgumentParser) -> None:
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
    parser.add_argument(
        '--share',
        type=number_within(Between(0.01, 0.999)),
        default=REQUIRED_FRACTION,
        metavar='FRACTION',
        help='minimum fraction of trials within tolerance (default: %(default)g)',
    )
    parser.add_argument(
        '--confidence',
        type=number_within(Between(0.5, 0.9999)),
        default=LEVEL,
        metavar='FRACTION',
        help='of the answers (default: %(default)g)',
    )
    parser.add_argument(
        '--distance',
        type=number_within(Between(0.1, 1000.0, 'm')),
        metavar='M',
        help='evaluate odometry over this straight distance, in place of the tests',
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
        help='campaign file with the default tests and candidates (default: %(default)s)',
    )
    parser.add_argument(
        '--trials',
        type=whole_number_within(TRIALS),
        metavar='N',
        help='closed-loop trials per test and tested candidate (default: the number that shows the fraction even if '
        'two fail, 39 for 80 %%)',
    )
    parser.add_argument(
        '--no-trials',
        dest='has_trials',
        action='store_false',
        help='answer only for odometry, without closed-loop trials',
    )


def _add_outputs(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        '--out',
        type=Path,
        default=DEFAULT_OUT,
        metavar='DIR',
        help='results folder: new, or with results of the same robot, tests and candidates (default: %(default)s)',
    )
    parser.add_argument('--json', type=Path, metavar='FILE', help='write all results as JSON (docs/file_formats.md)')


def main(arguments: Optional[Sequence[str]] = None, run: Optional[RunTrials] = None) -> None:
    """Run the command line; `run` replaces the lockstep trials on a worker."""
    options = parse(arguments)
    run_trials_tool('advise', lambda: _advise(options, run))


def _advise(options: argparse.Namespace, run: Optional[RunTrials]) -> None:
    from diff_encoder_sim.api.advice import AdviceOptions, advise

    advise(AdviceOptions(**vars(options)), run)
