"""Notes before trials run: encoders, rates, stopping, and self-check of the robot."""

from __future__ import annotations

import math
import sys
from typing import Iterable, List, Tuple

from diff_encoder_sim.base.command_line import as_called
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.robots.robot_file import RobotFile
from diff_encoder_sim.simulation.self_check import Check, checks_table
from diff_encoder_sim.simulation.simulator import SimulatorParams
from diff_encoder_sim.simulation.state import JOINTS_RATE_HZ
from diff_encoder_sim.trials.campaign_cells import Campaign, check_robot, unfit_tests
from diff_encoder_sim.trials.robot_params import RobotParams, as_upstream, spread_with, stopping_line
from diff_encoder_sim.wheels.catalogue import encoder_lines


def print_notes(command: str, lines: Iterable[str]) -> None:
    """Print notes of a command, each once."""
    for line in dict.fromkeys(lines):
        print(f'{command}: {line}', file=sys.stderr)


def name_campaigns_encoders(command: str, campaign: Campaign) -> None:
    """Print notes on the encoders and rates of a campaign."""
    print_notes(command, encoder_lines(campaign.encoders, campaign.cells[0].robot_params.odometry.wheel_diameter))
    name_rates(command, (cell.robot_params.encoder.rate for cell in campaign.cells))


def name_rates(command: str, rates_hz: Iterable[float]) -> None:
    """Print a line for each report rate above the rate of the simulator's joint states."""
    limit = f'but reports are limited to the {JOINTS_RATE_HZ:g} Hz of joint states'
    print_notes(command, (f'rate: {rate_hz:g} Hz, {limit}' for rate_hz in rates_hz if rate_hz > JOINTS_RATE_HZ))


def name_stopping(name: str, campaign: Campaign, tolerance_m: float, tolerance_deg: float) -> None:
    """Print how a campaign's robot stops, and a warning if that exceeds the tolerance in x and y, or of the heading."""
    if campaign.params.nav != 'embedded':
        return
    pprs = [encoder.ppr for encoder in campaign.encoders]
    lines = [stopping_line(cell.robot_params, pprs) for cell in campaign.cells]
    finest = max(pprs, key=lambda ppr: min(ppr.left, ppr.right))
    spreads = [spread_with(cell.robot_params, finest) for cell in campaign.cells]
    most_m = max(spread.position_m for spread in spreads)
    most_deg = math.degrees(max(spread.yaw_rad for spread in spreads))
    if most_m > tolerance_m or most_deg > tolerance_deg:
        lines.append(
            f'stopping may end {1e3 * most_m:.0f} mm and {most_deg:.1f} degrees from a goal with every '
            f'encoder; results are evaluated with {1e3 * tolerance_m:g} mm and {tolerance_deg:g} degrees; set '
            'navigation.DWAPlannerROS.stop: precise, or smaller tolerances, in the robot file'
        )
    print_notes(as_called(name), lines)


def name_stopping_of_trial(nav: str, params: RobotParams) -> None:
    """Print the stopping behaviour of a navigated live trial."""
    if nav != 'scripted':
        used = as_upstream(params) if nav == 'upstream' else params
        print_notes('trial.launch', [stopping_line(used, [params.encoder.counts_per_turn])])


def self_checked(file: RobotFile, params: SimulatorParams) -> Tuple[List[Check], List[str]]:
    """Return the self-check of a robot, and a problem if it fails; its results are then printed."""
    checks = check_robot(file.source, params)
    failed = [check.name for check in checks if not check.is_ok]
    if failed:
        print(checks_table(checks), file=sys.stderr)
    return checks, [f'{file.where}: the robot fails its self-check: {", ".join(failed)}'] if failed else []


def with_checks(name: str, campaign: Campaign, is_unchecked: bool) -> Campaign:
    """Return the campaign with its robot's self-check; ConfigError if it fails or a test does not fit, if checked."""
    file = campaign.robot.file
    print_notes(as_called(name), (f'{file.where}: {warning}' for warning in campaign.robot.description.warnings))
    checks, problems = self_checked(file, campaign.cells[0].robot_params.simulator)
    problems += unfit_tests(campaign, package_folder() / 'worlds')
    if problems and not is_unchecked:
        raise ConfigError('; '.join([*problems, 'allowed: another robot or test, or --unchecked']))
    print_notes(as_called(name), problems)
    return campaign._replace(checks=checks)
