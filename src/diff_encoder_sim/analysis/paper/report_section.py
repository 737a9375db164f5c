"""Comparison of the paper's numbers with one or two datasets: tables and sentences for files and the report."""

from __future__ import annotations

import math
from typing import Any, Dict, List, NamedTuple, Optional, Sequence

from diff_encoder_sim.analysis.encoder_labels import ppr_values
from diff_encoder_sim.analysis.paper.claims import ClaimResult, check_claims
from diff_encoder_sim.analysis.paper.comparison import compare_with_paper, score
from diff_encoder_sim.analysis.paper.paper_cells import PRINTED_RESOLUTIONS, STATISTICS, TRIALS, load_errata, of_paper
from diff_encoder_sim.analysis.quantities import POSES
from diff_encoder_sim.analysis.result_tables import LABELS, NOTHING, ResultTable
from diff_encoder_sim.analysis.results_table import STANDARD_TESTS, Results, encoders
from diff_encoder_sim.analysis.statistics import SIGNIFICANCE
from diff_encoder_sim.analysis.tables import pulse_resolution
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.base.errors import ConfigError

PRINTED = 'printed'  # label of the paper's numbers; a campaign may be called paper
DIFFERS, ERRATUM, CALIBRATED = '≠', '†', '*'
LEGEND = (
    f'{DIFFERS} contradicted: the difference is significant (p < 0.05 after Holm, over all cells of the '
    f"source and test). {ERRATUM} the paper's number is among its errata. {CALIBRATED} the slip of "
    f'config/campaigns/paper.yaml was fitted to this number. Neither is tested.'
)
INTERVAL_LEGEND = (
    "In brackets our 95 % interval; for min and max, the prediction interval for the paper's number of trials (inf: "
    'too few of our trials for a bound).'
)

SCORE_NOTE = (
    "A cell agrees unless the difference is significant, given the sampling error of the paper's 30 trials and of "
    "ours (standard deviation: F-test, corrected for heavy tails; % within: Fisher's exact test; min and max: ranks, "
    'with an exponential tail beyond our extremes). The cells of a row are tested together (p at least 0.05 after '
    'Holm): for equal robots, one row in twenty would contain a cell that does not agree. Cells affected by the '
    'errata, the numbers used to fit config/campaigns/paper.yaml, and inconclusive minima and maxima are not counted.'
)


def cell_tables(compared: pd.DataFrame) -> List[ResultTable]:
    """Build tables 4 to 6 with the paper's numbers next to ours; for one campaign with intervals."""
    campaigns = list(compared['campaign'].unique())
    is_single = len(campaigns) == 1
    labels = {campaign: 'ours' if is_single else campaign for campaign in campaigns}
    tables = []
    for number, of_table in compared.groupby('table'):
        printed = of_table.drop_duplicates(['test', 'ppr', 'quantity', 'statistic']).assign(whose=PRINTED)
        texts = [_printed_text(row) for row in printed.to_dict('records')]
        ours = of_table.assign(whose=of_table['campaign'].map(labels))
        texts += [_our_text(row, is_single) for row in ours.to_dict('records')]
        both = pd.concat([printed, ours])
        both = both.assign(text=texts, cell=both['test'] + ', ' + both['ppr'] + ' PPR')
        wide = both.pivot(index=['cell', 'quantity'], columns=['statistic', 'whose'], values='text')
        names = {(one, whose): f'{one}_{whose}' for one in STATISTICS for whose in (PRINTED, *labels.values())}
        rows = pd.MultiIndex.from_frame(both[['cell', 'quantity']].drop_duplicates())
        exact = wide.reindex(index=rows, columns=list(names)).fillna(NOTHING).set_axis(names.values(), axis=1)
        exact = exact.reset_index().replace({'quantity': LABELS})
        heads = {name: (LABELS.get(one, one), whose) for (one, whose), name in names.items()}
        title = f'Table {number} of the paper ({POSES[of_table["source"].iloc[0]]}) and ours'
        notes = [INTERVAL_LEGEND, LEGEND] if is_single else [LEGEND]
        heads['quantity'] = ('', 'error')
        tables.append(ResultTable(f'paper_table{number}', title, exact, heads, {}, notes))
    return tables


def _decimals(row: Dict[str, Any]) -> int:
    return 1 if row['statistic'] == 'pct_within' else 3


def _printed_text(row: Dict[str, Any]) -> str:
    is_erratum = row['left_out'].replace('calibrated', '') != ''
    return f'{row["paper"]:.{_decimals(row)}f}' + (f' {ERRATUM}' if is_erratum else '')


def _our_text(row: Dict[str, Any], has_interval: bool) -> str:
    decimals = _decimals(row)
    ours = f'{row["ours"]:.{decimals}f}'
    if has_interval:
        ours += f' ({row["low"]:.{decimals}f} to {row["high"]:.{decimals}f})'
    marks = [DIFFERS] * bool(row['p_holm'] < SIGNIFICANCE) + [CALIBRATED] * ('calibrated' in row['left_out'])
    return ' '.join([ours, *marks])


