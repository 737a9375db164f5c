"""trial_spec: checks the arguments of trial.launch and prints them as the parameter /trial."""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path
from typing import Any, Optional, Sequence, Union

import yaml

from diff_encoder_sim.base.console import run_tool, users_path
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.paths import package_folder
from diff_encoder_sim.base.typed_params import load_yaml, split_params
from diff_encoder_sim.encoders.pulses import ppr_label
from diff_encoder_sim.encoders.wheel_encoder import EncoderParams
from diff_encoder_sim.mapping.map_files import load_map
from diff_encoder_sim.mapping.occupancy_grid import OCCUPIED, UNKNOWN
from diff_encoder_sim.odometry.wheel_odometry import OdometryParams
from diff_encoder_sim.trials.required_packages import (
    GAZEBO,
    UPSTREAM_NAVIGATION,
    UPSTREAM_SLAM,
    require,
    roslaunch_only_lists,
)
from diff_encoder_sim.trials.trial_definition import TestDefinition, Trial, TrialPlan, find_world, load_test

NO_BAG = 'none'
SIMULATORS = ('pybullet', 'gazebo')


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Entry point of the executable."""
    run_tool('trial.launch', lambda: print(plan(_parse(arguments)).model_dump_json(exclude_none=True)))


def plan(options: argparse.Namespace) -> TrialPlan:
    """The plan for the options.

    Raises:
        ConfigError: an option, or a file that it names, is bad.
    """
    if options.sim not in SIMULATORS:
        raise ConfigError(f'sim: given {options.sim!r}; allowed: {", ".join(SIMULATORS)}')
    _, odometry = split_params(load_yaml(options.config), options.config, EncoderParams, OdometryParams)
    folder = package_folder()
    test = load_test(options.test, folder / 'config')
    trial = Trial.from_mapping(
        {
            'test': test,
            'ppr': _value(options.ppr) if options.ppr else odometry.ppr,
            'number': _value(options.trial),
            'odom': options.odom,
            'nav': options.nav,
            # A bag explains itself: what the odometry believed of the robot goes into it.
            'wheel_diameter': odometry.wheel_diameter,
            'wheel_separation': odometry.wheel_separation,
        },
        '',
    )
    test.check_way(options.nav)
    if options.slam != 'none' and options.nav != 'scripted':
        raise ConfigError(f'slam: given {options.slam} with nav {options.nav}; allowed: nav:=scripted, or slam:=none')
    _check_packages(options)
    world = find_world(test.world, folder / 'worlds')
    map_path = _map_path(options, world)
    if options.nav != 'scripted':
        _check_start(test, map_path)
    return TrialPlan.from_mapping(
        {
            'trial': trial,
            'world': str(world),
            'map': map_path,
            'bag': _bag_path(options.bag, trial),
            'slam': options.slam,
            'save_map': str(_new_file('save_map', options.save_map)) if options.save_map else '',
        },
        '',
    )


def _check_packages(options: argparse.Namespace) -> None:
    if roslaunch_only_lists():
        return  # what is in a launch file can be seen anywhere
    if options.nav == 'upstream':
        require(UPSTREAM_NAVIGATION)
    if options.slam == 'upstream':
        require(UPSTREAM_SLAM)
    if options.sim == 'gazebo':
        require(GAZEBO)


def _map_path(options: argparse.Namespace, world: Path) -> str:
    path = users_path(options.map) if options.map else world.with_suffix('.yaml')
    if options.nav != 'scripted' and not path.is_file():
        raise ConfigError(
            f'map: there is no {path}; allowed: a map .yaml file, as made by '
            f'rosrun diff_encoder_sim rasterise_world {world}'
        )
    return str(path)


def _check_start(test: TestDefinition, map_path: str) -> None:
    """A robot that AMCL cannot see would stand until the test's time limit."""
    grid, start = load_map(map_path), test.start
    cell = grid.cell_at(start.x, start.y)
    where = (
        'outside'
        if not grid.contains(*cell)
        else {OCCUPIED: 'in a wall of', UNKNOWN: 'in what is unknown to'}.get(int(grid.cells[cell]))
    )
    if where is not None:
        raise ConfigError(
            f'test {test.name}: start: given ({start.x:.2f}, {start.y:.2f}), {where} '
            f'the map {map_path}; allowed: where the robot has room'
        )


def _value(text: str) -> Any:
    """A launch argument as roslaunch itself would read it."""
    try:
        return yaml.safe_load(text)
    except yaml.YAMLError:
        return text


def _bag_path(given: str, trial: Trial) -> str:
    if given == NO_BAG:
        return ''
    path = users_path(given or Path('bags') / _bag_name(trial))
    if path.exists():
        raise ConfigError(f'bag: {path} exists; allowed: the path of a new file, or {NO_BAG}')
    return str(_new_file('bag', path))


def _new_file(argument: str, given: Union[str, Path]) -> Path:
    path = users_path(given)
    folder = next(parent for parent in path.parents if parent.exists())
    if not (folder.is_dir() and os.access(folder, os.W_OK)):
        raise ConfigError(f'{argument}: {folder} cannot be written to; allowed: a path in a folder that can')
    return path


def _bag_name(trial: Trial) -> str:
    moment = time.strftime('%Y%m%dT%H%M%SZ', time.gmtime())
    return f'{trial.test.name}_{ppr_label(trial.ppr)}ppr_trial{trial.number}_{moment}.bag'


def _parse(arguments: Optional[Sequence[str]]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='trial_spec', description=__doc__, epilog='example: trial_spec --test SL --ppr 90 --trial 3 --bag sl.bag'
    )
    parser.add_argument('--test', required=True, help='SL, SMT, DLD, or a .yaml file')
    parser.add_argument('--ppr', default='', help="pulses per revolution (default: the config's)")
    parser.add_argument('--trial', default='0', help='number of the trial: its seed')
    parser.add_argument('--odom', default='encoder', help='encoder or ideal')
    parser.add_argument('--nav', default='embedded', help='embedded, upstream or scripted')
    parser.add_argument('--slam', default='none', help='none, embedded or upstream')
    parser.add_argument('--save-map', default='', help='path without suffix for the map made')
    parser.add_argument('--sim', default='pybullet', help='pybullet or gazebo')
    parser.add_argument('--map', default='', help='its YAML file (default: that of the world)')
    parser.add_argument('--bag', default='', help='path of the bag (default: bags/..., none)')
    parser.add_argument('--config', default=str(package_folder() / 'config' / 'config.yaml'))
    return parser.parse_args(arguments)
