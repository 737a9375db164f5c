"""Errors in input of the user or of other nodes: configuration errors and data errors."""

from __future__ import annotations

import re

# Maximum length of a path or value in an error.
LONGEST_WORD, LONGEST_LINE = 300, 3000


class ConfigError(ValueError):
    """A user's mistake in a file, parameter or argument, which ends the program.

    The text is one line: file and key, given value and allowed values.
    """

    def __init__(self, text: str) -> None:
        super().__init__(readable(text))


class MissingLibrary(ConfigError):
    """A library is not installed that only some commands or options need; the text is one line."""


class CampaignFault(Exception):
    """A campaign cannot continue; the text is one line. Finished trials are kept."""


class InputFault(ValueError):
    """A bad message in a running system, which is dropped; the last good state is kept."""


def in_one_line(error: BaseException) -> str:
    """Return the text of a library's error in one line, or its type's name if it is empty."""
    return ' '.join(str(error).split()) or type(error).__name__


# `extra` of log records about single events, such as a restart. Records without it may repeat
# with every message, and are throttled.
EVENT = {'event': True}


def readable(text: str) -> str:
    """Return a text in one line of limited length."""
    text = ''.join(each if each.isprintable() else repr(each)[1:-1] for each in _without_middle(text, LONGEST_LINE))
    return re.sub(rf'\S{{{LONGEST_WORD},}}', lambda word: _without_middle(word[0], LONGEST_WORD), text)


def _without_middle(text: str, longest: int) -> str:
    half = longest // 2
    return text if len(text) <= longest else f'{text[:half]}...{text[-half:]}'
