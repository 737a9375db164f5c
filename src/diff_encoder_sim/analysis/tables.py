"""Tables of an analysis: tables 3 to 6 with intervals, path errors, and errors of variants."""

from __future__ import annotations

import itertools
import math
from typing import Dict, List, Optional, Sequence

import numpy as np

from diff_encoder_sim.analysis import results_table, statistics
from diff_encoder_sim.analysis.encoder_labels import IDEAL, ppr_text, ppr_values
from diff_encoder_sim.analysis.quantities import LEVEL, MINUS_TRUTH, QUANTITIES, YAW, Quantity, X
from diff_encoder_sim.analysis.result_tables import LABELS, Column, Decimals, ResultTable
from diff_encoder_sim.analysis.results_table import ALIGNMENTS, RPES, SUCCEEDED, Results, RobotGeometry, encoders
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.trials.trials_csv import VARIANT


def all_tables(results: Results) -> List[ResultTable]:
    """Build tables 3 to 6, the intervals of 4 to 6, and the tables of path errors and variants if available."""
    tables = [pulse_resolution_table(ppr_values(encoders(results.trials)), results.robot)]
    for pose in GOAL_TABLES:
        found = estimates(results, pose)
        tables += [goal_table(results, pose, found), interval_table(pose, found)]
    return [*tables, *filter(None, [path_error_table(results), variant_table(results)])]


def pulse_resolution(pprs: Sequence[float], robot: RobotGeometry) -> pd.DataFrame:
    """Compute the robot's motion per pulse: a row per PPR, in the given order.

    Returns:
        `ppr` as text; `linear_mm`, of the wheel along the floor: d = pi D / PPR; `two_wheel_angle_deg`, one pulse of
        each wheel, in opposite directions: 2 d / L; `one_wheel_angle_deg`, one pulse of one wheel only: d / L.
    """
    linear_m = math.pi * robot.wheel_diameter_m / np.array(pprs)
    angle_deg = np.degrees(linear_m / robot.wheel_separation_m)
    columns = {'linear_mm': 1e3 * linear_m, 'two_wheel_angle_deg': 2.0 * angle_deg, 'one_wheel_angle_deg': angle_deg}
    return pd.DataFrame({'ppr': [f'{ppr:g}' for ppr in pprs], **columns})


def pulse_resolution_table(pprs: Sequence[float], robot: RobotGeometry) -> ResultTable:
    """Build table 3."""
    columns = {
        'ppr': Column('PPR'),
        'linear_mm': Column('travel per pulse [mm]', decimals=3),
        'two_wheel_angle_deg': Column('rotation, one pulse of both wheels [deg]', decimals=4),
        'one_wheel_angle_deg': Column('rotation, one pulse of one wheel [deg]', decimals=4),
    }
    notes = [
        f'Wheel diameter {robot.wheel_diameter_m:g} m, wheel separation {robot.wheel_separation_m:g} m.',
        'Both wheels: one pulse each, in opposite directions, as in the paper.',
        'PPR: counts per wheel turn, by the name that the paper uses in tables 3 to 6.',
    ]
    title = 'Table 3. Resolution of the encoder: robot motion per pulse'
    return ResultTable('table3', title, pulse_resolution(pprs, robot), columns, notes)


GOAL_TABLES = {  # tables 4 to 6 of the paper and two of the same form, by pose: file name and title
    'odom': ('table4', 'Table 4. Final /odom minus the goal'),
    'world': ('table5', 'Table 5. Final /world_pose minus the goal'),
    'global': ('table6', 'Table 6. Final /global_pose minus the goal'),
    'amcl': ('table6_amcl', 'As table 6. Final /amcl_pose minus the goal'),
    MINUS_TRUTH: ('table4_minus_truth', 'As table 4. Final /odom minus /world_pose'),
}

DECIMALS = {'m': 4, 'deg': 3}
PERCENT_DECIMALS = 1
STATISTICS = ('min', 'max', 'mean', 'std', 'pct_within', 'trials')  # rows of tables 4 to 6 for each test


