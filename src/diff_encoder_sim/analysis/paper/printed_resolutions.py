"""The paper's table 3 as data, beside the resolutions computed for a robot."""

from __future__ import annotations

import math
from typing import Dict, List, NamedTuple, Optional, Sequence

from diff_encoder_sim.analysis.pulse_resolution import PulseResolution, pulse_resolution


class PrintedResolution(NamedTuple):
    """A row of the paper's table 3, as printed."""

    ppr: int
    linear_m: float
    angle_rad: float  # one pulse of both wheels, in opposite directions


class ComparedResolution(NamedTuple):
    """The resolution computed for this robot, and the paper's for ALTO."""

    computed: PulseResolution
    printed: Optional[PrintedResolution]  # None for a PPR that the paper does not have


# The 90 PPR row is wrong in print: see errata.
PRINTED = tuple(
    PrintedResolution(ppr, millimetres * 1e-3, math.radians(degrees))
    for ppr, millimetres, degrees in ((40, 15.7, 4.5), (90, 7.98, 2.0), (1024, 0.61, 0.18), (4096, 0.15, 0.045))
)


def compare_resolutions(
    pprs: Sequence[float], wheel_diameter_m: float, wheel_separation_m: float
) -> List[ComparedResolution]:
    """Compare each PPR with the paper's table 3, in the order given."""
    printed: Dict[float, PrintedResolution] = {row.ppr: row for row in PRINTED}
    return [
        ComparedResolution(pulse_resolution(ppr, wheel_diameter_m, wheel_separation_m), printed.get(ppr))
        for ppr in pprs
    ]
