"""Pulses per revolution, and whole pulses at a wheel angle (equation 1)."""

from __future__ import annotations

import math
from typing import Any, Dict, Union

from pydantic import BeforeValidator, Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounded_numbers import PULSES_PER_TURN, PulsesPerTurn, is_number
from diff_encoder_sim.base.typed_params import Params


class PerWheel(Params):
    """One positive number for each wheel."""

    left: PulsesPerTurn = Field(description='of the left wheel')
    right: PulsesPerTurn = Field(description='of the right wheel')

    @property
    def plain(self) -> Union[float, Dict[str, float]]:
        """Return what users write: one number if both wheels have the same, a whole one without a point."""
        left, right = (int(each) if each == int(each) else each for each in (self.left, self.right))
        return left if left == right else {'left': left, 'right': right}


def _same_for_both(value: Any) -> Any:
    if isinstance(value, (dict, PerWheel)):
        return value
    if not (is_number(value) and PULSES_PER_TURN.allows(value)):
        raise ValueError(f'{PULSES_PER_TURN}, or {{left: ..., right: ...}}')
    return {'left': value, 'right': value}


PulsesPerRevolution = Annotated[
    PerWheel, BeforeValidator(_same_for_both), Field(description='pulses per wheel revolution')
]
DEFAULT_PPR = PerWheel(left=90, right=90)


def ppr_label(ppr: PerWheel) -> str:
    """Format as 90 where both wheels have 90, else as 40-90 for left and right."""
    left, right = f'{ppr.left:g}', f'{ppr.right:g}'
    return left if left == right else f'{left}-{right}'


def encoder_label(ppr: PerWheel, name: str) -> str:
    """Format a real encoder as `8192 amt102`, its counts per wheel revolution first; an ideal one has no name."""
    return f'{ppr_label(ppr)} {name}' if name else ppr_label(ppr)


def file_label(ppr: PerWheel, name: str) -> str:
    """Format an encoder for names of files: `90ppr`, or `8192_amt102`."""
    return encoder_label(ppr, name).replace(' ', '_') if name else f'{ppr_label(ppr)}ppr'


def pulses_from_angle(angle_rad: float, ppr: float) -> int:
    """Return the whole pulses at a wheel angle, equation (1): floor, so -0.1 pulse is -1."""
    return math.floor(angle_rad * ppr / (2.0 * math.pi))