def estimates(results: Results, pose: str) -> pd.DataFrame:
    """Compute the statistics of the final errors [m, deg, per cent]: a row per cell and quantity."""
    keys = ['test', *results.varied, 'ppr']
    return pd.DataFrame(
        {**dict(zip(keys, key)), 'quantity': quantity.name, **error_statistics(of_cell, pose, quantity)}
        for key, of_cell in results.trials.groupby(keys, sort=False)
        for quantity in QUANTITIES
    )


def error_statistics(trials: pd.DataFrame, pose: str, quantity: Quantity) -> Dict[str, Optional[float]]:
    """Compute `STATISTICS` of final errors, and their intervals; None if undefined."""
    errors = results_table.final_errors(trials, pose, quantity)
    within, count = int(np.count_nonzero(np.abs(errors) <= quantity.tolerance)), len(errors)
    pairs = {
        'mean': statistics.mean_interval(errors),
        'std': statistics.std_interval(errors),
        'pct_within': [100.0 * bound for bound in statistics.wilson(within, count)],
    }
    return {
        'trials': count,
        **{name: float(getattr(errors, name)()) if count else None for name in ('min', 'max', 'mean')},
        'std': statistics.spread(errors),
        'pct_within': 100.0 * within / count if count else None,
        **{f'{name}_{end}': bound for name, pair in pairs.items() for end, bound in zip(('low', 'high'), pair)},
    }


def goal_table(results: Results, pose: str, found: pd.DataFrame) -> ResultTable:
    """Build one of tables 4 to 6 from its `estimates`: rows test and statistic, columns PPR and x, y, yaw."""
    keys, columns = ['test', *results.varied], {}
    exact = found[keys].drop_duplicates().merge(pd.DataFrame({'statistic': STATISTICS}), how='cross')
    of_row = {'trials': 0, 'pct_within': PERCENT_DECIMALS}
    for label, quantity in itertools.product(encoders(results.trials), QUANTITIES):
        name = f'{label if label == IDEAL else f"ppr{label}"}_{quantity.name}'.replace(' ', '_')
        of_column = found[(found['ppr'] == label) & (found['quantity'] == quantity.name)].astype(object)
        exact = exact.merge(of_column.melt(keys, STATISTICS, 'statistic', name), how='left')
        decimals = [of_row.get(statistic, DECIMALS[quantity.unit]) for statistic in exact['statistic']]
        columns[name] = Column(LABELS[quantity.name], ppr_text(label, 'PPR'), decimals)
    counts = exact.loc[exact['statistic'] == 'trials', list(columns)]
    exact.loc[counts.index, list(columns)] = counts.fillna(0).astype(int)
    note = (
        f"x and y along the map's axes. Within: {X.tolerance:g} m in x and in y, {YAW.tolerance:g} degrees in yaw. All "
        'trials with a final pose count, with any outcome.'
    )
    return ResultTable(*GOAL_TABLES[pose], exact, columns, [note])


def interval_table(pose: str, found: pd.DataFrame) -> ResultTable:
    """Build the intervals of one of tables 4 to 6 from its `estimates`: a row per test, PPR and quantity."""
    of_row = [DECIMALS[name.rpartition('_')[2]] for name in found['quantity']]
    columns = {
        name + part: Column(head, group, PERCENT_DECIMALS if name == 'pct_within' else of_row)
        for name, group in {'mean': 'mean', 'std': 'std. dev.', 'pct_within': '% within'}.items()
        for part, head in {'': 'value', '_low': 'from', '_high': 'to'}.items()
    }
    note = (
        'Mean: by the t-distribution. Standard deviation: by chi-square, which assumes Gaussian errors. '
        '% within: Wilson. inf: too few trials for a bound.'
    )
    name, title = GOAL_TABLES[pose]
    title, exact = f'{title}: {100 * LEVEL:g} % intervals', found[[*found.loc[:, :'trials'], *columns]]
    return ResultTable(f'{name}_intervals', title, exact, {'trials': Column('trials', decimals=0), **columns}, [note])


