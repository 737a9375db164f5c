"""Says in one line, with file and line number, what is wrong with a xacro."""

from __future__ import annotations

import re
from typing import Iterator, Mapping, Optional, Sequence

import xacro

from diff_encoder_sim.base.errors import in_one_line
from diff_encoder_sim.robots.robot_source import RobotSource

_OLD_TAG = re.compile(r'<(?:property\s[^>]*value|macro\s[^>]*params|include\s[^>]*filename)\s*=')

# Parts of xacro's messages that stand in the file as they are.
_QUOTED = (
    re.compile(r"when evaluating expression '(.+?)'(?: when evaluating|$)"),
    re.compile(r'unknown macro name: (\S+)'),
    re.compile(r'no such file: .*?([^/]+)$'),
    re.compile(r'"([^"]+)"'),
)


def explain(
    error: BaseException, source: RobotSource, texts: Mapping[str, str], declared_arguments: Sequence[str]
) -> str:
    """Return one line on what an expansion raised.

    Args:
        error: what came out of xacro.
        source: the robot.
        texts: the files that were read, by path.
        declared_arguments: names of the arguments that the files declare or use.
    """
    causes = list(_chain(error))
    if any(isinstance(cause, RecursionError) for cause in causes):
        return f'{source.file}: macros, properties or includes refer to each other without end'
    if any(isinstance(cause, MemoryError) for cause in causes):
        return f'{source.file}: needs too much memory to expand'
    message = in_one_line(error)
    argument = re.match(r"Undefined substitution argument '?(\w+)", message)
    if argument:
        declared = ', '.join(name for name in declared_arguments if name != argument[1]) or 'none'
        message = (
            f'argument {argument[1]!r} has no value and no <xacro:arg> with a default; other arguments: {declared}'
        )
    fragment = f'arg {argument[1]}' if argument else _quoted(message)
    file = str(xacro.filestack[-1]) if xacro.filestack else str(source.file)
    return f'{place(file, fragment, source, texts)}: {message}{_old_style_hint(texts)}'


def place(file: str, fragment: Optional[str], source: RobotSource, texts: Mapping[str, str]) -> str:
    """Return the robot's file, the file within it, and the line where a fragment of text stands first."""
    others = [other for other in texts if other != file]
    for path in [file, *others]:
        line = _line_of(fragment, texts.get(path, ''))
        if line:
            return f'{_path(path, source)}, line {line}'
    return _path(file, source)


def _path(file: str, source: RobotSource) -> str:
    return file if file == str(source.file) else f'{source.file}: {file}'


def _line_of(fragment: Optional[str], text: str) -> Optional[int]:
    at = text.find(fragment) if fragment else -1
    return None if at < 0 else text.count('\n', 0, at) + 1


def _quoted(message: str) -> Optional[str]:
    matches = (pattern.search(message) for pattern in _QUOTED)
    return next((match[1] for match in matches if match), None)


def _chain(error: Optional[BaseException]) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = getattr(error, 'exc', None) or error.__cause__


def _old_style_hint(texts: Mapping[str, str]) -> str:
    if any(_OLD_TAG.search(text) for text in texts.values()):
        return '; the file is an old xacro: write <xacro:property>, <xacro:macro>, <xacro:include> with the prefix'
    return ''
