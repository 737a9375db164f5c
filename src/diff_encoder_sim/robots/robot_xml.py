"""Reads the XML of robots that others wrote: forgiving in form, bounded in size."""

from __future__ import annotations

import codecs
import re
from pathlib import Path
from typing import Dict, List, Union
from xml.etree import ElementTree
from xml.parsers import expat

from diff_encoder_sim.base.errors import ConfigError

MOST_BYTES = 20_000_000
MOST_ELEMENTS = 200_000
MOST_LEVELS = 100

_DECLARATION = re.compile(r'<\?xml\s.*?\?>', re.DOTALL)
_ENCODING = re.compile(rb'<\?xml\s[^>]*encoding\s*=\s*["\']([\w.-]+)')


def read_robot_text(path: Union[str, Path]) -> str:
    """Return the text of an XML file without its declaration, lines where they were.

    A byte order mark, blank lines or comments before the declaration do no harm then, nor do stray bytes in a comment.

    Raises:
        ConfigError: the file is missing, too big, or not text.
    """
    text = _decoded(_content(Path(path)), path).lstrip('\ufeff')
    return _DECLARATION.sub(lambda declaration: '\n' * declaration.group().count('\n'), text, count=1)


def parse_robot_xml(text: str, where: Union[str, Path]) -> ElementTree.Element:
    """Return the root element; prefixes of tags are dropped, declared or not, as URDF has one vocabulary.

    Raises:
        ConfigError: the text is not XML, declares entities, or is too big.
    """
    builder = _BoundedBuilder(where)
    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.EntityDeclHandler = builder.refuse_entity
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.tree.data
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise ConfigError(f'{where}, line {error.lineno}: not well-formed XML: {reason}') from None
    except UnicodeEncodeError:
        raise ConfigError(f'{where}: not well-formed XML: a character that no text has') from None
    root = builder.tree.close()
    assert isinstance(root, ElementTree.Element)
    return root


class _BoundedBuilder:
    """Builds the tree of elements, of bounded depth and number."""

    def __init__(self, where: Union[str, Path]) -> None:
        self.tree = ElementTree.TreeBuilder()
        self._where = where
        self._open: List[str] = []
        self._elements = 0

    def start(self, tag: str, attributes: Dict[str, str]) -> None:
        self._elements += 1
        if len(self._open) >= MOST_LEVELS or self._elements > MOST_ELEMENTS:
            raise ConfigError(
                f'{self._where}: <{tag}>: too much XML; allowed: {MOST_ELEMENTS} elements, nested {MOST_LEVELS} deep'
            )
        self._open.append(tag.rpartition(':')[2])
        self.tree.start(self._open[-1], attributes)

    def end(self, _tag: str) -> None:
        self.tree.end(self._open.pop())

    def refuse_entity(self, name: str, *_declaration: object) -> None:
        raise ConfigError(f'{self._where}: declares the XML entity {name!r}; allowed: no entities')


def _content(path: Path) -> bytes:
    if path.is_dir():
        raise ConfigError(f'{path}: a folder; allowed: a .xacro or .urdf file')
    if not path.is_file():
        raise ConfigError(f'{path}: no such robot file; allowed: a .xacro or .urdf file')
    try:
        with path.open('rb') as file:
            content = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise ConfigError(f'{path}: cannot be read: {error.strerror}') from None
    if len(content) > MOST_BYTES:
        raise ConfigError(f'{path}: too big; allowed: at most {MOST_BYTES // 10**6} MB')
    return content


def _decoded(content: bytes, path: Union[str, Path]) -> str:
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode('utf-16', errors='replace')
    if b'\0' in content:
        raise ConfigError(f'{path}: a binary file; allowed: a xacro or URDF file')
    declared = _ENCODING.search(content, 0, 1000)
    name = declared[1].decode() if declared else 'utf-8'
    try:
        return content.decode(name, errors='replace')
    except (LookupError, UnicodeError):  # unknown, or of Python's own kinds, such as idna
        raise ConfigError(f'{path}: encoding: given {name!r}; allowed: utf-8, iso-8859-1 and the like') from None