_ATE_NOTE = (
    'ATE: distance from the true pose, for /odom with its first pose aligned to the true one, for the others without '
    f"alignment; mean of the trials' RMSE with its {100 * LEVEL:g} % interval (t-distribution) and standard deviation, "
    'and the largest distance in any trial. inf: too few trials for a bound.'
)
_RPE_NOTE = (
    'RPE: error of the motion over segments of the true path; mean of the RMSE of the trials with segments, and total '
    'number of segments. Consecutive: segments end to end; all pairs: a segment starts at each pose.'
)


def path_error_table(results: Results) -> Optional[ResultTable]:
    """Build the table of path errors, with a row per cell and source; None without paths."""
    rows, keys = [], ['test', *results.varied, 'ppr']
    for (key, of_cell), source in itertools.product(results.trials.groupby(keys, sort=False), ALIGNMENTS):
        of_source = of_cell.filter(regex=f'^{source.value}_').rename(columns=lambda name: name.partition('_')[2])
        of_source = of_source.dropna(subset=['x_m', 'ate_rmse_m'])
        if of_source.empty:
            continue
        means, ate_m = of_source.mean(numeric_only=True), of_source['ate_rmse_m'].to_numpy(dtype=float)
        row = {**dict(zip(keys, key)), 'source': source.value, 'trials': len(of_source)}
        row['ate_rmse_mean_m'], row['ate_rmse_std_m'] = float(np.mean(ate_m)), statistics.spread(ate_m)
        row['ate_rmse_low_m'], row['ate_rmse_high_m'] = statistics.mean_interval(ate_m)
        row['ate_max_m'] = float(of_source['ate_max_m'].max())
        row['yaw_rmse_mean_deg'] = math.degrees(means['yaw_rmse_rad'])
        for name, _, _ in RPES:  # NaN without segments; ignored by the means
            row[f'{name}_segments'] = int(of_source[f'{name}_segments'].sum())
            row[f'{name}_translation_rmse_mean_m'] = means[f'{name}_translation_rmse_m']
            row[f'{name}_rotation_rmse_mean_deg'] = math.degrees(means[f'{name}_rotation_rmse_rad'])
        rows.append(row)
    if not rows:
        return None
    of_path = {'ate_rmse_mean_m': 'ATE RMSE [m]', 'ate_rmse_low_m': 'from', 'ate_rmse_high_m': 'to'}
    of_path.update(ate_rmse_std_m='std. dev.', ate_max_m='ATE max [m]', yaw_rmse_mean_deg='yaw RMSE [deg]')
    heads = {name: (head, 'whole path') for name, head in of_path.items()}
    for name, pairs, distance_m in RPES:
        group = f'RPE over {distance_m:g} m, {pairs.text}'
        heads[f'{name}_segments'] = ('segments', group)
        heads[f'{name}_translation_rmse_mean_m'] = ('translation [m]', group)
        heads[f'{name}_rotation_rmse_mean_deg'] = ('rotation [deg]', group)
    columns = {name: Column(*head, DECIMALS.get(name.rpartition('_')[2], 0)) for name, head in heads.items()}
    exact = pd.DataFrame(rows, columns=[*keys, 'source', 'trials', *columns])
    columns['trials'] = Column('trials', decimals=0)
    return ResultTable('path_errors', 'Errors over the whole path', exact, columns, [_ATE_NOTE, _RPE_NOTE])


VARIANTS = 'variants'  # name of the figure and the table
LEAST_ERROR = 1e-7  # lower limit of errors in ratios [m, rad]
KINDS = {'position_mm': (1e3, 2), 'heading_deg': (180.0 / math.pi, 3)}  # of errors: scale from SI, and decimals


def first_variant(trials: pd.DataFrame) -> str:
    """Return the name of the reference variant; '' if there are no variants."""
    return str(trials[VARIANT].iloc[0]) if VARIANT in trials.columns and len(trials) else ''


