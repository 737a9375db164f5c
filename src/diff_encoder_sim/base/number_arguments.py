"""Numbers on the command line, within bounds: types of arguments for argparse."""

from __future__ import annotations

import argparse
from typing import Callable

from diff_encoder_sim.base.bounded_numbers import Between
from diff_encoder_sim.base.plain_numbers import plain_float, plain_int


def number_within(bounds: Between) -> Callable[[str], float]:
    """Return the type of an argument that is a number within bounds."""

    def parse(text: str) -> float:
        try:
            value = plain_float(text)
        except ValueError:
            value = float('nan')
        if not bounds.allows(value):
            raise argparse.ArgumentTypeError(f'given {text!r}; allowed: {bounds}')
        return value

    return parse


def whole_number_within(bounds: Between) -> Callable[[str], int]:
    """Return the type of an argument that is a whole number within bounds."""

    def parse(text: str) -> int:
        try:
            value = plain_int(text)
        except ValueError:
            value = None
        if value is None or not bounds.allows(value):
            raise argparse.ArgumentTypeError(f'given {text!r}; allowed: a whole number, {bounds}')
        return value

    return parse
