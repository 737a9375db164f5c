"""A robot's xacro or URDF file as URDF text."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shlex
import signal
import subprocess
from pathlib import Path
from typing import Any, Collection, Dict, Iterable, NamedTuple, Optional, Sequence, Tuple
from xml.etree import ElementTree

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import did_you_mean
from diff_encoder_sim.base.processes import python_command
from diff_encoder_sim.robots.description import RobotSource, added_link, with_laser
from diff_encoder_sim.robots.package_search import SEARCH_VARIABLES
from diff_encoder_sim.robots.urdf_reading import MOST_BYTES, read_robot_text


def xacro_arguments(words: Sequence[str], where: str = '--robot-arg') -> Dict[str, str]:
    """Read arguments of a xacro.

    Raises:
        ConfigError: one is not NAME:=VALUE, or a name comes twice.
    """
    arguments: Dict[str, str] = {}
    for word in words:
        name, separator, value = word.partition(':=')
        if not (name and separator):
            raise ConfigError(f'{where}: given {word!r}; allowed: name:=value')
        if name in arguments:
            raise ConfigError(f'{where}: given {name!r} twice; allowed: once')
        arguments[name] = value
    return arguments


def xacro_arguments_of_text(text: str) -> Dict[str, str]:
    """Read the launch argument robot_args: name=value, as roslaunch passes no := within a value.

    Raises:
        ConfigError: it is not such pairs, separated by blanks.
    """
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise ConfigError(f'robot_args: given {text!r}: {error}; allowed: name=value name=value') from None
    return xacro_arguments([word if ':=' in word else word.replace('=', ':=', 1) for word in words], 'robot_args')


MOST_S = 120  # of waiting; the process has its own limits of computing
MOST_KEPT = 32

_NEEDS_XACRO = re.compile(r'xacro:|\$[({]')
_WARNING = re.compile(r'^warning: (.*)$', re.MULTILINE)


class Expansion(NamedTuple):
    """What a robot's file has become."""

    urdf: str
    declared: Tuple[str, ...] = ()  # names of the xacro arguments that the files declare or use
    notes: Tuple[str, ...] = ()  # xacro's warnings, packages that are not there
    laser_link: Optional[str] = None  # of the laser that the user adds


class _Kept(NamedTuple):
    expansion: Expansion
    digests: Dict[str, Optional[str]]  # of all files that it was made from
    environment: Dict[str, Optional[str]]


_kept: Dict[RobotSource, _Kept] = {}


def expand(source: RobotSource) -> str:
    """Return the URDF text of a robot.

    Raises:
        ConfigError: the file cannot be read or expanded, or does not know an argument.
    """
    return expansion(source).urdf


def expansion(source: RobotSource) -> Expansion:
    """Return the URDF text of a robot, and what was noted on the way.

    A campaign asks for the same few robots in each of its trials, so results are kept until a file or variable that
    they were made from changes.

    Raises:
        ConfigError: the file cannot be read or expanded, or does not know an argument.
    """
    text = read_robot_text(source.file)
    needs_xacro = source.file.suffix == '.xacro' or _NEEDS_XACRO.search(text)
    result = _by_xacro(source) if needs_xacro else Expansion(text)
    for name, _ in source.arguments:
        if name not in result.declared:
            raise ConfigError(
                f'{source.file}: argument {name!r} is not known{did_you_mean(name, result.declared)}; '
                f'allowed: {", ".join(result.declared) or "no argument"}'
            )
    if source.added_laser is None:
        return result
    return result._replace(urdf=with_laser(result.urdf, source.added_laser), laser_link=added_link(result.urdf))


