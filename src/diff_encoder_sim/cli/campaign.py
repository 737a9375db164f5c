"""campaign: run many simulated trials, of several tests and encoders, faster than real time, into one results folder.

Trials run in lockstep in worker processes. Results are kept if the campaign is stopped or killed: the same command runs
the missing trials.
"""

from __future__ import annotations

import sys
from functools import partial
from typing import TYPE_CHECKING, Optional, Sequence

from diff_encoder_sim.api.options import CampaignOptions
from diff_encoder_sim.base.command_line import faults_of_trials
from diff_encoder_sim.cli.arguments import read_options

if TYPE_CHECKING:
    from diff_encoder_sim.trials.trial_run import RunTrials

API = 'api.campaigns'  # imported by the command on demand
EXAMPLES = [
    '--config quick --out results/quick',
    '--config paper --out results/sl --tests SL --ppr 40 90 --trials 10',
    '--config paper --amcl amcl_accurate --out results/paper_accurate',
    '--config quick --encoders amt102 pololu_25d --out results/encoders',
    '--config quick --robot burger --out results/burger',
    '--config quick --robot my_robot.yaml --out results/my_robot',
]
parse = partial(read_options, CampaignOptions, name='campaign', description=__doc__, examples=EXAMPLES)


@faults_of_trials('campaign')
def main(arguments: Optional[Sequence[str]] = None, run: Optional[RunTrials] = None) -> None:
    """Run the command line; `run` replaces the lockstep trials on a worker."""
    from diff_encoder_sim.api.campaigns import complete

    table, summary, unrun = complete(parse(arguments), sys.argv, run)
    print(f'{table}\n{summary}')
    if unrun:
        sys.exit(unrun)
