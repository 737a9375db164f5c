"""The errors in the source paper itself, to be shown beside its numbers."""

from __future__ import annotations

from typing import List, NamedTuple, Tuple

from diff_encoder_sim.analysis.paper.paper_cells import PaperCell


class Erratum(NamedTuple):
    """One error of the paper."""

    key: str
    where: str
    printed: str
    right: str  # or why the printed text is misleading
    why: str


class AffectedCells(NamedTuple):
    """Cells of tables 4 to 6 that an erratum affects; an empty tuple stands for all."""

    erratum: str  # its key
    tables: Tuple[int, ...]
    test: str
    ppr: str
    statistics: Tuple[str, ...]
    quantities: Tuple[str, ...] = ()


ERRATA: Tuple[Erratum, ...] = (
    Erratum('pulse_length_90', 'table 3, 90 PPR', '7.98 mm a pulse', '6.98 mm', 'pi times 0.2 m divided by 90'),
    Erratum(
        'two_wheel_angle',
        'table 3, angles',
        '4.5 degrees at 40 PPR',
        '4.5 degrees is two wheels, one pulse each in opposite directions; one wheel alone '
        'turns the robot by 2.25 degrees',
        'one pulse of 15.7 mm on a separation of 0.4 m',
    ),
    Erratum(
        'smt_column_twice',
        'tables 5 and 6, SMT at 1024 PPR',
        'the same twelve numbers as at 90 PPR',
        'unknown: the results at 1024 PPR are missing',
        'all twelve agree to the last digit in both tables, and in table 4 none does',
    ),
    Erratum(
        'dld_x_std_90',
        'section III, x spread of /odom in DLD at 90 PPR',
        '0.004 m',
        '0.094 m',
        'table 4 has 0.094, between its neighbours 0.099 and 0.073',
    ),
    Erratum(
        'odom_above_20',
        'section III, odometry within tolerance',
        'none above 20 per cent, at any resolution',
        'true of x in DLD alone',
        'in table 4, y in DLD reaches 43.3 per cent; SL and SMT reach 90 and 100',
    ),
    Erratum(
        'smt_outlier_40',
        'tables 4 to 6, SMT at 40 PPR',
        'a yaw spread of 14.5 to 14.9 degrees',
        "the spread of one trial that ended 80 degrees off; the others' is not printed",
        'one of 30 values that is 80 away from the others alone makes 80 / sqrt(30) = 14.6',
    ),
    Erratum(
        'truth_85_to_100',
        'section III, truth within tolerance',
        '85 to 100 per cent',
        '56.7 to 100 per cent',
        'table 5: y in SMT at 40 PPR; x in SL at 4096 has 80.0',
    ),
    Erratum(
        'heading_below_90',
        'section III, heading within tolerance at 40 and 90 PPR',
        'less than 90 per cent',
        '73.3 to 100 per cent',
        'tables 4 to 6: at 90 PPR no cell is below 90.0, at 40 PPR SL has 93.3 or more',
    ),
    Erratum(
        'amcl_cadence',
        'section III, how often /amcl_pose comes',
        'set by transform_tolerance',
        'set by update_min_d and update_min_a',
        'transform_tolerance dates map->odom ahead; the filter updates by motion',
    ),
)

_AFFECTED: Tuple[AffectedCells, ...] = (
    AffectedCells('smt_column_twice', (5, 6), 'SMT', '1024', ()),
    AffectedCells('smt_outlier_40', (4, 5, 6), 'SMT', '40', ('max', 'std'), ('yaw_deg',)),
)


def errata_of(cell: PaperCell) -> List[str]:
    """Return the keys of the errata that affect a cell of tables 4 to 6."""
    return [
        affected.erratum
        for affected in _AFFECTED
        if cell.table in affected.tables
        and (cell.test, cell.ppr) == (affected.test, affected.ppr)
        and cell.statistic in (affected.statistics or (cell.statistic,))
        and cell.quantity.name in (affected.quantities or (cell.quantity.name,))
    ]
