"""The checks of the robot before a live trial."""

from __future__ import annotations

import argparse
import sys
from typing import Iterator

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.launched_robot import LaunchedRobot
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.simulation.self_check import checks_table
from diff_encoder_sim.trials.campaign_cells import check_robot
from diff_encoder_sim.trials.route_check import misfit


def check_robot_of_trial(options: argparse.Namespace, trial: Trial, robot: LaunchedRobot, map_path: str) -> None:
    """Check that the robot drives as it should and can do the test, unless --unchecked=true is given.

    Raises:
        ConfigError: it does not.
    """
    if options.unchecked == 'true':
        return
    problems = [*_failed_checks(options, robot)]
    # A drive without feedback goes through worlds whose map may not be made yet; a collision ends it at once.
    if options.nav != 'scripted':
        problem = misfit(trial.test, robot.params.navigator, robot.params.simulator.drive, load_map(map_path))
        problems += [problem] if problem else []
    if problems:
        raise ConfigError('; '.join([*problems, 'allowed: another robot or test, or unchecked:=true']))


def _failed_checks(options: argparse.Namespace, robot: LaunchedRobot) -> Iterator[str]:
    """Drive the robot in PyBullet, unless Gazebo is to do so, and print the table where a check fails."""
    if options.sim == 'gazebo':
        return
    robot.setup.check_laser()
    checks = check_robot(robot.setup.file.source, robot.params.simulator)
    failed = [check.name for check in checks if not check.is_ok]
    if failed:
        print(checks_table(checks), file=sys.stderr)
        yield f'{robot.setup.file.where}: the robot fails its self-check: {", ".join(failed)}'
