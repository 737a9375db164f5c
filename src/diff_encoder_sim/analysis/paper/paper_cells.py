"""The paper's tables 3 to 6 and its errata as data, and which trials they are about."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Tuple, Union

import numpy as np

from diff_encoder_sim.analysis.quantities import QUANTITIES, Quantity
from diff_encoder_sim.analysis.results_table import Results, RobotGeometry
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.trial_definition import Trial

TRIALS = 30  # behind each cell
PPRS = ('40', '90', '1024', '4096')
STATISTICS = ('min', 'max', 'std', 'pct_within')

# The names in the file.
_POSES = {'odom': 'odom', 'world_pose': 'world', 'global_pose': 'global'}
_QUANTITIES = {quantity.name: quantity for quantity in QUANTITIES}


class PaperCell(NamedTuple):
    """One number of the paper's tables."""

    table: int
    source: str  # final pose, of quantities.POSES
    test: str
    ppr: str  # encoder label
    quantity: Quantity
    statistic: str  # of STATISTICS
    value: float  # [m], [deg] or per cent


def load_paper_cells(path: Optional[Union[str, Path]] = None) -> List[PaperCell]:
    """Load the cells in the file's order from config/paper/tables_4_5_6.csv, unless another file is given.

    Raises:
        ConfigError: the file cannot be read, or a line of it is bad.
    """
    path = Path(path or package_folder() / 'config' / 'paper' / 'tables_4_5_6.csv')
    try:
        with path.open(newline='', encoding='utf-8') as file:
            return [
                PaperCell(
                    int(row['table']),
                    _POSES[row['source']],
                    row['test'],
                    row['ppr'],
                    _QUANTITIES[row['quantity']],
                    row['statistic'],
                    float(row['value']),
                )
                for row in csv.DictReader(file)
            ]
    except OSError as error:
        raise ConfigError(f'{path}: cannot be read: {error.strerror}') from None
    except (KeyError, ValueError, TypeError) as error:
        raise ConfigError(f'{path}: {error}; allowed: lines as in {path.parent / "README.md"}') from None


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


# ALTO, by section 3 of the paper: its wheels, and its length and width [m].
WHEELS = RobotGeometry(0.2, 0.4)
OUTLINE_M = (0.5, 0.6)

# Numbers that differ less are the same robot, with calibrated wheels.
RELATIVE = 0.01


def of_paper(results: Results) -> Results:
    """Return only the trials that the paper's numbers are about.

    A robot is the paper's by its wheels, and by its outline if a campaign has it; a test by all of its definition
    and by being navigated.
    """
    is_alto = _are_close(results.robot, WHEELS) and _are_close(_outline_m(results.manifest), OUTLINE_M)
    tests = {test for test, requested in results.requested.items() if is_alto and _is_of_paper(requested)}
    return results._replace(trials=results.trials[results.trials['test'].isin(tests)])


def _is_of_paper(requested: Trial) -> bool:
    try:
        return requested.nav != 'scripted' and requested.test == load_test(
            requested.test.name, package_folder() / 'config'
        )
    except ConfigError:  # a test that the package does not have
        return False


def _outline_m(manifest: Dict[str, Any]) -> Optional[Tuple[float, float]]:
    """Return length and width of the footprint that a campaign's robot was navigated with; None where it tells none."""
    try:
        corners = manifest['configuration']['parameters'][0]['navigator']['local_costmap']['footprint']
        length_m, width_m = np.ptp(np.asarray(corners, float), axis=0)
    except (KeyError, IndexError, TypeError, ValueError):
        return None
    return float(length_m), float(width_m)


def _are_close(given: Optional[Tuple[float, float]], expected: Tuple[float, float]) -> bool:
    return given is None or all(math.isclose(*pair, rel_tol=RELATIVE) for pair in zip(given, expected))


# Table 3 as printed: travel per pulse [mm], and rotation [deg] of one pulse of both wheels in opposite directions, by
# PPR. The travel at 90 PPR is an erratum.
PRINTED_RESOLUTIONS: Dict[float, Tuple[float, float]] = {
    40: (15.7, 4.5),
    90: (7.98, 2.0),
    1024: (0.61, 0.18),
    4096: (0.15, 0.045),
}
