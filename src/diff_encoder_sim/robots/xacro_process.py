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
from typing import Any, Dict, List, Optional

import xacro

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.old_xacro import NOTE, prefix_call, prefix_tags
from diff_encoder_sim.robots.package_search import find_package
from diff_encoder_sim.robots.robot_source import RobotSource
from diff_encoder_sim.robots.robot_xml import parse_robot_xml, read_robot_text
from diff_encoder_sim.robots.xacro_faults import explain, place

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
