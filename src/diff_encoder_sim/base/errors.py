"""Errors in what the user or another node provides: one class for configuration, one for data."""

from __future__ import annotations

import re

# Of a path or value that an error shows.
LONGEST_WORD, LONGEST_LINE = 300, 3000


class ConfigError(ValueError):
    """A user's mistake in a file, parameter or argument, which ends the program.

    The text is one line: where (file and key), what was given and what is allowed.
    """

    def __init__(self, text: str) -> None:
        super().__init__(readable(text))


class CampaignFault(Exception):
    """Why a campaign cannot continue, in one line. Finished trials are kept."""


class InputFault(ValueError):
    """A bad message in a running system, which is dropped; the last good state stays."""


def in_one_line(error: BaseException) -> str:
    """Return the text of a library's error in one line, or its type's name where it has none."""
    return ' '.join(str(error).split()) or type(error).__name__


# `extra` of a log record about something that happens once, such as a restart. Records without it
# may come with every message, and are throttled before they are logged.
EVENT = {'event': True}


def readable(text: str) -> str:
    """Return a text in one line of a readable length, whatever a user has given."""
    text = ''.join(each if each.isprintable() else repr(each)[1:-1] for each in _without_middle(text, LONGEST_LINE))
    return re.sub(rf'\S{{{LONGEST_WORD},}}', lambda word: _without_middle(word[0], LONGEST_WORD), text)


def _without_middle(text: str, longest: int) -> str:
    half = longest // 2
    return text if len(text) <= longest else f'{text[:half]}...{text[-half:]}'
