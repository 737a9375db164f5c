"""Plan of a live trial, from the arguments of trial.launch."""

from __future__ import annotations

import math
import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Iterator, Optional, Union

import yaml
from pydantic import Field

from diff_encoder_sim.api.notes import name_encoders, name_rates, name_stopping_of_trial
from diff_encoder_sim.api.robots import OWN_PPR, SIMULATED, LaunchedRobot, LaunchOptions, launched_robot
from diff_encoder_sim.base.atomic_files import LONGEST_NEW_NAME
from diff_encoder_sim.base.bounds import Seed
from diff_encoder_sim.base.command_line import as_typed
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder, users_path
from diff_encoder_sim.base.params import Params, for_xml_rpc
from diff_encoder_sim.base.processes import parent_only_lists
from diff_encoder_sim.base.yaml_files import yaml_value
from diff_encoder_sim.drives.test_definition import TestDefinition, find_world, load_test
from diff_encoder_sim.drives.trial_definition import LivePlan, Trial, wheels_of
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.localization.occupancy_grid import OCCUPIED, UNKNOWN
from diff_encoder_sim.simulation.self_check import checks_table
from diff_encoder_sim.simulation.state import JOINTS_RATE_HZ, STATES_PERIOD_S, STATES_RATE_HZ
from diff_encoder_sim.trials.campaign_cells import check_robot
from diff_encoder_sim.trials.campaign_loading import at_pace_of
from diff_encoder_sim.trials.required_packages import GAZEBO, UPSTREAM_NAVIGATION, UPSTREAM_SLAM, require
from diff_encoder_sim.trials.robot_params import RobotParams
from diff_encoder_sim.trials.route_driver import misfit
from diff_encoder_sim.wheels.encoder_params import DEFAULT_PPR, PulsesPerRevolution, file_label
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams


def check_robot_of_trial(options: TrialOptions, trial: Trial, robot: LaunchedRobot, map_path: str) -> None:
    """Check the robot and its fit to the test, unless --unchecked=true is given.

    Raises:
        ConfigError: a check fails.
    """
    if options.unchecked == 'true':
        return
    problems = [*_failed_checks(options, robot)]
    # Scripted drives need no map; a collision ends them at once.
    if options.nav != 'scripted':
        problem = misfit(trial.test, robot.params.navigator, robot.params.simulator.drive, load_map(map_path))
        problems += [problem] if problem else []
    if problems:
        raise ConfigError('; '.join([*problems, 'allowed: another robot or test, or unchecked:=true']))


def _failed_checks(options: TrialOptions, robot: LaunchedRobot) -> Iterator[str]:
    """Run the self-check in PyBullet, unless the trial uses Gazebo, and print the table if a check fails."""
    if options.sim == 'gazebo':
        return
    robot.setup.check_laser()
    checks = check_robot(robot.setup.file.source, robot.params.simulator)
    failed = [check.name for check in checks if not check.is_ok]
    if failed:
        print(checks_table(checks), file=sys.stderr)
        yield f'{robot.setup.file.where}: the robot fails its self-check: {", ".join(failed)}'


NO_BAG = 'none'
SIMULATORS = (SIMULATED, 'gazebo')


class TrialArguments(Params):
    """Launch arguments, validated by the names that the user gives."""

    trial: Seed = Field()
    ppr: PulsesPerRevolution = DEFAULT_PPR


@dataclass(frozen=True)
class TrialOptions(LaunchOptions):
    """Arguments of trial.launch as text; `plan` validates them."""

    test: str = ''
    ppr: str = ''
    trial: str = '0'
    odom: str = 'encoder'
    nav: str = 'embedded'
    slam: str = 'none'
    save_map: str = ''
    map: str = ''
    bag: str = ''
    unchecked: str = 'false'


def plan_as_yaml(options: TrialOptions) -> str:
    """Return the plan of a live trial as one line of YAML for the parameter /trial.

    Raises:
        ConfigError: as in `plan`.
    """
    # Not JSON, because YAML reads 1e-06 as a string.
    content = for_xml_rpc(plan(options).model_dump(mode='json', exclude_none=True))
    return yaml.safe_dump(content, default_flow_style=True, width=math.inf, sort_keys=False)


