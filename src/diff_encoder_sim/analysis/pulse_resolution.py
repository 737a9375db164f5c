"""Table 3 for any robot: what one pulse of an encoder is worth on the floor."""

from __future__ import annotations

import math
from typing import Dict, List, NamedTuple, Optional, Sequence


class PulseAccuracy(NamedTuple):
    """What one pulse moves the robot by."""

    ppr: float
    linear_m: float  # of the wheel along the floor: pi D / PPR
    two_wheel_angle_rad: float  # one pulse of each wheel, in opposite directions: 2 d / L
    one_wheel_angle_rad: float  # one pulse of one wheel alone: d / L


class PrintedAccuracy(NamedTuple):
    """A row of the paper's table 3, as printed."""

    ppr: int
    linear_m: float
    angle_rad: float


class Table3Row(NamedTuple):
    """A resolution: computed for this robot, and what the paper prints for ALTO."""

    computed: PulseAccuracy
    printed: Optional[PrintedAccuracy]  # None for a PPR that the paper does not have


# The 90 PPR row is wrong in print: see paper_errata.
PRINTED = tuple(
    PrintedAccuracy(ppr, millimetres * 1e-3, math.radians(degrees))
    for ppr, millimetres, degrees in ((40, 15.7, 4.5), (90, 7.98, 2.0), (1024, 0.61, 0.18), (4096, 0.15, 0.045))
)


def pulse_accuracy(ppr: float, wheel_diameter_m: float, wheel_separation_m: float) -> PulseAccuracy:
    """What one pulse is worth; all arguments > 0."""
    linear_m = math.pi * wheel_diameter_m / ppr
    angle_rad = linear_m / wheel_separation_m
    return PulseAccuracy(ppr, linear_m, 2.0 * angle_rad, angle_rad)


def table_3(pprs: Sequence[float], wheel_diameter_m: float, wheel_separation_m: float) -> List[Table3Row]:
    """A row for each resolution, in the order given."""
    printed: Dict[float, PrintedAccuracy] = {row.ppr: row for row in PRINTED}
    return [Table3Row(pulse_accuracy(ppr, wheel_diameter_m, wheel_separation_m), printed.get(ppr)) for ppr in pprs]
