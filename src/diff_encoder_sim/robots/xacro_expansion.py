"""A robot's xacro or URDF file as URDF text, and the search for its packages and meshes, with and without ROS.

xacro runs in a process with limits of time and memory: a xacro is a program, and may never end.

The search order: the package that the robot's file belongs to, by its package.xml; the folders that the user names;
the folders above the robot's file and their neighbours; ROS_PACKAGE_PATH and AMENT_PREFIX_PATH. A package has the name
in its package.xml or its folder's.
"""

from __future__ import annotations

import functools
import itertools
import json
import os
import re
import resource
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple
from urllib.parse import unquote
from xml.sax.saxutils import quoteattr

from diff_encoder_sim.base.errors import ConfigError, in_one_line
from diff_encoder_sim.base.params import did_you_mean
from diff_encoder_sim.base.processes import python_command
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.urdf_reading import read_robot_text

MOST_S = 60
MOST_MEMORY_BYTES = 2**29  # of addresses: 10,000 links take a fifth
ADDED_LINK = 'laser'  # with a number, if the URDF has a link of this name

_NEEDS_XACRO = re.compile(r'xacro:|\$[({]')
_WARNING = re.compile(r'^warning: (.*)$', re.MULTILINE)
_ASKED = re.compile(r'<xacro:arg\s[^>]*?name\s*=\s*["\']([^"\']+)|\$\(\s*arg\s+([^\s)]+)|xacro\.arg\(\s*["\'](\w+)')
_MISSING_PACKAGE = re.compile(r'package://([\w.-]+)')

SEARCH_VARIABLES = ('ROS_PACKAGE_PATH', 'AMENT_PREFIX_PATH')
MOST_LEVELS_DOWN = 5
MOST_LEVELS_UP = 8
MOST_FOLDERS = 10_000  # that one search looks into: a user may name the home folder

_NAME = re.compile(rb'<name>\s*([^<\s]+)\s*</name>')
_IGNORED = {'CATKIN_IGNORE', 'COLCON_IGNORE', 'AMENT_IGNORE'}


def xacro_arguments(words: Sequence[str], where: str = '--robot-arg') -> Dict[str, str]:
    """Read arguments of a xacro; ConfigError if one is not NAME:=VALUE."""
    arguments: Dict[str, str] = {}
    for word in words:
        name, separator, value = word.partition(':=')
        if not (name and separator):
            raise ConfigError(f'{where}: given {word!r}; allowed: name:=value')
        arguments[name] = value
    return arguments


def xacro_arguments_of_text(text: str) -> Dict[str, str]:
    """Read robot_args of a launch file: name=value, as roslaunch passes no := within a value; ConfigError otherwise."""
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise ConfigError(f'robot_args: given {text!r}: {error}; allowed: name=value name=value') from None
    return xacro_arguments([word if ':=' in word else word.replace('=', ':=', 1) for word in words], 'robot_args')


class Expansion(NamedTuple):
    """URDF text made from a robot's file."""

    urdf: str
    declared: Tuple[str, ...] = ()  # names of the xacro arguments that the files declare or use
    notes: Tuple[str, ...] = ()  # xacro's warnings, missing packages
    laser_link: Optional[str] = None  # of the laser that the user adds


_kept: Dict[Any, Tuple[Expansion, Dict[str, Optional[int]]]] = {}  # with modification times [ns] of files


def expansion(source: RobotSource) -> Expansion:
    """Return a robot's URDF with notes; ConfigError if the file cannot be read or expanded, or has no such argument."""
    text = read_robot_text(source.file)
    needs_xacro = source.file.suffix == '.xacro' or _NEEDS_XACRO.search(text)
    result = _by_xacro(source) if needs_xacro else Expansion(text)
    for name, _ in source.arguments:
        if name not in result.declared:
            allowed = ', '.join(result.declared) or 'no argument'
            hint = did_you_mean(name, result.declared)
            raise ConfigError(f'{source.file}: argument {name!r} is not known{hint}; allowed: {allowed}')
    if source.added_laser is None:
        return result
    taken = set(re.findall(r'\sname\s*=\s*["\'](.*?)["\']', result.urdf))
    names = itertools.chain([ADDED_LINK], (f'{ADDED_LINK}_{number}' for number in itertools.count(2)))
    link, xyz = next(name for name in names if name not in taken), ' '.join(map(str, source.added_laser.xyz_m))
    added = (
        f'<link name="{link}"/><joint name="added_{link}_joint" type="fixed"><origin xyz="{xyz}" rpy="0 0 0"/>'
        f'<parent link={quoteattr(source.added_laser.parent)}/><child link="{link}"/></joint>'
    )
    before, end, after = result.urdf.rpartition('</')
    return result._replace(urdf=before + added + end + after, laser_link=link)


