"""Finds ROS packages and the files in them, with and without ROS.

The search order: the package that the robot's file belongs to, by its package.xml; the folders that the user names;
the folders above the robot's file and their neighbours; ROS_PACKAGE_PATH, AMENT_PREFIX_PATH and COLCON_PREFIX_PATH. A
package has the name in its package.xml or its folder's; some are looked for by the other.
"""

from __future__ import annotations

import functools
import os
import re
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Optional
from urllib.parse import unquote

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.description import RobotSource

SEARCH_VARIABLES = ('ROS_PACKAGE_PATH', 'AMENT_PREFIX_PATH', 'COLCON_PREFIX_PATH', 'GAZEBO_MODEL_PATH')
MOST_LEVELS_DOWN = 5
MOST_LEVELS_UP = 8
MOST_FOLDERS = 10_000  # that one search looks into

_NAME = re.compile(rb'<name>\s*([^<\s]+)\s*</name>')
_IGNORED = ('CATKIN_IGNORE', 'COLCON_IGNORE', 'AMENT_IGNORE')


def find_package(name: str, source: RobotSource) -> Optional[Path]:
    """Return a package's folder; None where there is none."""
    if not re.fullmatch(r'\w[\w.-]*', name):
        return None
    found = (folder for folder in _candidates(name, source) if folder is not None)
    return next(found, None)


def missing_package(name: str, source: RobotSource) -> str:
    """Return the text of an error: where a package was looked for, and how to name its folder."""
    return (
        f'package {name!r} is not found; looked for in {", ".join(searched_folders(source))}; '
        'name a folder that has it under packages in the robot file, or as --packages'
    )


def searched_folders(source: RobotSource) -> List[str]:
    """Return the places where packages are looked for, for an error's text."""
    above = [str(folder) for folder in _folders_above(source.file)[:2]]
    named = [str(folder) for folder in source.package_folders]
    variables = [
        f'{variable} ({os.pathsep.join(map(str, _paths_of(variable))) or "not set"})'
        for variable in SEARCH_VARIABLES[:2]
    ]
    return [*named, *above, 'the folders above', *variables]


def find_mesh(uri: str, source: RobotSource) -> Path:
    """Return the file that a mesh's name means; see `resolve_uri`.

    Raises:
        ConfigError: the package or the file is missing.
    """
    path = resolve_uri(uri, source)
    if path is None:
        raise ConfigError(_why_missing(uri.strip(), source))
    return path


def _why_missing(uri: str, source: RobotSource) -> str:
    scheme, separator, rest = uri.partition('://')
    if scheme == 'file' and '://' in rest:
        return _why_missing(rest, source)
    if scheme not in ('package', 'model'):
        path = Path(rest) if separator else _absolute(source.file).parent / uri
        return f"there is no file {path}; allowed: an .stl, .obj or .dae file, its path relative to the robot's file"
    name, _, inside = rest.partition('/')
    package = find_package(name, source)
    return missing_package(name, source) if package is None else f'package {name!r} in {package} has no file {inside!r}'


def resolve_uri(uri: str, source: RobotSource) -> Optional[Path]:
    """Return the file that a mesh's name means: package://, model://, file://, or relative to the robot's file.

    None where there is no such file.
    """
    files = (path for path in _meant_paths(uri.strip(), source) if path.is_file())
    return next(files, None)


def _meant_paths(uri: str, source: RobotSource) -> Iterator[Path]:
    scheme, separator, rest = uri.partition('://')
    if not separator:
        yield _absolute(source.file).parent / uri
    elif scheme == 'file':
        # A $(find) of a package that was not there has left its package:// behind file://.
        yield from _meant_paths(rest, source) if '://' in rest else (Path(rest), Path(unquote(rest)))
    elif scheme in ('package', 'model'):
        name, _, inside = rest.partition('/')
        package = find_package(name, source)
        if package is not None:
            yield package / inside
        yield from (folder / name / inside for folder in _paths_of('GAZEBO_MODEL_PATH'))
        # Of a description that was copied without its package.xml.
        yield from (folder / inside for folder in _folders_above(source.file))


def _candidates(name: str, source: RobotSource) -> Iterator[Optional[Path]]:
    yield next((folder for folder in _folders_above(source.file) if _declared_name(folder) == name), None)
    for folder in source.package_folders:
        yield _package_below(name, _absolute(folder), MOST_LEVELS_DOWN)
    yield from _candidates_above(name, source.file)
    for folder in _paths_of('ROS_PACKAGE_PATH'):
        yield _package_below(name, folder, MOST_LEVELS_DOWN)
    for variable in ('AMENT_PREFIX_PATH', 'COLCON_PREFIX_PATH'):
        for prefix in _paths_of(variable):
            yield _if_package(name, prefix / 'share' / name)
            yield _if_package(name, prefix / name / 'share' / name)


def _candidates_above(name: str, file: Path) -> Iterator[Optional[Path]]:
    """Yield the folders above a file that are the package, then their neighbours."""
    above = _folders_above(file)
    for folder in above:
        yield _if_package(name, folder)
    for folder in above:
        yield _if_package(name, folder / name)
    own = next((folder for folder in above if (folder / 'package.xml').is_file()), None)
    if own is None:
        return
    for folder in (own.parent, own.parent.parent):
        if folder != Path(folder.anchor):
            yield _package_below(name, folder, 3)


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
    """Return the name in a folder's package.xml; '' where there is none."""
    try:
        with (folder / 'package.xml').open('rb') as file:
            declared = _NAME.search(file.read(100_000))
    except OSError:
        return ''
    return declared[1].decode(errors='replace') if declared else ''


class _Crawl(NamedTuple):
    """What a search below a folder has found."""

    packages: Dict[str, Path]  # by the name in their package.xml
    folders: Dict[str, Path]  # all, by their own names


def _package_below(name: str, folder: Path, levels: int) -> Optional[Path]:
    """Return a package that is a folder, or some levels below it."""
    near = folder / name
    if _declared_name(near) == name:
        return near
    try:
        changed_ns = folder.stat().st_mtime_ns
    except OSError:
        return None
    found = _crawl(folder, levels, changed_ns)
    return found.packages.get(name) or found.folders.get(name)


@functools.lru_cache(maxsize=64)
def _crawl(folder: Path, levels: int, _changed_ns: int) -> _Crawl:
    """Look for packages, breadth first; below a package there is no other. Cached until the folder changes."""
    found, level = _Crawl({}, {}), [folder]
    count = 0
    for _ in range(levels + 1):
        below: List[Path] = []
        for each in level:
            count += 1
            name = _declared_name(each)
            found.folders.setdefault(each.name, each)
            if name:
                found.packages.setdefault(name, each)
            elif count < MOST_FOLDERS:
                below += _subfolders(each)
        level = below
    return found


def _subfolders(folder: Path) -> List[Path]:
    try:
        entries = sorted(os.scandir(str(folder)), key=lambda entry: entry.name)
        folders = [Path(entry.path) for entry in entries if not entry.name.startswith('.') and entry.is_dir()]
    except OSError:
        return []
    return [] if any(entry.name in _IGNORED for entry in entries) else folders
