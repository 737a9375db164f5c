"""advise: find the wheel encoder that a robot needs, and other limits of its accuracy.

The odometry of one drive of each test is computed thousands of times at every resolution, which takes a few seconds.
Closed-loop trials with a few candidates then find the lowest resolution at which the estimated and the true pose reach
the goal. Results are kept: the same command runs the missing trials.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any, Optional, Sequence

from diff_encoder_sim.analysis.quantities import LEVEL, REQUIRED_FRACTION, YAW, X
from diff_encoder_sim.base.bounds import PULSES_PER_TURN, TRIALS, Between
from diff_encoder_sim.base.command_line import faults_of_trials, number_within, tool_parser, whole_number_within
from diff_encoder_sim.cli.arguments import add_amcl, add_encoders, add_robot_arguments, add_unchecked, add_workers

if TYPE_CHECKING:
    from diff_encoder_sim.trials.trial_run import RunTrials

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

    def number(option: str, bounds: Between, metavar: str, text: str, **more: Any) -> None:
        shown = f'{text} (default: %(default)g)' if 'default' in more else text
        parser.add_argument(option, type=number_within(bounds), metavar=metavar, help=shown, **more)

    add_robot_arguments(parser, note=' (default: alto)')
    add_amcl(parser)
    position = 'allowed error in x and in y at the goal, in metres'
    number('--tolerance', Between(1e-6, 1000.0, 'm'), 'M', position, default=X.tolerance)
    heading = 'allowed error of the heading at the goal, in degrees'
    number('--yaw-tolerance', Between(1e-6, 360.0, 'degrees'), 'DEG', heading, default=YAW.tolerance)
    fraction = 'minimum fraction of trials within tolerance'
    number('--share', Between(0.01, 0.999), 'FRACTION', fraction, default=REQUIRED_FRACTION)
    number('--confidence', Between(0.5, 0.9999), 'FRACTION', 'of the answers', default=LEVEL)
    straight = 'evaluate odometry over this straight distance, in place of the tests'
    number('--distance', Between(0.1, 1000.0, 'm'), 'M', straight)
    parser.add_argument('--tests', nargs='+', metavar='TEST', help='tests: SL, SMT, DLD, or .yaml files')
    number('--ppr', PULSES_PER_TURN, 'N', 'candidates, ideal encoders in pulses per wheel revolution', nargs='+')
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
    only_odometry = 'answer only for odometry, without closed-loop trials'
    parser.add_argument('--no-trials', dest='has_trials', action='store_false', help=only_odometry)
    parser.add_argument(
        '--out',
        type=Path,
        default=Path('results') / 'advice',
        metavar='DIR',
        help='results folder: new, or with results of the same robot, tests and candidates (default: %(default)s)',
    )
    parser.add_argument('--json', type=Path, metavar='FILE', help='write all results as JSON (docs/file_formats.md)')
    add_workers(parser)
    add_unchecked(parser)
    return parser.parse_args(arguments)


@faults_of_trials('advise')
def main(arguments: Optional[Sequence[str]] = None, run: Optional[RunTrials] = None) -> None:
    """Run the command line; `run` replaces the lockstep trials on a worker."""
    from diff_encoder_sim.api.advice import AdviceOptions, advise

    advise(AdviceOptions(**vars(parse(arguments))), run)
