"""Summaries of results: the table for the terminal, success rates by cell, and the headline of an analysis."""

from __future__ import annotations

import enum
import itertools
import math
from typing import Dict, List, NamedTuple

import numpy as np
from tabulate import tabulate

from diff_encoder_sim.analysis.encoder_labels import encoders_text, enumeration, is_real, ppr_value
from diff_encoder_sim.analysis.quantities import LEVEL, MINUS_TRUTH, POSES, QUANTITIES, REQUIRED_FRACTION, YAW, X, Y
from diff_encoder_sim.analysis.results_table import SUCCEEDED, Results, are_within, final_errors, varied_texts
from diff_encoder_sim.analysis.statistics import wilson
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.trials.trials_csv import PARTS

TOLERANCE_TEXT = f'within {X.tolerance:g} m in x and y and {YAW.tolerance:g} degrees'

SOURCES_LEGEND = (
    'odom: wheel odometry; amcl: last /amcl_pose; global: pose estimate (/global_pose); world: ground truth;\n'
    'odom - world: odometry minus ground truth, the odometry error.'
)
CELL_LEGEND = (
    f'Final pose minus goal by pose source. %: trials that end {TOLERANCE_TEXT};\n'
    f'std dev: standard deviation of the position, x and y together.\n{SOURCES_LEGEND}'
)
TRIAL_LEGEND = f'Final pose minus goal by pose source: distance and heading.\n{SOURCES_LEGEND}'

COMPARED_POSES = {  # and their references; at the goal, the error of odometry includes the stopping error
    'world': 'true pose at the goal',
    'global': 'pose estimate at the goal',
    'odom': 'odometry at the goal',
    MINUS_TRUTH: 'odometry at the true pose',
}

MOST_NAMED = 3  # more tests (with their parameter sets) are counted instead of named


def summary(results: Results) -> str:
    """Return a table and its legend."""
    is_pooled = results.trials['cell'].duplicated().any()
    rows = []
    for _, of_cell in results.trials.groupby('cell', sort=False):
        first = of_cell.iloc[0]
        name = '\n'.join([first['test'], *varied_texts(list(first[results.varied]), results.varied)])
        if is_pooled:
            row = [name, first['ppr'], f'{len(of_cell)}', f'{(of_cell["outcome"] == SUCCEEDED).sum()}']
        else:
            row = [name, first['ppr'], f'{first["trial"]}', first['outcome'].replace('_', ' ')]
            row += [f'{first["duration_s"]:.1f}', f'{first["distance_m"]:.2f}']
        for pose in POSES:
            if is_pooled:
                within = are_within(of_cell, pose)
                stds_m = [np.std(final_errors(of_cell, pose, axis), ddof=1) for axis in (X, Y) if len(within) > 1]
                row.append(f'{100.0 * np.mean(within):.0f}' if len(within) else '')
                row.append(f'{math.hypot(*stds_m):.4f}' if stds_m else '')
            else:
                x_m, y_m, yaw_rad = (first[f'{pose}_{part}'] for part in PARTS)
                texts = [f'{math.hypot(x_m, y_m):.4f}', f'{math.degrees(yaw_rad):+.2f}']
                row += ['', ''] if math.isnan(x_m) else texts
        rows.append(row)
    heads, columns, legend = ['trials', 'succeeded'], ('%', 'std dev\n[m]'), CELL_LEGEND
    if not is_pooled:
        heads, columns, legend = ['trial', 'outcome', 'time\n[s]', 'path\n[m]'], ('[m]', '[deg]'), TRIAL_LEGEND
    names = {**{pose: f'\n{pose}' for pose in POSES}, MINUS_TRUTH: 'odom -\nworld'}
    heads = ['test', 'counts', *heads, *(f'{pose}\n{column}' for pose in names.values() for column in columns)]
    return f'{tabulate(rows, heads, disable_numparse=True, stralign="right")}\n{legend}'


class Sufficiency(enum.Enum):
    """Whether the required fraction of trials ends within the tolerance: all of Wilson's interval is above or below."""

    YES = 'yes'
    NO = 'no'
    UNDECIDED = 'undecided'


def fewest_trials() -> int:
    """Return the smallest number of trials that shows the required fraction if all succeed."""
    return next(count for count in itertools.count(1) if wilson(count, count).low >= REQUIRED_FRACTION)


