"""Keyword arguments as the options of a command line, so that functions and commands take and check the same."""

from __future__ import annotations

import argparse
import contextlib
import io
from typing import Any, Callable, List, Mapping, Sequence

from diff_encoder_sim.base.errors import ConfigError


def command_line(options: Mapping[str, Any]) -> List[str]:
    """Return the options as words: `{'ppr': [40, 90], 'unchecked': True}` is `--ppr 40 90 --unchecked`.

    What is None or False is left out.
    """
    words = []
    for name, value in options.items():
        if value is None or value is False:
            continue
        words.append(f'--{name.replace("_", "-")}')
        if isinstance(value, (list, tuple)):
            words += map(str, value)
        elif value is not True:
            words.append(str(value))
    return words


def parsed(parse: Callable[[Sequence[str]], argparse.Namespace], words: Sequence[str]) -> argparse.Namespace:
    """Parse words by a command's parser.

    Raises:
        ConfigError: an option is unknown, or its value is not allowed.
    """
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said):
            return parse(words)
    except SystemExit:
        raise ConfigError(said.getvalue().rpartition('error: ')[2].strip()) from None
