"""The paper's numbers beside ours, as tables."""

from __future__ import annotations

import math
from typing import Dict, List, Optional, Sequence, Tuple

from diff_encoder_sim.analysis.paper.errata import ERRATA
from diff_encoder_sim.analysis.paper.paper_cells import STATISTICS
from diff_encoder_sim.analysis.paper.paper_comparison import ComparedCell, PaperComparison
from diff_encoder_sim.analysis.quantities import Quantity
from diff_encoder_sim.analysis.table import Column, Entry, Number, Table
from diff_encoder_sim.analysis.table_keys import cell_text
from diff_encoder_sim.recording.topics import TOPIC_OF_SOURCE
from diff_encoder_sim.trials.pose_source import PoseSource

HEADS = {'min': 'min', 'max': 'max', 'std': 'std. dev.', 'pct_within': '% within'}
DIFFERS, ERRATUM, CALIBRATED = '≠', '†', '*'
LEGEND = (
    f'In brackets our 95 % interval. {DIFFERS} chance alone does not explain the difference (p < 0.05; this '
    f"marks about one of twenty cells that agree). {ERRATUM} the paper's number is among its errata. "
    f'{CALIBRATED} the slip of config/campaigns/paper.yaml was fitted to this number.'
)
SCORE_NOTE = (
    'Agree: chance alone can explain the difference (p at least 0.05). Left out are cells that the errata affect, '
    'minima and maxima that allow no conclusion, and the numbers that the slip of config/campaigns/paper.yaml was '
    'fitted to.'
)


def cell_tables(comparison: PaperComparison) -> List[Table]:
    """Build tables 4 to 6 with the paper's numbers beside ours."""
    columns = [Column('cell', 'cell'), Column('quantity', 'error')]
    columns += [
        Column(f'{statistic}_{whose}', whose, HEADS[statistic])
        for statistic in STATISTICS
        for whose in ('paper', 'ours')
    ]
    tables = []
    for number in sorted({row.paper.table for row in comparison.rows}):
        rows = [row for row in comparison.rows if row.paper.table == number]
        title = f'Table {number} of the paper ({TOPIC_OF_SOURCE[rows[0].paper.source]}) and ours'
        tables.append(Table(f'paper_table{number}', title, columns, _cell_rows(rows), [LEGEND]))
    return tables


def score_table(comparison: PaperComparison) -> Table:
    """Count the cells that agree, by source and encoder."""
    columns = [
        Column('source', 'source'),
        Column('ppr', 'PPR'),
        Column('tested', 'cells compared'),
        Column('compatible', 'agree'),
    ]
    scores, sources = comparison.scores(), list(PoseSource)
    rows: List[List[Entry]] = []
    for source, ppr in sorted(scores, key=lambda key: sources.index(key[0])):
        tested, compatible = scores[source, ppr]
        rows.append([TOPIC_OF_SOURCE[source], ppr, Number(tested, 0), Number(compatible, 0)])
    return Table('paper_scores', 'Cells of the paper that agree with ours', columns, rows, [SCORE_NOTE])


def resolution_table(comparison: PaperComparison) -> Table:
    """Build table 3 for this robot, beside the paper's."""
    linear, angle = 'travel per pulse [mm]', 'rotation, one pulse of both wheels [deg]'
    columns = [
        Column('ppr', 'PPR'),
        Column('linear_paper', 'paper', linear),
        Column('linear_ours', 'computed', linear),
        Column('angle_paper', 'paper', angle),
        Column('angle_ours', 'computed', angle),
    ]
    rows: List[List[Entry]] = [
        [
            f'{computed.ppr:g}',
            Number(printed and 1e3 * printed.linear_m, 2),
            Number(1e3 * computed.linear_m, 2),
            Number(printed and math.degrees(printed.angle_rad), 3),
            Number(math.degrees(computed.two_wheel_angle_rad), 3),
        ]
        for computed, printed in comparison.resolutions
    ]
    return Table('paper_table3', 'Table 3 of the paper, printed and computed', columns, rows, [])


def errata_table() -> Table:
    """List the errors in the paper itself."""
    columns = [Column(name, name) for name in ('where', 'printed', 'right', 'why')]
    rows: List[List[Entry]] = [[one.where, one.printed, one.right, one.why] for one in ERRATA]
    return Table('errata', 'Errata of the paper', columns, rows, [])


def _cell_rows(compared: Sequence[ComparedCell]) -> List[List[Entry]]:
    by_row: Dict[Tuple[str, Quantity], Dict[str, ComparedCell]] = {}
    for one in compared:
        by_row.setdefault((cell_text(one.cell), one.paper.quantity), {})[one.paper.statistic] = one
    return [
        [cell, quantity.head, *(text for statistic in STATISTICS for text in _texts(of_row.get(statistic)))]
        for (cell, quantity), of_row in by_row.items()
    ]


def _texts(one: Optional[ComparedCell]) -> Tuple[str, str]:
    """Format the paper's number and ours, with marks."""
    if one is None:
        return '–', '–'
    decimals = 1 if one.paper.statistic == 'pct_within' else 3
    paper = f'{one.paper.value:.{decimals}f}{f" {ERRATUM}" if one.errata else ""}'
    ours = f'{one.agreement.ours:.{decimals}f}'
    if one.agreement.interval is not None:
        low, high = one.agreement.interval
        ours += f' ({low:.{decimals}f} to {high:.{decimals}f})'
    marks = [DIFFERS] * (one.is_compatible is False) + [CALIBRATED] * one.is_calibrated
    return paper, ' '.join([ours, *marks])
