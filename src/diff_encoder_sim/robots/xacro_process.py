"""Expands one xacro in a process of its own, which xacro_expansion starts: whatever a file does ends there.

Reads a request (JSON) from stdin, writes an answer (JSON) to stdout. Here three functions of xacro are replaced: how it
reads a file (ours is bounded, without entities, forgiving in form), what $(find) means (xacro's asks ROS), and what
calls a macro (old xacros do so without prefix).
"""

from __future__ import annotations

import json
import os
import re
import resource
import sys
import xml.dom.expatbuilder
import xml.dom.minidom
from pathlib import Path
from typing import Any, Container, Dict, Iterator, List, Mapping, Optional, Sequence

import xacro

from diff_encoder_sim.base.errors import ConfigError, in_one_line
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.package_search import find_package, missing_package
from diff_encoder_sim.robots.urdf_reading import parse_robot_xml, read_robot_text

NOTE = 'an old xacro: tags without the prefix xacro: are taken as with it'

# Tags of xacro by the attribute that distinguishes them from others of the same name.
_TAGS = {
    'arg': 'default',
    'if': 'value',
    'include': 'filename',
    'insert_block': 'name',
    'macro': 'name',
    'property': 'name',
    'unless': 'value',
}

# What a macro may be named after, and is not a call of it where it stands alone.
_URDF_TAGS = frozenset(
    ['robot', 'link', 'joint', 'gazebo', 'transmission', 'material', 'ros2_control', 'sensor']
    + ['inertial', 'visual', 'collision', 'contact', 'origin', 'mass', 'inertia', 'geometry']
    + ['box', 'cylinder', 'sphere', 'mesh', 'color', 'texture', 'camera', 'ray', 'lidar', 'imu']
    + ['parent', 'child', 'axis', 'limit', 'dynamics', 'mimic', 'calibration', 'safety_controller']
)
_PLACES = frozenset(['robot', 'link', 'joint', 'visual', 'collision', 'xacro:macro', 'xacro:if', 'xacro:unless'])


def prefix_tags(document: xml.dom.minidom.Document) -> bool:
    """Give xacro's own tags in a document their prefix; return whether one had none."""
    found = False
    for element in document.getElementsByTagName('*'):
        key = _TAGS.get(element.tagName)
        if key and element.hasAttribute(key):
            _prefix(element)
            found = True
    return found


def prefix_call(element: xml.dom.minidom.Element, macros: Container[str]) -> bool:
    """Give a call of a macro its prefix; return whether it had none."""
    tag, parent = element.tagName, element.parentNode
    is_call = ':' not in tag and tag not in _URDF_TAGS and tag in macros
    if not is_call or parent is None or parent.nodeName not in _PLACES:
        return False
    _prefix(element)
    return True


def _prefix(element: xml.dom.minidom.Element) -> None:
    element.tagName = element.nodeName = f'xacro:{element.tagName}'


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


MOST_CPU_S = 10
MOST_MEMORY_BYTES = 2**29  # of addresses: 10,000 links take a fifth

_MACRO = re.compile(r'<(?:xacro:)?macro\s[^>]*?name\s*=\s*["\']([^"\']+)')
_ASKED = re.compile(r'<xacro:arg\s[^>]*?name\s*=\s*["\']([^"\']+)|\$\(\s*arg\s+([^\s)]+)|xacro\.arg\(\s*["\'](\w+)')


def main() -> None:
    """Answer the request on stdin."""
    _lower_limit(resource.RLIMIT_CPU, MOST_CPU_S)
    _lower_limit(resource.RLIMIT_AS, MOST_MEMORY_BYTES)
    request = json.load(sys.stdin)
    answer_to, sys.stdout = sys.stdout, sys.stderr  # nothing that xacro prints may get into the answer
    opened = OpenedFiles()
    sys.addaudithook(opened.note)
    folders = tuple(map(Path, request['package_folders']))
    source = RobotSource(Path(request['file']), tuple(map(tuple, request['arguments'])), folders)
    answer = Expander(source).answer()
    json.dump({**answer, 'opened': opened.paths}, answer_to)


def _lower_limit(kind: int, most: int) -> None:
    """Limit what this process uses, unless the limit of whoever started it is lower."""
    limits = (most, *(each for each in resource.getrlimit(kind) if each != resource.RLIM_INFINITY))
    resource.setrlimit(kind, (min(limits), min(limits)))