def _by_xacro(source: RobotSource) -> Expansion:
    kept = _kept.pop(source, None)
    if kept is None or kept.digests != _digests(kept.digests) or kept.environment != _values(kept.environment):
        answer = _ask(source)
        urdf, notes = answer['urdf'], (*answer['notes'], *answer['warnings'])
        made = Expansion(urdf, tuple(answer['declared']), notes)
        if answer['opened'] is None:
            return made  # it depends on what is in a folder
        kept = _Kept(made, _digests(answer['opened']), _values([*SEARCH_VARIABLES, *answer['environment']]))
    _kept[source] = kept
    if len(_kept) > MOST_KEPT:
        _kept.pop(next(iter(_kept)), None)
    return kept.expansion


def _ask(source: RobotSource) -> Dict[str, Any]:
    """Run the expansion in its own process.

    Raises:
        ConfigError: what is wrong with the file.
    """
    folders = list(map(str, source.package_folders))
    request = {'file': str(source.file), 'arguments': source.arguments, 'package_folders': folders}
    try:
        process = subprocess.run(
            python_command('robots.xacro_process'),
            input=json.dumps(request), capture_output=True,
            timeout=MOST_S, check=False, encoding='utf-8', errors='replace',
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise ConfigError(f'{source.file}: takes longer than {MOST_S} s to expand') from None
    if process.returncode:
        raise ConfigError(f'{source.file}: {_end_of(process)}')
    answer: Dict[str, Any] = json.loads(process.stdout)
    if 'fault' in answer:
        raise ConfigError(answer['fault'])
    if len(answer['urdf']) > MOST_BYTES:
        raise ConfigError(f'{source.file}: expands to more than {MOST_BYTES // 10**6} MB')
    answer['warnings'] = list(dict.fromkeys(_WARNING.findall(process.stderr)))
    return answer


def _end_of(process: subprocess.CompletedProcess[str]) -> str:
    if process.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        return 'takes too much computing to expand: do its macros or expressions ever end?'
    last = process.stderr.strip().splitlines()[-1:] or [f'status {process.returncode}']
    return f'cannot be expanded: {last[0]}'


def _digests(paths: Iterable[str]) -> Dict[str, Optional[str]]:
    return {path: _digest(Path(path)) for path in paths}


def _digest(path: Path) -> Optional[str]:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else None
    except OSError:
        return None


def _values(names: Iterable[str]) -> Dict[str, Optional[str]]:
    return {name: os.environ.get(name) for name in names}


# Of a xacro that can hang the root link's inertia on a link of its own.
ROOT_INERTIA = 'root_inertia'


def without_root_inertia(source: RobotSource) -> RobotSource:
    """Return the source with the xacro's own argument for it, where it has one."""
    if ROOT_INERTIA not in expansion(source).declared or ROOT_INERTIA in dict(source.arguments):
        return source
    return source._replace(arguments=(*source.arguments, (ROOT_INERTIA, 'false')))


def display_urdf(source: RobotSource, moving: Collection[str]) -> str:
    """Return the URDF with all joints fixed but those that are published on /joint_states, named by `moving`.

    A link below a joint without a state has no frame: a caster's, a laser's on a mast that can be lifted. The root link
    has no inertia, of which robot_state_publisher warns.

    Raises:
        ConfigError: the file cannot be read or expanded.
    """
    urdf = expansion(without_root_inertia(source)).urdf
    robot = ElementTree.fromstring(urdf.strip())
    still = [
        joint for joint in robot.findall('joint') if joint.get('type') != 'fixed' and joint.get('name') not in moving
    ]
    for joint in still:
        joint.set('type', 'fixed')
        for tag in ('mimic', 'limit'):
            for element in joint.findall(tag):
                joint.remove(element)
    is_changed = _remove_root_inertia(robot) or bool(still)
    return ElementTree.tostring(robot, encoding='unicode') if is_changed else urdf


def _remove_root_inertia(robot: ElementTree.Element) -> bool:
    children = {child.get('link') for child in robot.findall('joint/child')}
    for link in robot.findall('link'):
        inertial = link.find('inertial')
        if link.get('name') not in children and inertial is not None:
            link.remove(inertial)
            return True
    return False
