"""What can be wrong with what we are given: one class for set-up, one for data."""

from __future__ import annotations


class ConfigError(ValueError):
    """A user's mistake in a file, parameter or argument; the text is one line for them.

    It says where (file and key), what was given and what is allowed, and ends the program.
    """


class InputFault(ValueError):
    """One bad message in a running system: it is dropped and the last good state stays."""


def in_one_line(error: BaseException) -> str:
    """What an error of a library says, for one of ours; its type's name where it says nothing."""
    return ' '.join(str(error).split()) or type(error).__name__


# `extra` of a log record about something that happens once, such as a restart. Records without it
# may come with every message, and are thinned out on their way to the user.
EVENT = {'event': True}
