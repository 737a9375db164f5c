"""The checks before a campaign's first trial: a robot that fails them stops it, unless --unchecked is given."""

from __future__ import annotations

import sys

from diff_encoder_sim.base.command_line import as_called
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.simulation.self_check import checks_table
from diff_encoder_sim.trials.campaign_cells import Campaign, check_robot, unfit_tests


def with_checks(name: str, campaign: Campaign, is_unchecked: bool) -> Campaign:
    """Return the campaign with the results of its robot's self-check.

    Raises:
        ConfigError: the robot fails it, or cannot do a test, and `is_unchecked` is False.
    """
    if campaign.robot is None:
        return campaign
    for warning in campaign.robot.warnings:
        print(f'{as_called(name)}: {campaign.robot.file}: {warning}', file=sys.stderr)
    checks = check_robot(campaign.robot.source, campaign.cells[0].robot_params.simulator)
    problems = unfit_tests(campaign, package_folder() / 'worlds')
    failed = [check.name for check in checks if not check.is_ok]
    if failed:
        print(checks_table(checks), file=sys.stderr)
        problems.insert(0, f'{campaign.robot.file}: the robot fails its self-check: {", ".join(failed)}')
    if problems and not is_unchecked:
        raise ConfigError('; '.join([*problems, 'allowed: another robot or test, or --unchecked']))
    for problem in problems:
        print(f'{as_called(name)}: {problem}', file=sys.stderr)
    return campaign._replace(robot=campaign.robot._replace(checks=tuple(checks)))
