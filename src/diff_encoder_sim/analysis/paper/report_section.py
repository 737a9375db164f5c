"""Comparison of the paper's numbers with one or two datasets: tables and sentences for files and the report."""

from __future__ import annotations

import itertools
from typing import Any, Dict, List, NamedTuple, Optional, Sequence

from diff_encoder_sim.analysis.encoder_labels import ppr_values
from diff_encoder_sim.analysis.paper import comparison
from diff_encoder_sim.analysis.paper.claims import ClaimResult, check_claims
from diff_encoder_sim.analysis.paper.comparison import COLUMNS, TRIALS, compare_with_paper, paper_table, score
from diff_encoder_sim.analysis.quantities import POSES
from diff_encoder_sim.analysis.result_tables import LABELS, NOTHING, Column, ResultTable
from diff_encoder_sim.analysis.results_table import STANDARD_TESTS, Results, campaign_names, encoders
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


def cell_tables(compared: pd.DataFrame) -> List[ResultTable]:
    """Build tables 4 to 6 with the paper's numbers next to ours; for one campaign with intervals."""
    compared = compared.assign(cell=compared['test'] + ', ' + compared['ppr'] + ' PPR')
    campaigns, tables = list(compared['campaign'].unique()), []
    is_single, keys = len(campaigns) == 1, ['cell', 'quantity']
    for number, of_table in compared.groupby('table'):
        parts = {campaign: of_table[of_table['campaign'] == campaign] for campaign in campaigns}
        parts = {'ours': of_table} if is_single else parts
        exact, columns = of_table[keys].drop_duplicates(), {}
        for statistic, whose in itertools.product(comparison.STATISTICS, (PRINTED, *parts)):
            of_column = parts.get(whose, of_table.drop_duplicates([*keys, 'statistic']))
            of_column = of_column[of_column['statistic'] == statistic]
            texts = [_text(row, whose == PRINTED, is_single) for row in of_column.to_dict('records')]
            name = f'{statistic}_{whose}'
            exact = exact.merge(of_column[keys].assign(**{name: texts}), how='left').fillna(NOTHING)
            columns[name] = Column(whose, LABELS.get(statistic, statistic))
        title = f'Table {number} of the paper ({POSES[of_table["source"].iloc[0]]}) and ours'
        notes = ['In brackets our 95 % interval.'] * is_single + [LEGEND]
        tables.append(ResultTable(f'paper_table{number}', title, exact.replace({'quantity': LABELS}), columns, notes))
    return tables


def _text(row: Dict[str, Any], is_printed: bool, has_interval: bool) -> str:
    """Return the paper's number or ours, with marks."""
    decimals = 1 if row['statistic'] == 'pct_within' else 3
    if is_printed:
        return f'{row["paper"]:.{decimals}f}' + f' {ERRATUM}' * (row['left_out'] not in ('', 'calibrated'))
    text = f'{row["ours"]:.{decimals}f}'
    if has_interval and row['statistic'] in ('std', 'pct_within'):
        text += f' ({row["low"]:.{decimals}f} to {row["high"]:.{decimals}f})'
    marks = [DIFFERS] * bool(row['p_holm'] < SIGNIFICANCE) + [CALIBRATED] * ('calibrated' in row['left_out'])
    return ' '.join([text, *marks])


def resolution_table(results: Results) -> ResultTable:
    """Build table 3 for this robot next to that of the paper."""
    pprs = ppr_values(encoders(results.trials))
    ours = pulse_resolution(pprs, results.robot)
    groups = {'linear': 'travel per pulse [mm]', 'angle': 'rotation, one pulse of both wheels [deg]'}
    exact, columns = ours[['ppr']], {}
    for (part, group), (column, printed), digits in zip(groups.items(), comparison.PRINTED_RESOLUTIONS.items(), (2, 3)):
        exact = exact.assign(**{f'{part}_paper': [printed.get(ppr) for ppr in pprs], f'{part}_ours': ours[column]})
        columns[f'{part}_paper'] = Column('paper', group, digits)
        columns[f'{part}_ours'] = Column('computed', group, digits)
    return ResultTable('paper_table3', 'Table 3 of the paper, printed and computed', exact, columns)


def score_table(compared: pd.DataFrame) -> ResultTable:
    """Count the cells that agree by source and test, with a column group per campaign."""
    campaigns, parts, rows = list(compared['campaign'].unique()), ('compared', 'agree'), []
    for source, test in (*((pose, test) for pose in POSES for test in STANDARD_TESTS), ('all', '')):
        is_row = (compared['source'] == source) & (compared['test'] == test) | (source == 'all')
        of_row = dict(list(compared[is_row].groupby('campaign')))
        counts = [score(of_row[one]) if one in of_row else (None, None) for one in campaigns]
        if of_row:
            rows.append([POSES.get(source, source), test, *itertools.chain.from_iterable(counts)])
    columns = {f'{one}_{part}': Column(part, one, 0) for one in campaigns for part in parts}
    if len(campaigns) == 1:
        columns = {part: Column(part, decimals=0) for part in parts}
    exact = pd.DataFrame(rows, columns=['source', 'test', *columns], dtype=object)
    return ResultTable('paper_scores', 'Cells of the paper that agree with ours', exact, columns)


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
    """Compare results with the paper; None if a single one has no cell of it; ConfigError if one of more has none."""
    every = [comparison.of_paper(results) for results in every]
    parts = [one.trials.assign(campaign=campaign_names(one, name)) for one, name in zip(every, _names(every))]
    trials = pd.concat(parts, ignore_index=True)
    compared = compare_with_paper(trials)
    for results, part in zip(every, parts):
        if not part['campaign'].isin(compared['campaign']).any():
            if len(every) == 1:
                return None
            raise ConfigError(
                f'{results.folder or results.title}: has no cell of the paper; '
                f"expected the paper's robot and tests (SL, SMT or DLD, navigated) with 40, 90, 1024 or 4096 PPR"
            )
    scores = {campaign: score(of_campaign) for campaign, of_campaign in compared.groupby('campaign', sort=False)}
    return PaperSection(
        score_table(compared),
        [f'{one}: of {count} cells of the paper {agree} agree with ours.' for one, (count, agree) in scores.items()],
        check_claims(trials[trials['campaign'].isin(scores)]),
        [resolution_table(every[0]), *cell_tables(compared)],
        ResultTable('paper_cells', 'Cells of the paper and ours', compared[[*COLUMNS, 'p_holm', 'left_out']]),
        ResultTable('errata', 'Errata of the paper', paper_table('errata')[['where', 'printed', 'right', 'why']]),
        bool((compared['trials'] >= TRIALS).all()),
    )


def _names(every: Sequence[Results]) -> List[str]:
    """Return unique names: titles, folders, or numbered titles; '' if varied parameters suffice."""
    if len(every) == 1 and every[0].varied:
        return ['']
    titles = [results.title for results in every]
    numbers = [f'{title} ({number})' for number, title in enumerate(titles, start=1)]
    folders = [str(results.folder) for results in every]
    return next(names for names in (titles, folders, numbers) if len(set(names)) == len(names))
