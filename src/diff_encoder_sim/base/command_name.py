"""How the user calls a command: `rosrun diff_encoder_sim map_bag`, or, installed by pip, `diff-encoder-sim map-bag`."""

from __future__ import annotations

import os
import sys

CONSOLE = 'diff-encoder-sim'


def as_called(name: str) -> str:
    """Return a command's name as it stands in messages: `map_bag`, or `diff-encoder-sim map-bag`."""
    return f'{CONSOLE} {name.replace("_", "-")}' if _is_console() else name


def as_typed(name: str) -> str:
    """Return what the user types for a command before its arguments."""
    return as_called(name) if _is_console() else f'rosrun diff_encoder_sim {name}'


def _is_console() -> bool:
    return os.path.basename(sys.argv[0]) == CONSOLE
