"""Loads a robot and checks what its file sets, where errors can name that file."""

from __future__ import annotations

from pathlib import Path
from typing import Mapping, Sequence

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.robot_file import RobotFile, load_robot_file
from diff_encoder_sim.robots.robot_setup import RobotSetup, set_up_robot
from diff_encoder_sim.trials.robot_params import check_key, load_robot_config, override

DEFAULT_ROBOT = 'alto'


def load_robot(
    given: str, folder: Path, package_folder: Path, arguments: Mapping[str, str], packages: Sequence[Path] = ()
) -> RobotSetup:
    """Load a robot by its name, its robot file, or its xacro or URDF alone, and find out about it.

    Args:
        given: what the user calls it; '' is the package's default robot.
        folder: what a path is relative to.
        package_folder: where config/ is.
        arguments: of the robot's xacro.
        packages: folders in which packages are looked for.

    Raises:
        ConfigError: the robot's files are missing or bad, or set what is not allowed.
    """
    file = load_robot_file(given or DEFAULT_ROBOT, folder, package_folder, arguments, packages)
    _check_keys(file)
    setup = set_up_robot(file)
    try:
        override(load_robot_config(package_folder / 'config'), setup.settings)
    except ConfigError as error:
        raise ConfigError(f'{file.where}: {error}') from None
    return setup


def _check_keys(file: RobotFile) -> None:
    for key in file.overrides:
        try:
            check_key(key)
        except ConfigError as error:
            raise ConfigError(f'{file.where}: set: {error}') from None
