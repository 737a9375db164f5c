"""Where the wheels stand when a drive begins, if its source knows only how they turn from there."""

from __future__ import annotations

import math
from typing import Tuple

from diff_encoder_sim.base.seeds import generator

DEFAULT_SEED = 1


def start_angles_rad(seed: int) -> Tuple[float, float]:
    """Draw the angles of the left and the right wheel, each anywhere in a turn.

    Were both 0, the encoders would step together: on a straight drive their errors would cancel.
    """
    left_rad, right_rad = generator(seed, 'wheel_phase').uniform(0.0, 2.0 * math.pi, 2).tolist()
    return left_rad, right_rad


def start_angles_note(seed: int) -> str:
    """Say where the angles at the start are from."""
    return (
        f'where the wheels stood at the start is not known: drawn by --seed {seed}; with another seed, each encoder '
        f'rounds elsewhere, and its path ends elsewhere'
    )
