"""Finds ROS packages and the files in them, with and without ROS.

The search order: the package that the robot's file belongs to, by its package.xml; the folders that the user names;
the folders above the robot's file and their neighbours; ROS_PACKAGE_PATH and AMENT_PREFIX_PATH. A package has the name
in its package.xml or its folder's.
"""

from __future__ import annotations

import functools
import os
import re
from pathlib import Path
from typing import Dict, Iterator, List, Optional
from urllib.parse import unquote

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.description import RobotSource

SEARCH_VARIABLES = ('ROS_PACKAGE_PATH', 'AMENT_PREFIX_PATH')
MOST_LEVELS_DOWN = 5
MOST_LEVELS_UP = 8
MOST_FOLDERS = 10_000  # that one search looks into: a user may name the home folder

_NAME = re.compile(rb'<name>\s*([^<\s]+)\s*</name>')
_IGNORED = {'CATKIN_IGNORE', 'COLCON_IGNORE', 'AMENT_IGNORE'}


def find_package(name: str, source: RobotSource) -> Optional[Path]:
    """Return a package's folder; None if there is none."""
    return next((folder for folder in _candidates(name, source) if folder is not None), None) if name else None


def missing_package(name: str, source: RobotSource) -> str:
    """Return the text of an error: where a package was looked for, and how to name its folder."""
    folders = [*source.package_folders, *_folders_above(source.file)[:2], 'the folders above']
    variables = [f'{each} ({os.environ.get(each) or "not set"})' for each in SEARCH_VARIABLES]
    return (
        f'package {name!r} is not found; looked for in {", ".join(map(str, [*folders, *variables]))}; '
        'name a folder that has it under packages in the robot file, or as --packages'
    )


def find_mesh(uri: str, source: RobotSource) -> Path:
    """Return the file of a mesh's name: package://, model://, file://, or relative to the robot's file.

    Raises:
        ConfigError: the package or the file is missing.
    """
    uri = uri.strip()
    scheme, separator, rest = uri.partition('://')
    if scheme == 'file' and '://' in rest:  # a $(find) of a package that was not there has left its package://
        return find_mesh(rest, source)
    if scheme not in ('package', 'model'):
        path = Path(unquote(rest)) if separator else _absolute(source.file).parent / uri
        if path.is_file():
            return path
        allowed = "an .stl, .obj or .dae file, its path relative to the robot's file"
        raise ConfigError(f'there is no file {path}; allowed: {allowed}')
    name, _, inside = rest.partition('/')
    package = find_package(name, source)
    # The folders above are those of a description that was copied without its package.xml.
    folders = [*([package] if package else []), *_folders_above(source.file)]
    found = next((folder / inside for folder in folders if (folder / inside).is_file()), None)
    if found is None:
        missing = f'package {name!r} in {package} has no file {inside!r}'
        raise ConfigError(missing_package(name, source) if package is None else missing)
    return found


def _candidates(name: str, source: RobotSource) -> Iterator[Optional[Path]]:
    above = _folders_above(source.file)
    yield next((folder for folder in above if _declared_name(folder) == name), None)
    for folder in source.package_folders:
        yield _package_below(name, _absolute(folder), MOST_LEVELS_DOWN)
    for folder in (*above, *(folder / name for folder in above)):
        yield _if_package(name, folder)
    own = next((folder for folder in above if (folder / 'package.xml').is_file()), None)
    for folder in (own.parent, own.parent.parent) if own is not None else ():
        if folder != Path(folder.anchor):
            yield _package_below(name, folder, 3)
    for folder in _paths_of('ROS_PACKAGE_PATH'):
        yield _package_below(name, folder, MOST_LEVELS_DOWN)
    for prefix in _paths_of('AMENT_PREFIX_PATH'):
        yield _if_package(name, prefix / 'share' / name)


def _folders_above(file: Path) -> List[Path]:
    """Return the folders above a file, nearest first; not the file system's root."""
    return list(_absolute(file).parents)[:-1][:MOST_LEVELS_UP]


def _absolute(path: Path) -> Path:
    return Path(os.path.abspath(str(path)))  # links stay: a workspace's are its order


def _paths_of(variable: str) -> List[Path]:
    return [Path(entry) for entry in os.environ.get(variable, '').split(os.pathsep) if entry]


def _if_package(name: str, folder: Path) -> Optional[Path]:
    """Return the folder if it is the package: by its package.xml or its own name."""
    return folder if folder.is_dir() and name in (_declared_name(folder), folder.name) else None


def _declared_name(folder: Path) -> str:
    """Return the name in a folder's package.xml; '' if there is none."""
    try:
        declared = _NAME.search((folder / 'package.xml').read_bytes())
    except OSError:
        return ''
    return declared[1].decode(errors='replace') if declared else ''


def _package_below(name: str, folder: Path, levels: int) -> Optional[Path]:
    """Return a package that is a folder, or some levels below it."""
    if _declared_name(folder / name) == name:
        return folder / name
    return _packages_below(folder, levels, folder.stat().st_mtime_ns).get(name) if folder.is_dir() else None


@functools.lru_cache(maxsize=64)
def _packages_below(folder: Path, levels: int, _changed_ns: int) -> Dict[str, Path]:
    """Return the packages by the names in their package.xml, then all folders by their own names.

    Breadth first; below a package there is no other. Cached until the folder changes.
    """
    packages: Dict[str, Path] = {}
    folders: Dict[str, Path] = {}
    level = [folder]
    for _ in range(levels + 1):
        below: List[Path] = []
        for each in level:
            name = _declared_name(each)
            folders.setdefault(each.name, each)
            if name:
                packages.setdefault(name, each)
            elif len(folders) < MOST_FOLDERS and os.access(str(each), os.R_OK | os.X_OK):
                entries = sorted(each.iterdir())
                if not _IGNORED.intersection(entry.name for entry in entries):
                    below += [entry for entry in entries if entry.is_dir() and not entry.name.startswith('.')]
        level = below
    return {**folders, **packages}
