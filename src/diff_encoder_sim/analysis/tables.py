"""Table 3, errors along the path, the cost of variants, and the list of all tables that are written to files."""

from __future__ import annotations

import math
from typing import List, NamedTuple, Optional, Sequence

import numpy as np

from diff_encoder_sim.analysis.dataset import CellKey, Dataset
from diff_encoder_sim.analysis.encoder_labels import ppr_text, ppr_values
from diff_encoder_sim.analysis.final_errors import with_final_error
from diff_encoder_sim.analysis.goal_tables import GOAL_TABLES, goal_table, interval_table
from diff_encoder_sim.analysis.quantities import LEVEL
from diff_encoder_sim.analysis.statistics import PairedResult, mean_interval, spread
from diff_encoder_sim.analysis.table import Column, Entry, Label, Number, Table
from diff_encoder_sim.analysis.table_keys import key_columns, key_entries, varied_keys
from diff_encoder_sim.analysis.variant_errors import (
    KINDS,
    VARIANTS,
    ErrorKind,
    VariantError,
    first_variant,
    variant_errors,
)
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE
from diff_encoder_sim.drives.trajectory_error import RPE_DISTANCES_M, PathError, RelativeError, RpePairs, rpe_name


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


DECIMALS_M, DECIMALS_DEG = 4, 3

_WHOLE = 'whole path'
_RPE = [(pairs, distance_m) for distance_m in RPE_DISTANCES_M for pairs in RpePairs]


_ATE_NOTE = (
    "ATE: distance from the true pose, /odom's with its first pose aligned to the true one, the others' without "
    f"alignment; mean of the trials' RMSE with its {100 * LEVEL:g} % interval (t-distribution) and standard deviation, "
    'and the largest distance in any trial. inf: too few trials for a bound.'
)
_RPE_NOTE = (
    'RPE: error of the motion over segments of the true path; mean of the RMSE of the trials whose path is so long, '
    'and how many segments they have together. Consecutive segments lie end to end; of all pairs, one begins at each '
    'pose.'
)


def path_error_table(dataset: Dataset) -> Optional[Table]:
    """Build a row for each cell and source over its trials; None for a dataset without paths."""
    keys = varied_keys(dataset)
    rows: List[List[Entry]] = []
    for cell, trials in dataset.cells().items():
        for source, topic in TOPIC_OF_SOURCE.items():
            paths = [path for path in (trial.paths.get(source) for trial in with_final_error(trials, source)) if path]
            if paths:
                entries: List[Entry] = [
                    *key_entries(cell.test, cell.varied, keys),
                    cell.ppr,
                    Label(source.value, topic),
                ]
                rows.append([*entries, *_numbers(paths)])
    if not rows:
        return None
    columns = [*key_columns(keys), *_columns()]
    return Table('path_errors', 'Errors over the whole path', columns, rows, [_ATE_NOTE, _RPE_NOTE])


def _columns() -> List[Column]:
    columns = [
        Column('ppr', 'PPR'),
        Column('source', 'source'),
        Column('trials', 'trials'),
        Column('ate_rmse_mean_m', 'ATE RMSE [m]', _WHOLE),
        Column('ate_rmse_low_m', 'from', _WHOLE),
        Column('ate_rmse_high_m', 'to', _WHOLE),
        Column('ate_rmse_std_m', 'std. dev.', _WHOLE),
        Column('ate_max_m', 'ATE max [m]', _WHOLE),
        Column('yaw_rmse_mean_deg', 'yaw RMSE [deg]', _WHOLE),
    ]
    return columns + [column for pairs, distance_m in _RPE for column in _rpe_columns(pairs, distance_m)]


def _rpe_columns(pairs: RpePairs, distance_m: float) -> List[Column]:
    name, group = rpe_name(pairs, distance_m), f'RPE over {distance_m:g} m, {pairs.text}'
    return [
        Column(f'{name}_segments', 'segments', group),
        Column(f'{name}_translation_rmse_mean_m', 'translation [m]', group),
        Column(f'{name}_rotation_rmse_mean_deg', 'rotation [deg]', group),
    ]


