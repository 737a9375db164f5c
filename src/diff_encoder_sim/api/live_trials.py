"""Plan of a live trial, from the arguments of trial.launch."""

from __future__ import annotations

import math
import os
import time
from pathlib import Path
from typing import List, Union

import yaml
from pydantic import Field

from diff_encoder_sim.api.notes import name_rates, name_stopping_of_trial, print_notes, self_checked
from diff_encoder_sim.api.options import TrialOptions
from diff_encoder_sim.api.robots import OWN_PPR, SIMULATED, LaunchedRobot, launched_robot
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
from diff_encoder_sim.simulation.state import JOINTS_RATE_HZ, STATES_PERIOD_S, STATES_RATE_HZ
from diff_encoder_sim.trials.campaign_loading import as_driven_by
from diff_encoder_sim.trials.required_packages import GAZEBO, UPSTREAM, require
from diff_encoder_sim.trials.route_driver import misfit
from diff_encoder_sim.wheels.catalogue import encoder_lines
from diff_encoder_sim.wheels.encoder_params import DEFAULT_PPR, PulsesPerRevolution, file_label

NO_BAG = 'none'
SIMULATORS = (SIMULATED, 'gazebo')


class TrialArguments(Params):
    """Launch arguments, validated by the names that the user gives."""

    trial: Seed = Field()
    ppr: PulsesPerRevolution = DEFAULT_PPR


def plan_as_yaml(options: TrialOptions) -> str:
    """Return the `plan` of a live trial as one line of YAML for the parameter /trial."""
    # Not JSON, because YAML reads 1e-06 as a string.
    content = for_xml_rpc(plan(options).model_dump(mode='json', exclude_none=True))
    return yaml.safe_dump(content, default_flow_style=True, width=math.inf, sort_keys=False)


def plan(options: TrialOptions) -> LivePlan:
    """Return the plan for the options; ConfigError if an option or its file is invalid."""
    if options.sim not in SIMULATORS:
        raise ConfigError(f'sim: given {options.sim!r}; allowed: {", ".join(SIMULATORS)}')
    folder, is_scripted = package_folder(), options.nav == 'scripted'
    test = load_test(options.test, folder / 'config')
    ppr = {'ppr': yaml_value(options.ppr, 'ppr')} if options.ppr else {}
    number = TrialArguments.from_mapping({'trial': yaml_value(options.trial, 'trial'), **ppr}, '').trial
    launched = launched_robot(options, {OWN_PPR: ppr['ppr']} if ppr else {})
    robot, encoder = launched.params, launched.encoder
    paced, wheels = as_driven_by(robot.simulator, test), wheels_of(robot.odometry, robot.encoder)
    of_encoder = {'ppr': encoder.ppr, 'encoder': encoder.name, 'resolution': encoder.resolution}
    chosen = {'test': paced, 'number': number, 'odom': options.odom, 'nav': options.nav, 'fusion': options.fusion}
    trial = Trial.from_mapping({**chosen, **of_encoder, **wheels}, '')
    trial.test.check_drivable(options.nav)
    if options.fusion != 'none' and options.odom != 'encoder':
        raise ConfigError(f'fusion: given {options.fusion} with odom {options.odom}; allowed: odom:=encoder')
    if options.slam != 'none' and not is_scripted:
        raise ConfigError(f'slam: given {options.slam} with nav {options.nav}; allowed: nav:=scripted, or slam:=none')
    if not parent_only_lists():  # roslaunch --nodes needs no installed packages
        chosen_stacks = [package for key, package in UPSTREAM.items() if getattr(options, key) == 'upstream']
        for package in [*chosen_stacks, *([GAZEBO] if options.sim == 'gazebo' else [])]:
            require(package)
    world = find_world(trial.test.world, folder / 'worlds')
    map_path = users_path(options.map) if options.map else world.with_suffix('.yaml')
    if not is_scripted:
        if not map_path.is_file():
            made_by = f'{as_typed("rasterise_world")} {world}'
            raise ConfigError(f'map: {map_path} not found; allowed: a map .yaml file, as made by {made_by}')
        _check_start(trial.test, str(map_path))
    # Encoders sample the joint states of this package's simulator; Gazebo's rate is in the URDF.
    has_encoder, samples_ticks = options.odom == 'encoder', (options.odom, options.sim) == ('encoder', SIMULATED)
    if not parent_only_lists():
        if options.unchecked != 'true':
            _check_robot(options, trial, launched, str(map_path))
        print_notes('trial.launch', encoder_lines([encoder], trial.wheel_diameter))
        name_rates('trial.launch', [robot.encoder.rate] if samples_ticks else [])
        name_stopping_of_trial(options.nav, robot)
    rate_hz = robot.encoder.rate if has_encoder else STATES_RATE_HZ
    rate_hz = min(rate_hz, JOINTS_RATE_HZ) if samples_ticks else rate_hz
    # The simulator waits for commands. The upstream move_base has no fixed period, and a lost report gets no command.
    command_period_s = STATES_PERIOD_S if is_scripted else 0.0
    if options.nav == 'embedded' and robot.encoder.report.are_even:
        command_period_s = robot.navigator.control_period_s
    delay_s = robot.encoder.report.longest_delay_s(1.0 / rate_hz) if has_encoder else 0.0
    files = {
        'world': str(world),
        'map': str(map_path),
        'bag': _bag_path(options.bag, trial),
        'save_map': str(_new_file('save_map', options.save_map)) if options.save_map else '',
    }
    timing = {'report_rate': rate_hz, 'report_delay': delay_s, 'command_period': command_period_s}
    return LivePlan.from_mapping({'trial': trial, 'slam': options.slam, **files, **timing}, '')


def _check_robot(options: TrialOptions, trial: Trial, robot: LaunchedRobot, map_path: str) -> None:
    """Check the robot in PyBullet, unless the trial uses Gazebo, and its fit to the test."""
    params = robot.params
    problems: List[str] = []
    if options.sim == SIMULATED:
        robot.setup.check_laser()
        _, problems = self_checked(robot.setup.file, params.simulator)
    if options.nav != 'scripted':  # scripted drives need no map; a collision ends them at once
        problems += filter(None, [misfit(trial.test, params.navigator, params.simulator.drive, load_map(map_path))])
    if problems:
        raise ConfigError('; '.join([*problems, 'allowed: another robot or test, or unchecked:=true']))


def _check_start(test: TestDefinition, map_path: str) -> None:
    """Refuse a start at which AMCL cannot localize, which would last until the test's time limit."""
    grid, start = load_map(map_path), test.start
    cell = grid.cell_at(start.x, start.y)
    found = int(grid.cells[cell]) if grid.contains(*cell) else None
    where = {None: 'outside', OCCUPIED: 'in a wall of', UNKNOWN: 'in unknown space of'}.get(found)
    if where is not None:
        given = f'({start.x:.2f}, {start.y:.2f}), {where} the map {map_path}'
        raise ConfigError(f'test {test.name}: start: given {given}; allowed: a start in free space')


def _bag_path(given: str, trial: Trial) -> str:
    if given == NO_BAG:
        return ''
    moment = time.strftime('%Y%m%dT%H%M%SZ', time.gmtime())
    name = f'{trial.test.name}_{file_label(trial.ppr, trial.encoder)}_trial{trial.number}_{moment}.bag'
    path = users_path(given or Path('bags') / name)
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