def _by_xacro(source: RobotSource) -> Expansion:
    """Expand a xacro; the result is kept until one of its files changes, as each trial of a campaign needs it."""
    key = (source, tuple(map(os.environ.get, SEARCH_VARIABLES)))
    if key in _kept and _kept[key][1] == _versions(_kept[key][1]):
        return _kept[key][0]
    request = [str(source.file), source.arguments, list(map(str, source.package_folders))]
    try:
        process = subprocess.run(
            python_command('robots.xacro_expansion'),
            input=json.dumps(request), capture_output=True,
            timeout=MOST_S, check=False, encoding='utf-8', errors='replace',
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise ConfigError(f'{source.file}: takes longer than {MOST_S} s to expand') from None
    if process.returncode:
        last = process.stderr.strip().splitlines()[-1:] or [f'status {process.returncode}']
        raise ConfigError(f'{source.file}: cannot be expanded: {last[0]}')
    answer: Dict[str, Any] = json.loads(process.stdout)
    if 'fault' in answer:
        raise ConfigError(answer['fault'])
    notes = (*answer['notes'], *dict.fromkeys(_WARNING.findall(process.stderr)))
    result = Expansion(answer['urdf'], tuple(answer['declared']), notes)
    _kept[key] = result, _versions(answer['opened'])
    return result


def _versions(paths: Iterable[str]) -> Dict[str, Optional[int]]:
    return {path: os.stat(path).st_mtime_ns if os.path.exists(path) else None for path in paths}


def main() -> None:
    """Expand the xacro that the request on stdin names; write its URDF or one line on its fault to stdout, as JSON."""
    _, hard_bytes = resource.getrlimit(resource.RLIMIT_AS)  # that of the job that starts this process may be lower
    most_bytes = MOST_MEMORY_BYTES if hard_bytes == resource.RLIM_INFINITY else min(MOST_MEMORY_BYTES, hard_bytes)
    resource.setrlimit(resource.RLIMIT_AS, (most_bytes, hard_bytes))
    file, arguments, folders = json.load(sys.stdin)
    source = RobotSource(Path(file), tuple(map(tuple, arguments)), tuple(map(Path, folders)))
    answer_to, sys.stdout = sys.stdout, sys.stderr  # xacro's prints are no part of the answer
    json.dump(_expanded(source), answer_to)


def _expanded(source: RobotSource) -> Dict[str, Any]:
    """Return the URDF of a xacro or its fault, notes, declared arguments, and the files it depends on."""
    import xacro  # noqa: PLC0415  only the process that expands needs it

    opened: Dict[str, None] = {}
    notes: Dict[str, None] = {}
    substitute = xacro.eval_extension

    def note_file(event: str, arguments: Any) -> None:
        if event == 'open' and isinstance(arguments[0], str):
            path = os.path.abspath(arguments[0])
            if not path.endswith(('.py', '.pyc', 'package.xml')):
                opened[path] = None

    def with_our_packages(text: str) -> str:
        """Resolve '$(...)'; xacro would need ROS to find packages."""
        words = text[2:-1].split()
        if len(words) != 2 or words[0] != 'find':
            return str(substitute(text))
        folder = find_package(words[1], source)
        if folder is None:  # an error only if a file of it is read
            notes[f'package {words[1]!r} is not found; $(find {words[1]}) became package://{words[1]}'] = None
        return str(folder or f'package://{words[1]}')

    sys.addaudithook(note_file)
    xacro.eval_extension = with_our_packages
    answer: Dict[str, Any] = {}
    try:
        document = xacro.process_file(str(source.file), mappings=dict(source.arguments))
        # Not the whole document: xacro's banner has the file's path in it.
        answer['urdf'] = '<?xml version="1.0"?>\n' + document.documentElement.toprettyxml(indent='  ')
    except Exception as error:  # a xacro is a program: it may raise any exception
        message = in_one_line(error)[:600]
        missing = _MISSING_PACKAGE.search(message)
        places = dict.fromkeys([str(source.file), *map(str, xacro.filestack[-1:])])  # with the file that is being read
        answer['fault'] = f'{": ".join(places)}: {missing_package(missing[1], source) if missing else message}'
    texts = [Path(path).read_text(encoding='utf-8', errors='replace') for path in list(opened) if os.path.isfile(path)]
    declared = dict.fromkeys(name for text in texts for match in _ASKED.findall(text) for name in match if name)
    return {**answer, 'notes': list(notes), 'declared': list(declared), 'opened': list(opened)}


def missing_package(name: str, source: RobotSource) -> str:
    """Return the text of an error: where a package was looked for, and how to name its folder."""
    folders = [*source.package_folders, *_folders_above(source.file)[:2], 'the folders above']
    variables = [f'{each} ({os.environ.get(each) or "not set"})' for each in SEARCH_VARIABLES]
    return (
        f'package {name!r} is not found; looked for in {", ".join(map(str, [*folders, *variables]))}; '
        'name a folder that has it under packages in the robot file, or as --packages'
    )


def find_mesh(uri: str, source: RobotSource) -> Path:
    """Return the file of a mesh: package://, model://, file://, or relative to the robot's; ConfigError if missing."""
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


def find_package(name: str, source: RobotSource) -> Optional[Path]:
    """Return a package's folder; None if there is none."""
    above = _folders_above(source.file)
    own = next((folder for folder in above if (folder / 'package.xml').is_file()), None)
    neighbours = [own.parent, own.parent.parent] if own else []
    ros_1, ros_2 = (
        [Path(each) for each in os.environ.get(it, '').split(os.pathsep) if each] for it in SEARCH_VARIABLES
    )
    places = [  # a folder, and the number of levels below it
        *((folder, 0) for folder in above if _declared_name(folder) == name),
        *((_absolute(folder), MOST_LEVELS_DOWN) for folder in source.package_folders),
        *((folder, 0) for folder in (*above, *(folder / name for folder in above))),
        *((folder, 3) for folder in neighbours if folder != Path(folder.anchor)),
        *((Path(folder), MOST_LEVELS_DOWN) for folder in ros_1),
        *((Path(prefix, 'share', name), 0) for prefix in ros_2),
    ]
    found = (_package_below(name, folder, levels) for folder, levels in places)
    return next(filter(None, found), None) if name else None


def _folders_above(file: Path) -> List[Path]:
    """Return the folders above a file, nearest first; not the file system's root."""
    return list(_absolute(file).parents)[:-1][:MOST_LEVELS_UP]


def _absolute(path: Path) -> Path:
    return Path(os.path.abspath(str(path)))  # links stay: a workspace's are its order


def _declared_name(folder: Path) -> str:
    """Return the name in a folder's package.xml; '' if there is none."""
    try:
        declared = _NAME.search((folder / 'package.xml').read_bytes())
    except OSError:
        return ''
    return declared[1].decode(errors='replace') if declared else ''


def _package_below(name: str, folder: Path, levels: int) -> Optional[Path]:
    """Return a package that is a folder, or some levels below it."""
    if levels and _declared_name(folder / name) == name:
        return folder / name
    return _packages_below(folder, levels, folder.stat().st_mtime_ns).get(name) if folder.is_dir() else None


@functools.lru_cache(maxsize=64)
def _packages_below(folder: Path, levels: int, _changed_ns: int) -> Dict[str, Path]:
    """Return packages by their package.xml, breadth first, not below each other, then folders by name; cached."""
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
