"""check_robot: what is found out about a robot, and how it drives. Its help is in check_robot_arguments."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Iterator, Optional, Sequence

from tabulate import tabulate

from diff_encoder_sim.base.command_line import run_tool
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.cli.check_robot_arguments import parse
from diff_encoder_sim.robots.robot_file import ROBOT_FILE_SUFFIXES
from diff_encoder_sim.robots.robot_setup import RobotSetup, robot_file_text
from diff_encoder_sim.robots.xacro_expansion import xacro_arguments
from diff_encoder_sim.simulation.self_check import checks_table
from diff_encoder_sim.trials.campaign_cells import check_robot
from diff_encoder_sim.trials.robot_loading import load_robot
from diff_encoder_sim.trials.robot_params import load_robot_config, override

# Of the columns value and source, so that a table fits a usual terminal.
WIDTHS = (52, 44)


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    run_tool('check_robot', lambda: _check(parse(arguments)))


def _check(options: argparse.Namespace) -> None:
    if options.write:
        _check_path(options.write)
    setup = load_robot(options.robot, Path(), package_folder(), xacro_arguments(options.robot_args), options.packages)
    print('\n'.join(_found(setup)), flush=True)
    if options.write:
        _write(setup, options.write)
    params = override(load_robot_config(package_folder() / 'config'), setup.settings).simulator
    if setup.description.laser is None:
        params = params.model_copy(update={'laser_link': ''})  # the default is a link that the robot does not have
    checks = check_robot(setup.file.source, params)
    failed = [check.name for check in checks if not check.is_ok]
    print(f'\n{checks_table(checks)}\n', flush=True)
    if failed:
        raise ConfigError(f'{setup.file.where}: the robot fails its self-check: {", ".join(failed)}')
    print(f'{setup.name}: all checks are ok.')


def _check_path(path: Path) -> None:
    """Check the path of the robot file that is to be written, before anything is found out.

    Raises:
        ConfigError: there is a file already, or its name is not that of a robot file.
    """
    if path.exists():
        raise ConfigError(f'--write: {path} exists; allowed: the path of a new file')
    if path.suffix not in ROBOT_FILE_SUFFIXES:
        raise ConfigError(f'--write: given {path}; allowed: a name that ends in {" or ".join(ROBOT_FILE_SUFFIXES)}')


def _write(setup: RobotSetup, path: Path) -> None:
    """Write the robot file.

    Raises:
        ConfigError: its folder cannot be written to.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(robot_file_text(setup, path), encoding='utf-8')
    except OSError as error:
        raise ConfigError(f'--write: {path} cannot be written: {error.strerror}') from None
    print(f'\nWritten: {path}', flush=True)


def _found(setup: RobotSetup) -> Iterator[str]:
    description = setup.description
    yield tabulate(description.found, ['found', 'value', 'source'], disable_numparse=True, maxcolwidths=[None, *WIDTHS])
    own = [(key, value) for key, value in setup.file.overrides.items()]
    if own:
        yield f'\n{tabulate(own, [f"set in {setup.file.where}", "value"], disable_numparse=True)}'
    for title, lines in (('Warnings', description.warnings), ('Notes', description.notes)):
        if lines:
            yield '\n'.join([f'\n{title}:', *(f'- {line}' for line in lines)])
