"""Texts among parameters: lines of printable characters, and paths that can name a file."""

from __future__ import annotations

from pydantic import AfterValidator
from typing_extensions import Annotated

LONGEST_PATH, LONGEST_NAME = 4095, 255  # Linux's, in bytes


def _can_be_a_file(path: str) -> str:
    names = path.encode('utf-8', 'surrogatepass').split(b'/')
    if len(b'/'.join(names)) > LONGEST_PATH or max(map(len, names)) > LONGEST_NAME or '\0' in path:
        raise ValueError(f'a file name, or a path of at most {LONGEST_PATH} bytes with names of at most {LONGEST_NAME}')
    return path


PathText = Annotated[str, AfterValidator(_can_be_a_file)]


def _is_printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError('printable characters')
    return text


Line = Annotated[str, AfterValidator(_is_printable)]
PathLine = Annotated[PathText, AfterValidator(_is_printable)]