def _numbers(paths: Sequence[PathError]) -> List[Entry]:
    """Return an entry for each of `_columns` from the number of trials on."""
    ate_m = np.array([path.ate_rmse_m for path in paths])
    in_metres = [
        _mean(ate_m.tolist()),
        *mean_interval(ate_m, LEVEL),
        spread(ate_m),
        max(path.ate_max_m for path in paths),
    ]
    numbers: List[Entry] = [
        Number(len(paths), 0),
        *(Number(value, DECIMALS_M) for value in in_metres),
        Number(_mean([math.degrees(path.yaw_rmse_rad) for path in paths]), DECIMALS_DEG),
    ]
    for pairs, distance_m in _RPE:
        numbers += _relative_numbers([path.rpe[pairs][distance_m] for path in paths])
    return numbers


def _relative_numbers(errors: Sequence[RelativeError]) -> List[Entry]:
    known = [error for error in errors if error.segments]
    return [
        Number(sum(error.segments for error in known), 0),
        Number(_mean([error.translation_rmse_m for error in known]), DECIMALS_M),
        Number(_mean([math.degrees(error.rotation_rmse_rad) for error in known]), DECIMALS_DEG),
    ]


def _mean(values: Sequence[float]) -> Optional[float]:
    return float(np.mean(values)) if values else None


_HEADS = ('median', 'quartiles', 'ratio', '95 %', 'failed')


def variant_table(dataset: Dataset) -> Optional[Table]:
    """Build rows of test, variant and kind of error, columns by encoder; None where there are no variants."""
    errors = {kind: variant_errors(dataset, kind) for kind in KINDS}
    if not any(errors.values()):
        return None
    keys, labels = varied_keys(dataset), dataset.encoders()
    rows: List[List[Entry]] = [
        [
            *key_entries(test, varied, keys),
            Label(kind.name, kind.head),
            *(entry for label in labels for entry in _entries(kind, of_kind.get(CellKey(test, label, varied)))),
        ]
        for test, varied in dataset.setups()
        for kind, of_kind in errors.items()
    ]
    groups = [
        Column(f'ppr{label}_{head}'.replace(' ', '_'), head, ppr_text(label)) for label in labels for head in _HEADS
    ]
    columns = [*key_columns(keys), Column('error', 'error'), *groups]
    title = "Variants: the odometry's own final error, /odom minus /world_pose"
    return Table(VARIANTS, title, columns, rows, _notes(dataset))


def _notes(dataset: Dataset) -> List[str]:
    counted = 'All trials that ended with a pose count, where they ended; failed: how many did not succeed.'
    first = f'Ratio: of the errors to those of equal trials of the variant {first_variant(dataset.cells())!r}'
    return [
        f'Distance in position, and angle of heading: median, and difference of the quartiles. {counted}',
        f"{first}, by the signed ranks of its logarithm, with the comparison's own 95 % interval (from six trials on).",
    ]


def _entries(kind: ErrorKind, error: Optional[VariantError]) -> List[Entry]:
    """Return an entry for each of `_HEADS`."""
    if error is None:
        return [*[Number(None, 0)] * 3, '', Number(None, 0)]
    spread = Number(error.high - error.low, kind.decimals)
    return [Number(error.median, kind.decimals), spread, *_ratio_entries(error.ratio), Number(error.failed, 0)]


def _ratio_entries(ratio: Optional[PairedResult]) -> List[Entry]:
    if ratio is None:
        return [Number(None, 2), '']
    low, high = ratio.interval
    return [Number(ratio.estimate, 2), f'{low:.3g} to {high:.3g}' if math.isfinite(high) else '']


def all_tables(dataset: Dataset) -> List[Table]:
    """Build tables 3 to 6 of a dataset, the intervals of 4 to 6, and errors along the path and of variants if known."""
    tables = [pulse_resolution_table(ppr_values(dataset.encoders()), *dataset.robot)]
    for kind in GOAL_TABLES:
        tables += [goal_table(dataset, kind), interval_table(dataset, kind)]
    return [*tables, *(table for table in (path_error_table(dataset), variant_table(dataset)) if table is not None)]
