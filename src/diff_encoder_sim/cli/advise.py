"""advise: find the wheel encoder that a robot needs, and other limits of its accuracy.

The odometry of one drive of each test is computed thousands of times at every resolution, which takes a few seconds.
Closed-loop trials with a few candidates then find the lowest resolution at which the estimated and the true pose reach
the goal. Results are kept: the same command runs the missing trials.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Optional, Sequence

from diff_encoder_sim.api.options import AdviceOptions
from diff_encoder_sim.base.command_line import faults_of_trials
from diff_encoder_sim.cli.arguments import read_options

if TYPE_CHECKING:
    from diff_encoder_sim.trials.trial_run import RunTrials

API = 'api.advice'  # imported by the command on demand
EXAMPLES = [
    '--wheel-diameter 0.2 --wheel-separation 0.45 --distance 10',
    '--robot my_robot.yaml --tolerance 0.05 --yaw-tolerance 3',
    '--robot burger --share 0.95 --distance 10 --wheels calibrated --no-trials',
    '--tests SL --ppr 40 90 180 360 --out results/advice_sl --json advice.json',
    '--encoders catalogue --out results/advice_catalogue',
]
parse = partial(read_options, AdviceOptions, name='advise', description=__doc__, examples=EXAMPLES)


@faults_of_trials('advise')
def main(arguments: Optional[Sequence[str]] = None, run: Optional[RunTrials] = None) -> None:
    """Run the command line; `run` replaces the lockstep trials on a worker."""
    from diff_encoder_sim.api.advice import advise

    advise(parse(arguments), run)
