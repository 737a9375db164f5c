"""Errors in what the user or another node provides: one class for configuration, one for data."""

from __future__ import annotations


class ConfigError(ValueError):
    """A user's mistake in a file, parameter or argument, which ends the program.

    The text is one line: where (file and key), what was given and what is allowed.
    """


class InputFault(ValueError):
    """A bad message in a running system, which is dropped; the last good state stays."""


def in_one_line(error: BaseException) -> str:
    """Return the text of a library's error in one line, or its type's name where it has none."""
    return ' '.join(str(error).split()) or type(error).__name__


# `extra` of a log record about something that happens once, such as a restart. Records without it
# may come with every message, and are throttled before they are logged.
EVENT = {'event': True}
