"""gazebo_trial: starts Gazebo's server with the trial's world, or spawns the robot in it, as this process."""

from __future__ import annotations

from typing import List

from diff_encoder_sim.base.command_line import run_tool
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.ros.graph import become
from diff_encoder_sim.ros.model_states import launched_model
from diff_encoder_sim.ros.node import required_trial_plan
from diff_encoder_sim.ros.own_words import own_words
from diff_encoder_sim.trials.required_packages import GAZEBO


def main() -> None:
    """Run the command line: `gazebo_trial server` or `gazebo_trial spawn [MODEL]`."""
    run_tool('gazebo_trial', lambda: _become_gazebo(own_words()))


def _become_gazebo(words: List[str]) -> None:
    plan = required_trial_plan()
    if words == ['server']:
        # -u: paused, until the trial finds every node connected.
        become('gazebo_ros', 'gzserver', ['-u', '-e', 'ode', plan.world], GAZEBO.install_hint)
    elif len(words) in (1, 2) and words[0] == 'spawn':
        model = words[1] if words[1:] else launched_model()
        start = plan.trial.test.start
        pose = ['-x', str(start.x), '-y', str(start.y), '-Y', str(start.yaw)]
        spawn = ['-urdf', '-param', 'gazebo_robot_description', '-model', model, *pose]
        become('gazebo_ros', 'spawn_model', spawn, GAZEBO.install_hint)
    else:
        raise ConfigError(f'arguments: given {" ".join(words)!r}; allowed: server, or spawn [MODEL]')
