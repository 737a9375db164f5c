"""Table 3 for any robot: the motion that one encoder pulse stands for."""

from __future__ import annotations

import math
from typing import List, NamedTuple, Sequence

from diff_encoder_sim.analysis.table import Column, Entry, Number, Table


class PulseResolution(NamedTuple):
    """The motion of the robot per pulse."""

    ppr: float
    linear_m: float  # of the wheel along the floor: d = pi D / PPR
    two_wheel_angle_rad: float  # one pulse of each wheel, in opposite directions: 2 d / L
    one_wheel_angle_rad: float  # one pulse of one wheel alone: d / L


def pulse_resolution(ppr: float, wheel_diameter_m: float, wheel_separation_m: float) -> PulseResolution:
    """Compute the motion per pulse; all arguments > 0."""
    linear_m = math.pi * wheel_diameter_m / ppr
    angle_rad = linear_m / wheel_separation_m
    return PulseResolution(ppr, linear_m, 2.0 * angle_rad, angle_rad)


def pulse_resolution_table(pprs: Sequence[float], wheel_diameter_m: float, wheel_separation_m: float) -> Table:
    """Build table 3: a row for each PPR, in the order given."""
    columns = [
        Column('ppr', 'PPR'),
        Column('linear_mm', 'travel per pulse [mm]'),
        Column('two_wheel_angle_deg', 'rotation, one pulse of both wheels [deg]'),
        Column('one_wheel_angle_deg', 'rotation, one pulse of one wheel [deg]'),
    ]
    rows = [_row(pulse_resolution(ppr, wheel_diameter_m, wheel_separation_m)) for ppr in pprs]
    notes = [
        f'Wheel diameter {wheel_diameter_m:g} m, wheel separation {wheel_separation_m:g} m.',
        'Both wheels: one pulse each, in opposite directions, as in the paper.',
    ]
    return Table('table3', 'Table 3. Resolution of the encoder: robot motion per pulse', columns, rows, notes)


def _row(resolution: PulseResolution) -> List[Entry]:
    return [
        f'{resolution.ppr:g}',
        Number(1e3 * resolution.linear_m, 3),
        Number(math.degrees(resolution.two_wheel_angle_rad), 4),
        Number(math.degrees(resolution.one_wheel_angle_rad), 4),
    ]
