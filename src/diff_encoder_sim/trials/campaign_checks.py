"""What is checked before the trials of a campaign: that its robot drives as it should, and can do the tests."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, List

from diff_encoder_sim.drives.test_definition import find_world
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.robots.robot_source import RobotSource
from diff_encoder_sim.robots.simulated_robot import load_simulated_robot
from diff_encoder_sim.simulation.check_results import Check
from diff_encoder_sim.simulation.self_check import self_check
from diff_encoder_sim.simulation.simulator import SimulatorParams
from diff_encoder_sim.trials.campaign_definition import Campaign
from diff_encoder_sim.trials.route_check import misfit


def check_robot(source: RobotSource, params: SimulatorParams) -> List[Check]:
    """Drive a robot on a flat floor, without the wheel errors of the parameters.

    Raises:
        ConfigError: its description is bad.
    """
    return self_check(load_simulated_robot(source, params.choices()), params)


def unfit_tests(campaign: Campaign, worlds_folder: Path) -> List[str]:
    """Return why the robot cannot do tests, a line for each test; none for drives without feedback."""
    if campaign.params.nav == 'scripted':
        return []
    found: Dict[str, str] = {}
    for cell in campaign.cells:
        if cell.encoder == campaign.cells[0].encoder and cell.test.name not in found:
            params = cell.robot_params
            grid = load_map(find_world(cell.test.world, worlds_folder).with_suffix('.yaml'))
            line = misfit(cell.test, params.navigator, params.simulator.drive, grid)
            found.update({cell.test.name: line} if line else {})
    return list(found.values())
