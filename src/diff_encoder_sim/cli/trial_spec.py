"""trial_spec: check the arguments of trial.launch and print the plan of the trial, which becomes the parameter /trial.

trial.launch calls it before any node starts, so that a wrong argument ends the launch with one line.
"""

from __future__ import annotations

from functools import partial
from typing import Optional, Sequence

from diff_encoder_sim.api.options import TrialOptions
from diff_encoder_sim.base.command_line import user_errors
from diff_encoder_sim.cli.arguments import read_options

API = 'api.live_trials'  # imported by the command on demand
EXAMPLES = ['--test SL --ppr 90 --trial 3 --bag sl.bag']
parse = partial(read_options, TrialOptions, name='trial_spec', description=__doc__, examples=EXAMPLES)


@user_errors('trial.launch')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line; errors start with trial.launch, which the user called."""
    from diff_encoder_sim.api.live_trials import plan_as_yaml

    print(plan_as_yaml(parse(arguments)), end='')
