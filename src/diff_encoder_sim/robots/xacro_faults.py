"""Says in one line, with file and line number, what is wrong with a xacro."""

from __future__ import annotations

import re
from typing import Iterator, List, Mapping, Optional, Sequence

import xacro

from diff_encoder_sim.base.errors import in_one_line
from diff_encoder_sim.robots.package_search import missing_package
from diff_encoder_sim.robots.robot_source import RobotSource

MOST_CHARACTERS = 600

_ARGUMENT = re.compile(r"Undefined substitution argument '?(\w+)")
_PACKAGE = re.compile(r'package://([\w.-]+)')

# Parts of xacro's messages that stand in the file as they are.
_QUOTED = (
    re.compile(r"when evaluating expression '(.+?)'(?: when evaluating|$)"),
    re.compile(r'unknown macro name: (\S+)'),
    re.compile(r'^No such file or directory: .*?([^/]+)$'),
    re.compile(r'environment variable \'(\w+)\''),
    re.compile(r'substitution command \[(.+?)\]'),
    re.compile(r'^(xacro:\w+): missing attribute'),
    re.compile(r'"([^"]+)"'),
)


def explain(error: BaseException, source: RobotSource, texts: Mapping[str, str], declared: Sequence[str]) -> str:
    """Return one line on what an expansion raised.

    Args:
        error: what came out of xacro.
        source: the robot.
        texts: the files that were read, by path.
        declared: names of the arguments that the files declare or use.
    """
    causes = list(_chain(error))
    if any(isinstance(cause, RecursionError) for cause in causes):
        return f'{source.file}: macros, properties or includes refer to each other without end'
    if any(isinstance(cause, MemoryError) for cause in causes):
        return f'{source.file}: needs too much memory to expand'
    message, fragment = _message(causes), ''
    argument, package = _ARGUMENT.search(message), _PACKAGE.search(message)
    if argument:
        others = ', '.join(name for name in declared if name != argument[1])
        message = (
            f'argument {argument[1]!r} has no value, and no <xacro:arg> with a default; others: {others or "none"}; '
            f'give it as --robot-arg {argument[1]}:=VALUE'
        )
        fragment = f'arg {argument[1]}'
    elif package:
        message, fragment = missing_package(package[1], source), f'find {package[1]}'
    file = str(xacro.filestack[-1]) if xacro.filestack else str(source.file)
    where = place(file, fragment or _quoted(message), source, texts)
    return f'{where}: {_clipped(message)}'


def place(file: str, fragment: Optional[str], source: RobotSource, texts: Mapping[str, str]) -> str:
    """Return the robot's file, the file within it, and the line where a fragment of text stands first."""
    others = [other for other in texts if other != file]
    for path in [file, *others]:
        line = _line_of(fragment, texts.get(path, ''))
        if line:
            return f'{_path(path, source)}, line {line}'
    return _path(file, source)


def _message(causes: Sequence[BaseException]) -> str:
    """Return xacro's message and the macro that it is about, or the last cause where that says all."""
    if type(causes[-1]).__name__ == 'SubstitutionException':
        return in_one_line(causes[-1])
    if isinstance(causes[-1], OSError):
        return f'{causes[-1].strerror}: {causes[-1].filename}'
    macros: List[xacro.Macro] = [macro for cause in causes for macro in getattr(cause, 'macros', [])]
    names = [macro.body.getAttribute('name') for macro in macros[:1]]
    return ' '.join([in_one_line(causes[0]), *(f'in macro "xacro:{name}"' for name in names)])


def _path(file: str, source: RobotSource) -> str:
    return file if file == str(source.file) else f'{source.file}: {file}'


def _line_of(fragment: Optional[str], text: str) -> Optional[int]:
    at = text.find(fragment) if fragment else -1
    return None if at < 0 else text.count('\n', 0, at) + 1


def _quoted(message: str) -> Optional[str]:
    matches = (pattern.search(message) for pattern in _QUOTED)
    return next((match[1] for match in matches if match), None)


def _clipped(message: str) -> str:
    return message if len(message) <= MOST_CHARACTERS else f'{message[:MOST_CHARACTERS]}...'


def _chain(error: Optional[BaseException]) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = getattr(error, 'exc', None) or error.__cause__