class OpenedFiles:
    """Notes which files an expansion depends on, be they there or not; None when they cannot be named."""

    def __init__(self) -> None:
        self.paths: Optional[List[str]] = []

    def note(self, event: str, arguments: Any) -> None:
        """Take one of Python's audit events."""
        if event == 'glob.glob':
            self.paths = None
        elif event == 'open' and self.paths is not None and isinstance(arguments[0], str):
            path = os.path.abspath(arguments[0])
            if path not in self.paths and not path.endswith(('.py', '.pyc', 'package.xml')):
                self.paths.append(path)


class Expander:
    """Expands one robot."""

    def __init__(self, source: RobotSource) -> None:
        self._source = source
        self._texts: Dict[str, str] = {}  # of the files that were read, by path
        self._environment: Dict[str, Optional[str]] = {}
        self._notes: List[str] = []
        self._parse_as_xacro, self._substitute_as_xacro = xacro.parse, xacro.eval_extension
        self._call_as_xacro = xacro.handle_macro_call

    def answer(self) -> Dict[str, Any]:
        """Return the URDF or one line on what is wrong, and what it depends on."""
        answer: Dict[str, Any] = {}
        xacro.parse, xacro.eval_extension, xacro.handle_macro_call = self._parse, self._substitute, self._call
        try:
            document = xacro.process_file(str(self._source.file), mappings=dict(self._source.arguments))
            self._check_for_links(document)
            # Not the whole document: xacro's banner has the file's path in it.
            answer['urdf'] = '<?xml version="1.0"?>\n' + document.documentElement.toprettyxml(indent='  ')
        except ConfigError as error:
            answer['fault'] = str(error)
        except Exception as error:  # a xacro is a program: it may raise whatever Python can
            answer['fault'] = explain(error, self._source, self._texts, self._declared())
        finally:
            xacro.parse, xacro.eval_extension = self._parse_as_xacro, self._substitute_as_xacro
            xacro.handle_macro_call = self._call_as_xacro
        return {**answer, 'notes': self._notes, 'environment': self._environment, 'declared': self._declared()}

    def _check_for_links(self, document: xml.dom.minidom.Document) -> None:
        macros = _MACRO.findall(self._texts[str(self._source.file)])
        if macros and not document.getElementsByTagName('link'):
            raise ConfigError(
                f'{self._source.file}: no link: the file defines {", ".join(macros[:5])}, but uses no macro that makes '
                'one; allowed: the xacro of the whole robot, which includes this one'
            )

    def _declared(self) -> List[str]:
        """Return the names of the arguments that the files declare or use."""
        names = (name for text in self._texts.values() for match in _ASKED.findall(text) for name in match if name)
        return list(dict.fromkeys(names))

    def _parse(self, given: Any, filename: Optional[str] = None) -> Any:
        """Do what xacro.parse does."""
        if given is not None or filename is None:
            return given
        including = [str(file) for file in xacro.filestack[:-1]]
        if os.path.realpath(filename) in map(os.path.realpath, including):
            raise ConfigError(f'{place(including[-1], filename, self._source, self._texts)}: files include each other')
        if including and not os.path.exists(filename):
            return self._parse_as_xacro(None, filename)  # which knows what an optional file is
        try:
            text = self._texts[filename] = read_robot_text(filename)
            parse_robot_xml(text, filename)
        except ConfigError as error:
            raise ConfigError(f'{self._source.file}: {error}' if including else str(error)) from None
        document = xml.dom.expatbuilder.parseString(text, namespaces=False)
        if prefix_tags(document):
            self._note(NOTE)
        return document

    def _call(self, node: Any, macros: Any, symbols: Any) -> Any:
        """Do what xacro.handle_macro_call does."""
        if prefix_call(node, macros):
            self._note(NOTE)
        return self._call_as_xacro(node, macros, symbols)

    def _substitute(self, text: str) -> str:
        """Do what xacro.eval_extension does: resolve '$(...)', packages by our own search."""
        words = text[2:-1].split()
        if len(words) == 2 and words[0] == 'find':
            return self._found(words[1])
        if len(words) >= 2 and words[0] in ('env', 'optenv'):
            self._environment[words[1]] = os.environ.get(words[1])
        return str(self._substitute_as_xacro(text))

    def _found(self, name: str) -> str:
        folder = find_package(name, self._source)
        if folder is not None:
            return str(folder)
        self._note(f'package {name!r} is not found; $(find {name}) became package://{name}')
        return f'package://{name}'

    def _note(self, note: str) -> None:
        if note not in self._notes:
            self._notes.append(note)