def fractions_within(results: Results) -> pd.DataFrame:
    """Count the trials within the tolerance, with any outcome.

    Returns:
        a row per cell and pose of `COMPARED_POSES`: `setup`, its `name` in the headline, `ppr`, `pose`; number of
        `trials` with this final pose, and of trials `within` tolerance, also only in `position` (x and y) and only in
        `heading`; `low` and `high`, the interval of within / trials; `sufficiency`, a value of `Sufficiency`.
    """
    short, rows = [key.rpartition('.')[2] for key in results.varied], []
    keys = ['test', 'setup', 'ppr', *results.varied]
    for (test, setup, ppr, *values), of_cell in results.trials.groupby(keys, sort=False):
        parameters = ', '.join(varied_texts(values, short))
        name = f'{test} ({parameters})' if parameters else test
        for pose in COMPARED_POSES:
            parts = {'within': QUANTITIES, 'position': (X, Y), 'heading': (YAW,)}
            within = {key: are_within(of_cell, pose, part) for key, part in parts.items()}
            counts = {'trials': len(within['within']), **{key: int(each.sum()) for key, each in within.items()}}
            low, high = wilson(counts['within'], counts['trials'])
            found = Sufficiency.NO if high < REQUIRED_FRACTION else Sufficiency.UNDECIDED
            found = Sufficiency.YES if low >= REQUIRED_FRACTION else found
            row = {'setup': setup, 'name': name, 'ppr': ppr, 'pose': pose, **counts}
            rows.append({**row, 'low': low, 'high': high, 'sufficiency': found.value})
    return pd.DataFrame(rows)


class Headline(NamedTuple):
    """Conclusion about the encoders."""

    statement: str  # introduces `by_pose`
    by_pose: Dict[str, str]  # by text of the final pose
    failures: str  # empty if all trials succeeded

    @property
    def text(self) -> str:
        """Return the headline as lines for the terminal."""
        width = max(map(len, self.by_pose), default=0)
        lines = [f'  {pose + ":":{width + 1}} {text}' for pose, text in self.by_pose.items()]
        return '\n'.join([self.statement, *lines, *filter(None, [self.failures])])


def headline(fractions: pd.DataFrame, trials: pd.DataFrame) -> Headline:
    """Summarize the sufficient encoders by final pose, from `fractions_within`."""
    known = fractions[fractions['trials'] > 0]
    if known.empty:
        return Headline('No trial ended with a pose: nothing can be concluded.', {}, '')
    failed, percent = int((trials['outcome'] != SUCCEEDED).sum()), f'{100 * REQUIRED_FRACTION:.0f} %'
    failures = f'{failed} of {len(trials)} trials did not succeed.' if failed else ''
    most, fewest = known['trials'].max(), fewest_trials()
    if most < fewest:
        statement = (
            f'{most} {"trial" if most == 1 else "trials"} per cell: too few trials ({fewest} needed for {percent}). '
            f'Trials that end {TOLERANCE_TEXT}:'
        )
    else:
        confidence = f'{100 * LEVEL:.0f} % confidence'
        statement = f'Encoders with which at least {percent} of trials end {TOLERANCE_TEXT} ({confidence}):'
    texts = {}
    for pose, text in COMPARED_POSES.items():  # tests with equal texts are joined, many tests are summed
        of_pose = known[known['pose'] == pose]
        if of_pose['setup'].nunique() > MOST_NAMED:
            sufficient = (of_pose['sufficiency'] == Sufficiency.YES.value).sum()
            texts[text] = _counts(of_pose) if most < fewest else f'in {sufficient} of {len(of_pose)} cells'
        elif len(of_pose):
            names: Dict[str, List[str]] = {}
            for name, of_test in of_pose.groupby('name', sort=False):
                names.setdefault(_counts(of_test) if most < fewest else _encoders(of_test), []).append(name)
            texts[text] = '; '.join(f'{enumeration(tests)}: {about}' for about, tests in names.items())
    return Headline(statement, texts, failures)


def _counts(fractions: pd.DataFrame) -> str:
    return f'{fractions["within"].sum()} of {fractions["trials"].sum()}'


def _encoders(of_setup: pd.DataFrame) -> str:
    """Name the encoders that are sufficient and those that are undecided."""
    labels, kinds = list(of_setup['ppr']), (Sufficiency.YES.value, Sufficiency.UNDECIDED.value)
    sufficient, undecided = (list(of_setup['ppr'][of_setup['sufficiency'] == kind]) for kind in kinds)
    open_text = f' ({encoders_text(undecided)} undecided)' if undecided else ''
    if undecided == labels:
        return 'undecided'
    if not sufficient:
        return f'no encoder{open_text}'
    if sufficient == labels and len(labels) > 1:
        return 'every encoder'
    are_finest = sufficient == labels[-len(sufficient) :] and len(sufficient) > 1
    if are_finest and all(ppr_value(label) is not None and not is_real(label) for label in labels):
        return f'from {sufficient[0]} counts{open_text}'
    return f'{encoders_text(sufficient)}{open_text}'
