"""What the numbers of --ticks and --csv are, as reencode's options say it."""

from __future__ import annotations

import argparse
from typing import NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.reencode_encoders import ppr_of_text
from diff_encoder_sim.cli.reencode_robot import RecordedRobot
from diff_encoder_sim.drives.number_units import COUNTED, SPEEDS, TICKS
from diff_encoder_sim.drives.start_angles import DEFAULT_SEED, start_angles_note, start_angles_rad
from diff_encoder_sim.drives.wheel_units import SPEEDS_NOTE, WheelUnit
from diff_encoder_sim.wheels.encoder_params import PerWheel, ppr_label


class WheelNumbers(NamedTuple):
    """How the numbers of both wheels are to be understood."""

    left: WheelUnit
    right: WheelUnit
    ppr: Optional[PerWheel]  # of counts
    about: str  # for the reader
    notes: Tuple[str, ...]  # what the angles cannot show


def wheel_numbers(
    options: argparse.Namespace, robot: RecordedRobot, bits: Tuple[Optional[int], Optional[int]]
) -> WheelNumbers:
    """Collect what options and robot say of the numbers.

    Args:
        options: of the command line.
        robot: of which the ticks per revolution are taken where they are not given, and the wheels' diameter.
        bits: width of the left and the right counter; None where it does not wrap.

    Raises:
        ConfigError: the unit needs a number of ticks per revolution, or has none.
    """
    unit, radius_m = options.unit or TICKS, 0.5 * robot.odometry.wheel_diameter
    ppr, moduli = _ticks_ppr(options, unit, robot), _moduli(options, unit, bits)
    pprs = (ppr.left, ppr.right) if ppr else (None, None)
    seed = DEFAULT_SEED if options.seed is None else options.seed
    left, right = (
        WheelUnit(unit, radius_m, of_side, modulus, side in options.reversed, start_rad)
        for side, of_side, modulus, start_rad in zip(('left', 'right'), pprs, moduli, start_angles_rad(seed))
    )
    notes = (SPEEDS_NOTE, start_angles_note(seed)) if unit in SPEEDS else ()
    return WheelNumbers(left, right, ppr, _about(unit, ppr, moduli, options.reversed), notes)


def _ticks_ppr(options: argparse.Namespace, unit: str, robot: RecordedRobot) -> Optional[PerWheel]:
    """Return the ticks per revolution of counts: as given, else the robot's; None for other units."""
    given = options.ticks_per_revolution
    if unit not in COUNTED:
        if given:
            raise ConfigError(
                f'--ticks-per-revolution: given with --unit {unit}; allowed: with {" and ".join(COUNTED)}'
            )
        return None
    if given:
        return ppr_of_text('--ticks-per-revolution', given)
    if 'ppr' not in robot.sources:
        raise ConfigError('--ticks-per-revolution: missing; expected the ticks of a whole turn of a wheel, or --robot')
    return robot.encoder.ppr


def _moduli(options: argparse.Namespace, unit: str, bits: Sequence[Optional[int]]) -> Tuple[int, ...]:
    """Return after how many counts each counter wraps: as given, else by the width of its field; 0 for never."""
    given = options.ticks_modulus
    if unit != TICKS:
        if given is not None:
            raise ConfigError(f'--ticks-modulus: given with --unit {unit}; allowed: with {TICKS}')
        return (0, 0)
    return tuple((2**width if width else 0) if given is None else given for width in bits)


def _about(unit: str, ppr: Optional[PerWheel], moduli: Sequence[int], is_reversed: Sequence[str]) -> str:
    parts = [unit]
    if ppr is not None:
        parts.append(f'{ppr_label(ppr)} a revolution')
    if any(moduli):
        parts.append(f'the counter wraps at {" and ".join(str(modulus) for modulus in sorted(set(moduli)))}')
    parts.extend(f'{side} reversed' for side in is_reversed)
    return ', '.join(parts)