def all_cells_table(compared: pd.DataFrame) -> ResultTable:
    """Build the table of all compared numbers with their p-values."""
    names = ['campaign', 'table', 'source', 'test', 'ppr', 'quantity', 'statistic', 'paper', 'ours', 'low', 'high']
    return ResultTable('paper_cells', 'Cells of the paper and ours', compared[[*names, 'p', 'p_holm', 'left_out']])


def resolution_table(results: Results) -> ResultTable:
    """Build table 3 for this robot next to that of the paper."""
    linear, angle = 'travel per pulse [mm]', 'rotation, one pulse of both wheels [deg]'
    heads = {
        'ppr': ('', 'PPR'),
        'linear_paper': (linear, 'paper'),
        'linear_ours': (linear, 'computed'),
        'angle_paper': (angle, 'paper'),
        'angle_ours': (angle, 'computed'),
    }
    rows = []
    for ppr in ppr_values(encoders(results.trials)):
        linear_mm, angle_deg = PRINTED_RESOLUTIONS.get(ppr, (None, None))
        ours = pulse_resolution(ppr, *results.robot)
        rows.append([f'{ppr:g}', linear_mm, 1e3 * ours.linear_m, angle_deg, math.degrees(ours.two_wheel_angle_rad)])
    decimals = {'linear_paper': 2, 'linear_ours': 2, 'angle_paper': 3, 'angle_ours': 3}
    exact = pd.DataFrame(rows, columns=list(heads), dtype=object)
    return ResultTable('paper_table3', 'Table 3 of the paper, printed and computed', exact, heads, decimals)


def score_table(compared: pd.DataFrame) -> ResultTable:
    """Count the cells that agree by source and test, with a column group per campaign."""
    campaigns = list(compared['campaign'].unique())
    groups = {campaign: campaign if len(campaigns) > 1 else '' for campaign in campaigns}
    names = {(one, part): f'{groups[one]}_{part}'.lstrip('_') for one in campaigns for part in ('compared', 'agree')}
    rows: List[List[Any]] = []
    for source, test in (*((pose, test) for pose in POSES for test in STANDARD_TESTS), ('all', '')):
        of_row = compared if source == 'all' else compared[(compared['source'] == source) & (compared['test'] == test)]
        if len(of_row):
            counts = [
                value if (of_row['campaign'] == one).any() else None
                for one in campaigns
                for value in score(of_row[of_row['campaign'] == one])
            ]
            rows.append([POSES.get(source, source), test, *counts])
    exact = pd.DataFrame(rows, columns=['source', 'test', *names.values()], dtype=object)
    heads = {name: (groups[one], name if not groups[one] else part) for (one, part), name in names.items()}
    decimals = dict.fromkeys(names.values(), 0)
    return ResultTable('paper_scores', 'Cells of the paper that agree with ours', exact, heads, decimals, [SCORE_NOTE])


class PaperSection(NamedTuple):
    """Comparison of the paper with each campaign (results, or one set of their varied parameters)."""

    scores: ResultTable
    texts: List[str]  # scores in sentences
    claims: Dict[str, List[ClaimResult]]  # by campaign
    cells: List[ResultTable]
    all_cells: ResultTable  # only written to a file
    errata: ResultTable
    has_enough_trials: bool  # as many as the paper; with few trials nearly everything agrees


def paper_section(every: Sequence[Results]) -> Optional[PaperSection]:
    """Compare results with the paper; None for a single one without a cell of the paper.

    Raises:
        ConfigError: one of several results contains no cell of the paper.
    """
    every = [of_paper(results) for results in every]
    names = _names(every)
    parts = [compare_with_paper(results, name) for results, name in zip(every, names)]
    if len(every) == 1 and parts[0].empty:
        return None
    for results, part in zip(every, parts):
        if part.empty:
            raise ConfigError(
                f'{results.folder or results.title}: has no cell of the paper; '
                f"expected the paper's robot and tests (SL, SMT or DLD, navigated) with 40, 90, 1024 or 4096 PPR"
            )
    compared = pd.concat(parts, ignore_index=True)
    found = {
        label: tests for results, name in zip(every, names) for label, tests in check_claims(results, name).items()
    }
    scores = {campaign: score(of_campaign) for campaign, of_campaign in compared.groupby('campaign', sort=False)}
    return PaperSection(
        score_table(compared),
        [
            f'{label}: of {count} cells of the paper {agree} agree with ours.'
            for label, (count, agree) in scores.items()
        ],
        {campaign: found[campaign] for campaign in scores},
        [resolution_table(every[0]), *cell_tables(compared)],
        all_cells_table(compared),
        ResultTable('errata', 'Errata of the paper', pd.DataFrame(load_errata())[['where', 'printed', 'right', 'why']]),
        bool((compared['trials'] >= TRIALS).all()),
    )


def _names(every: Sequence[Results]) -> List[str]:
    """Return unique names: titles, folders, or numbered titles; '' if varied parameters suffice."""
    if len(every) == 1 and every[0].varied:
        return ['']
    titles = [results.title for results in every]
    folders = [str(results.folder) for results in every]
    numbers = [f'{title} ({number})' for number, title in enumerate(titles, start=1)]
    return next(names for names in (titles, folders, numbers) if len(set(names)) == len(names))
