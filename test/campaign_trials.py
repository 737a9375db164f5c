"""The campaign command with trials that take no time, or as long as the environment says.

Not a test: test_campaign.py runs it, and workers import it.
"""

import os
import signal
import time
from pathlib import Path

from diff_encoder_sim.base.command_start import run_command

TRIAL_S = 'CAMPAIGN_TRIALS_LAST_S'
FOLDER = 'CAMPAIGN_TRIALS_FOLDER'  # of a log of attempts, and of what is to go wrong
LOG = 'attempts'
GROUPS = 'groups'  # a log of what was begun at once: seeds with PPR


def trials(setups, robot_file):
    """Results and bags that depend on the plans alone."""
    with open(Path(os.environ[FOLDER]) / GROUPS, 'a') as log:
        log.write(' '.join(f'{plan.trial.number}_{plan.trial.ppr.left:g}' for plan, *_ in setups) + '\n')
    return [trial(plan, robot_file) for plan, *_ in setups]


def trial(plan, robot_file):
    """One of them."""
    # Here, so that this script is no slower than scripts/campaign to notice Ctrl-C.
    from diff_encoder_sim.base.se2 import Pose2D
    from diff_encoder_sim.drives.topics import PoseSource
    from diff_encoder_sim.drives.trial_definition import Outcome
    from diff_encoder_sim.trials.trials_csv import TrialRow

    number = plan.trial.number
    folder = Path(os.environ[FOLDER])
    with open(folder / LOG, 'a') as log:
        log.write(f'{os.getpid()} {number}\n')
    names = f'{number}', f'{number}_{plan.trial.ppr.left:g}'
    if any((folder / f'kills_{name}').exists() for name in names):
        os.kill(os.getpid(), signal.SIGKILL)
    if any((folder / f'raises_{name}').exists() for name in names):
        raise ZeroDivisionError(f'of trial {number}')
    if (folder / f'disk_full_{number}').exists():
        raise OSError(28, 'No space left on device', plan.bag)
    time.sleep(float(os.environ.get(TRIAL_S, '0')))
    if plan.bag:
        Path(plan.bag).write_bytes(str(number).encode() * 1000)
    assert Path(plan.world).is_file() and Path(plan.map).is_file() and Path(robot_file).is_file()
    outcome = Outcome.TIMED_OUT if number % 5 == 0 else Outcome.SUCCEEDED
    error = Pose2D(number / 3.0, plan.trial.ppr.left, 0.0)
    errors = {PoseSource.ODOM: error, PoseSource.AMCL: None, PoseSource.GLOBAL: error, PoseSource.WORLD: error}
    return TrialRow('', '', (), number, number, outcome, '', 50.0 + number / 7.0, errors, 20.0)


if __name__ == '__main__':
    # Workers know it by its module's name, not as part of the script that was started.
    from campaign_trials import trials as importable_trials

    run_command('campaign', 'cli.campaign', None, importable_trials)
