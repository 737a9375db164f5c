"""Numbers on the command line, within bounds: types of arguments for argparse."""

from __future__ import annotations

import argparse
import re
from typing import Callable

from diff_encoder_sim.base.bounded_numbers import Between


def number_within(bounds: Between) -> Callable[[str], float]:
    """Return the type of an argument that is a number within bounds."""

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = float('nan')
        if not bounds.allows(value):
            raise argparse.ArgumentTypeError(f'given {text!r}; allowed: {bounds}')
        return value

    return parse


def whole_number_within(bounds: Between) -> Callable[[str], int]:
    """Return the type of an argument that is a whole number within bounds."""

    def parse(text: str) -> int:
        if not (re.fullmatch('-?[0-9]{1,30}', text, re.ASCII) and bounds.allows(int(text))):
            raise argparse.ArgumentTypeError(f'given {text!r}; allowed: a whole number, {bounds}')
        return int(text)

    return parse
