"""gazebo_trial: becomes Gazebo's server with the trial's world, or puts the robot into it."""

from __future__ import annotations

import sys

from diff_encoder_sim.base.command_line import run_tool
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.ros.processes import become
from diff_encoder_sim.ros.trial_plan import required_trial_plan
from diff_encoder_sim.trials.required_packages import GAZEBO


def main() -> None:
    """Entry point of the executable: `gazebo_trial server` or `gazebo_trial spawn MODEL`."""
    words = [argument for argument in sys.argv[1:] if ':=' not in argument]
    run_tool('gazebo_trial', lambda: _become_gazebo(words))


def _become_gazebo(words: list) -> None:
    plan = required_trial_plan()
    if words == ['server']:
        # -u: paused, until the trial finds every node connected.
        become('gazebo_ros', 'gzserver', ['-u', '-e', 'ode', plan.world], GAZEBO.install_hint)
    elif len(words) == 2 and words[0] == 'spawn':
        start = plan.trial.test.start
        become(
            'gazebo_ros',
            'spawn_model',
            [
                '-urdf',
                '-param',
                'gazebo_robot_description',
                '-model',
                words[1],
                '-x',
                str(start.x),
                '-y',
                str(start.y),
                '-Y',
                str(start.yaw),
            ],
            GAZEBO.install_hint,
        )
    else:
        raise ConfigError(f'arguments: given {" ".join(words)!r}; allowed: server, or spawn MODEL')