def variant_errors(results: Results) -> pd.DataFrame:
    """Compute the final odometry error in each variant, over trials with any outcome; empty without variants.

    Returns:
        a row per cell with errors and kind of `KINDS`: `test`, varied parameters, `ppr`, `setup`, `cell`, `error` (the
        kind), `median`, `low` and `high` (quartiles) in the unit of the kind, `failed` and `trials`; `ratio` to equal
        trials of the first variant with its interval `ratio_low` to `ratio_high`, NaN for the first itself.
    """
    if VARIANT not in results.varied:
        return pd.DataFrame()
    trials, rows, keys = results.trials, [], ['test', *results.varied, 'ppr']
    apart = [key for key in keys if key != VARIANT]
    of_first = dict(list(trials[trials[VARIANT] == first_variant(trials)].groupby(apart, sort=False)))
    for _, of_cell in trials.groupby('cell', sort=False):
        first = of_cell.iloc[0]
        base = of_first.get(tuple(first[apart]))
        is_compared = base is not None and first[VARIANT] != first_variant(trials)
        pairs = results_table.equal_trials(of_cell, base, MINUS_TRUTH) if is_compared else ()
        for kind, (scale, _) in KINDS.items():
            sizes, ratios = error_sizes(of_cell, kind), [math.nan] * 3
            if not len(sizes):
                continue
            if pairs and len(pairs[0]):  # typical ratio by signed ranks of logarithms
                logs = [np.log(np.maximum(error_sizes(part, kind), LEAST_ERROR)) for part in pairs]
                result = statistics.wilcoxon(*logs)
                ratios = [math.exp(value) for value in (result.estimate, *result.interval)]
            low, median, high = (scale * np.percentile(sizes, (25.0, 50.0, 75.0))).tolist()
            found = {'error': kind, 'median': median, 'low': low, 'high': high}
            found.update(failed=int((of_cell['outcome'] != SUCCEEDED).sum()), trials=len(of_cell))
            found.update(zip(('ratio', 'ratio_low', 'ratio_high'), ratios))
            rows.append({**first[[*keys, 'setup', 'cell']], **found})
    return pd.DataFrame(rows)


def error_sizes(trials: pd.DataFrame, kind: str) -> np.ndarray:
    """Return the (n,) magnitudes [m, rad] of the final odometry error, of one of `KINDS`."""
    known = trials.dropna(subset=[f'{MINUS_TRUTH}_x_m'])
    x_m, y_m, yaw_rad = (known[f'{MINUS_TRUTH}_{part}'].to_numpy(dtype=float) for part in ('x_m', 'y_m', 'yaw_rad'))
    return np.asarray(np.abs(yaw_rad) if kind == 'heading_deg' else np.hypot(x_m, y_m))


def variant_table(results: Results) -> Optional[ResultTable]:
    """Build a table with rows of test, variant and kind of error, columns by encoder; None without variants."""
    errors = variant_errors(results)
    if errors.empty:
        return None
    setup, columns = ['test', *results.varied], {}
    exact = results.trials[setup].drop_duplicates().merge(pd.DataFrame({'error': list(KINDS)}), how='cross')
    bounds = errors[['ratio_low', 'ratio_high']].itertuples(index=False)
    intervals = [f'{low:.3g} to {high:.3g}' if math.isfinite(high) else '' for low, high in bounds]
    errors = errors.assign(quartiles=errors['high'] - errors['low'], **{'95 %': intervals}).astype(object)
    of_row = [KINDS[kind][1] for kind in exact['error']]
    of_head: Dict[str, Decimals] = {'median': of_row, 'quartiles': of_row, 'ratio': 2, '95 %': None, 'failed': 0}
    for label in encoders(results.trials):
        names = {head: f'ppr{label}_{head}'.replace(' ', '_') for head in of_head}
        of_label = errors.loc[errors['ppr'] == label, [*setup, 'error', *of_head]]
        exact = exact.merge(of_label.rename(columns=names), how='left').fillna({names['95 %']: ''})
        columns.update({names[head]: Column(head, ppr_text(label), decimals) for head, decimals in of_head.items()})
    counted = 'All trials with a final pose count; failed: number of failed trials.'
    first = f'Ratio: errors relative to equal trials of the variant {first_variant(results.trials)!r}'
    notes = [
        f'Position and heading error: median and interquartile range. {counted}',
        f'{first}, by signed ranks of logarithms, with an uncorrected 95 % interval (at least six trials).',
    ]
    title = 'Variants: final odometry error, /odom minus /world_pose'
    return ResultTable(VARIANTS, title, exact, columns, notes)