def plan(options: TrialOptions) -> LivePlan:
    """Return the plan for the options.

    Raises:
        ConfigError: an option or its file is invalid.
    """
    if options.sim not in SIMULATORS:
        raise ConfigError(f'sim: given {options.sim!r}; allowed: {", ".join(SIMULATORS)}')
    folder = package_folder()
    test = load_test(options.test, folder / 'config')
    ppr = {'ppr': yaml_value(options.ppr, 'ppr')} if options.ppr else {}
    number = TrialArguments.from_mapping({'trial': yaml_value(options.trial, 'trial'), **ppr}, '').trial
    robot = launched_robot(options, {OWN_PPR: ppr['ppr']} if ppr else {})
    trial = _trial(options, test, number, robot)
    trial.test.check_drivable(options.nav)
    if options.slam != 'none' and options.nav != 'scripted':
        raise ConfigError(f'slam: given {options.slam} with nav {options.nav}; allowed: nav:=scripted, or slam:=none')
    _check_packages(options)
    world = find_world(trial.test.world, folder / 'worlds')
    map_path = _map_path(options, world)
    if options.nav != 'scripted':
        _check_start(trial.test, map_path)
    if not parent_only_lists():
        check_robot_of_trial(options, trial, robot, map_path)
        name_encoders('trial.launch', [robot.encoder], trial.wheel_diameter)
        name_rates('trial.launch', [robot.params.encoder.rate] if _samples_ticks(options) else [])
        name_stopping_of_trial(options.nav, robot.params)
    files = {
        'world': str(world),
        'map': map_path,
        'bag': _bag_path(options.bag, trial),
        'save_map': str(_new_file('save_map', options.save_map)) if options.save_map else '',
    }
    report_rate_hz = _report_rate_hz(options, robot.params.encoder)
    rates = {
        'report_rate': report_rate_hz,
        'report_delay': _report_delay_s(options, robot.params.encoder, report_rate_hz),
        'command_period': _command_period_s(options, robot.params),
    }
    return LivePlan.from_mapping({'trial': trial, 'slam': options.slam, **files, **rates}, '')


def _trial(options: TrialOptions, test: TestDefinition, number: int, launched: LaunchedRobot) -> Trial:
    robot = launched.params
    return Trial.from_mapping(
        {
            'test': at_pace_of(robot.simulator.drive, test),
            'ppr': launched.encoder.ppr,
            'number': number,
            'odom': options.odom,
            'nav': options.nav,
            'encoder': launched.encoder.name,
            'resolution': launched.encoder.resolution,
            **wheels_of(robot.odometry, robot.encoder),
        },
        '',
    )


def _samples_ticks(options: TrialOptions) -> bool:
    """Return whether encoders sample the joint states of this package's simulator; Gazebo's rate is in the URDF."""
    return (options.odom, options.sim) == ('encoder', 'pybullet')


def _report_rate_hz(options: TrialOptions, encoder: EncoderParams) -> float:
    if options.odom != 'encoder':
        return STATES_RATE_HZ
    return min(encoder.rate, JOINTS_RATE_HZ) if _samples_ticks(options) else encoder.rate


def _report_delay_s(options: TrialOptions, encoder: EncoderParams, rate_hz: float) -> float:
    return encoder.report.longest_delay_s(1.0 / rate_hz) if options.odom == 'encoder' else 0.0


def _command_period_s(options: TrialOptions, robot: RobotParams) -> float:
    """Return the period of the commands that the simulator waits for; 0 if commands may be missing.

    The upstream move_base has no fixed period, and a lost report gets no command.
    """
    if options.nav == 'embedded' and robot.encoder.report.are_even:
        return robot.navigator.control_period_s
    return STATES_PERIOD_S if options.nav == 'scripted' else 0.0


def _check_packages(options: TrialOptions) -> None:
    if parent_only_lists():
        return  # roslaunch --nodes needs no installed packages
    if options.nav == 'upstream':
        require(UPSTREAM_NAVIGATION)
    if options.slam == 'upstream':
        require(UPSTREAM_SLAM)
    if options.sim == 'gazebo':
        require(GAZEBO)


def _map_path(options: TrialOptions, world: Path) -> str:
    path = users_path(options.map) if options.map else world.with_suffix('.yaml')
    if options.nav != 'scripted' and not path.is_file():
        raise ConfigError(
            f'map: {path} not found; allowed: a map .yaml file, as made by {as_typed("rasterise_world")} {world}'
        )
    return str(path)


def _check_start(test: TestDefinition, map_path: str) -> None:
    """Refuse a start at which AMCL cannot localize, which would last until the test's time limit."""
    grid, start = load_map(map_path), test.start
    cell = grid.cell_at(start.x, start.y)
    where: Optional[str] = 'outside'
    if grid.contains(*cell):
        where = {OCCUPIED: 'in a wall of', UNKNOWN: 'in unknown space of'}.get(int(grid.cells[cell]))
    if where is not None:
        raise ConfigError(
            f'test {test.name}: start: given ({start.x:.2f}, {start.y:.2f}), {where} '
            f'the map {map_path}; allowed: a start in free space'
        )


def _bag_path(given: str, trial: Trial) -> str:
    if given == NO_BAG:
        return ''
    path = users_path(given or Path('bags') / _bag_name(trial))
    if path.exists():
        raise ConfigError(f'bag: {path} exists; allowed: the path of a new file, or {NO_BAG}')
    return str(_new_file('bag', path))


def _new_file(argument: str, given: Union[str, Path]) -> Path:
    path = users_path(given)
    if len(os.fsencode(path.name)) > LONGEST_NEW_NAME:
        raise ConfigError(f'{argument}: given {path.name}; allowed: a name of at most {LONGEST_NEW_NAME} bytes')
    folder = next(parent for parent in path.parents if parent.exists())
    if not (folder.is_dir() and os.access(folder, os.W_OK)):
        raise ConfigError(f'{argument}: cannot write in {folder}; allowed: a path in a folder with write permission')
    return path


def _bag_name(trial: Trial) -> str:
    moment = time.strftime('%Y%m%dT%H%M%SZ', time.gmtime())
    return f'{trial.test.name}_{file_label(trial.ppr, trial.encoder)}_trial{trial.number}_{moment}.bag'
