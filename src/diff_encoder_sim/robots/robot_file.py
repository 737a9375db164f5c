"""A robot as users name it: one that comes with the package, a robot file (YAML), or a xacro or URDF alone."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import yaml
from pydantic import Field

from diff_encoder_sim.base.bounds import Offset_m, PulsesPerTurn
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import Params, did_you_mean, load_params
from diff_encoder_sim.robots.description import AddedLaser, RobotSource

ROBOT_FILE_SUFFIXES = ('.yaml', '.yml')


class AddedLaserParams(Params):
    """A scanner for a robot, in place of those of its URDF."""

    parent: str = Field(min_length=1, description='link that carries it')
    xyz: List[Offset_m] = Field(min_length=3, max_length=3, description='place in that link [m]')


class RobotFileParams(Params):
    """The keys of a robot file; config/robots/ has patterns."""

    urdf: str = Field(min_length=1, description='xacro or URDF file, relative to this file')
    arguments: Dict[str, Union[bool, int, float, str]] = Field({}, description='xacro arguments by name')
    packages: List[str] = Field(
        [], description='folders in which packages of package:// and $(find) are looked for, relative to this file'
    )
    laser: Optional[AddedLaserParams] = Field(
        None, description='a level scanner, added as link `laser` and simulated in place of those of the URDF'
    )
    ppr: Optional[PulsesPerTurn] = Field(
        None, description="counts per wheel revolution of the robot's own encoder; need not be whole"
    )
    overrides: Dict[str, Any] = Field({}, alias='set', description='values of parameters, by dotted keys')


class RobotNotFound(ConfigError):
    """There is no robot of that name or path."""


class RobotFile(NamedTuple):
    """A robot's own files and numbers."""

    source: RobotSource
    ppr: Optional[float]  # counts per wheel revolution; None if no robot file gives it
    overrides: Dict[str, Any]  # by dotted keys, as robot_params.override takes them
    label: str  # such as 'burger'
    where: str  # the file to name in errors about these values


def robot_file_line(urdf: str, **content: Any) -> str:
    """Return the content of a robot file in one line of YAML, for messages that propose one."""
    text = yaml.safe_dump(
        {'urdf': urdf, **content}, default_flow_style=True, sort_keys=False, width=math.inf, allow_unicode=True
    )
    return f'a robot file (YAML): {text.strip()}'


def load_robot_file(
    given: str, folder: Path, package_folder: Path, arguments: Mapping[str, str], packages: Sequence[Path] = ()
) -> RobotFile:
    """Load a robot by its name, its YAML file, or its xacro or URDF alone.

    A path is relative to `folder`; names are those of config/robots/ in `package_folder`. Arguments and packages of
    the command line precede those of the file.

    Raises:
        RobotNotFound: there is no such robot.
        ConfigError: its YAML file has a bad key, or a folder of packages is missing.
    """
    shipped, path = package_folder / 'config' / 'robots' / f'{given}.yaml', folder / Path(given).expanduser()
    if Path(given).name == given and shipped.is_file():  # a name takes precedence over a path
        path = shipped
    elif not given or not path.exists():
        names = robot_names(package_folder / 'config')
        allowed = f'{", ".join(names)}, or a .yaml, .xacro or .urdf file{did_you_mean(given, names)}'
        raise RobotNotFound(f'robot: given {given!r}, but there is no {path}; allowed: {allowed}')
    if path.suffix not in ROBOT_FILE_SUFFIXES:
        source = RobotSource(path, _as_pairs(arguments), _checked(packages, 'packages'))
        return RobotFile(source, None, {}, path.name.partition('.')[0], str(path))
    params = load_params(RobotFileParams, path)
    own_packages = [path.parent / Path(each).expanduser() for each in params.packages]
    urdf = path.parent / Path(params.urdf).expanduser()
    urdf = urdf.resolve() if '..' in urdf.parts else urdf  # as people read it: a/b for a/c/../b
    folders = (*_checked(packages, 'packages'), *_checked(own_packages, f'{path}: packages'))
    laser = None if params.laser is None else AddedLaser(params.laser.parent, tuple(params.laser.xyz))
    source = RobotSource(urdf, _as_pairs({**params.arguments, **arguments}), folders, laser)
    return RobotFile(source, params.ppr, dict(params.overrides), path.stem, str(path))


def robot_names(config_folder: Path) -> List[str]:
    """Return the names of the robots in config/robots."""
    return sorted(path.stem for path in (config_folder / 'robots').glob('*.yaml'))


def _checked(folders: Sequence[Path], where: str) -> Tuple[Path, ...]:
    for folder in folders:
        if not folder.is_dir():
            raise ConfigError(f'{where}: given {str(folder)!r}; allowed: a folder that exists')
    return tuple(folders)


def _as_pairs(arguments: Mapping[str, Union[bool, float, str]]) -> Tuple[Tuple[str, str], ...]:
    """Return arguments as text, as xacro takes them: true and false as in YAML."""
    texts = {name: str(value).lower() if isinstance(value, bool) else str(value) for name, value in arguments.items()}
    return tuple(sorted(texts.items()))
