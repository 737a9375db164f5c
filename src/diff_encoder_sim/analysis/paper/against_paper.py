"""The paper's numbers and claims beside ours, as tables."""

from __future__ import annotations

import math
from typing import Dict, List, Sequence, Tuple

from diff_encoder_sim.analysis.paper.errata import ERRATA
from diff_encoder_sim.analysis.paper.paper_cells import STATISTICS
from diff_encoder_sim.analysis.paper.paper_comparison import ComparedCell, PaperComparison
from diff_encoder_sim.analysis.quantities import Quantity
from diff_encoder_sim.analysis.table_files import Column, Entry, Number, Table
from diff_encoder_sim.analysis.table_keys import cell_head
from diff_encoder_sim.recording.topics import TOPIC_OF_SOURCE
from diff_encoder_sim.trials.pose_source import PoseSource

HEADS = {'min': 'min', 'max': 'max', 'std': 'std. dev.', 'pct_within': '% within'}
DIFFERS, ERRATUM, CALIBRATED = '≠', '†', '*'
LEGEND = (
    f'In brackets our 95 % interval. {DIFFERS} chance alone does not explain the difference '
    f"(p < 0.05; of twenty cells that agree about one is marked). {ERRATUM} the paper's "
    f'number is among its errata. {CALIBRATED} the slip of '
    f'config/campaigns/paper.yaml was fitted to this.'
)


def cell_tables(comparison: PaperComparison) -> List[Table]:
    """Tables 4 to 6, the paper's numbers beside ours."""
    columns = [Column('cell', 'cell'), Column('quantity', 'error')]
    columns += [
        Column(f'{statistic}_{whose}', whose, HEADS[statistic])
        for statistic in STATISTICS
        for whose in ('paper', 'ours')
    ]
    tables = []
    for number in sorted({row.paper.table for row in comparison.rows}):
        rows = [row for row in comparison.rows if row.paper.table == number]
        tables.append(
            Table(
                f'paper_table{number}',
                f'Table {number} of the paper ({TOPIC_OF_SOURCE[rows[0].paper.source]}) and ours',
                columns,
                _rows(rows),
                [LEGEND],
            )
        )
    return tables


def score_table(comparison: PaperComparison) -> Table:
    """How many cells agree, by source and encoder."""
    columns = [
        Column('source', 'source'),
        Column('ppr', 'PPR'),
        Column('tested', 'cells compared'),
        Column('compatible', 'agree'),
    ]
    scores = comparison.scores()
    rows: List[List[Entry]] = [
        [TOPIC_OF_SOURCE[source], ppr, Number(scores[source, ppr].tested, 0), Number(scores[source, ppr].compatible, 0)]
        for source, ppr in sorted(scores, key=lambda key: list(PoseSource).index(key[0]))
    ]
    return Table(
        'paper_scores',
        'Cells of the paper that ours agree with',
        columns,
        rows,
        [
            'Agree: chance alone explains the difference (p at least 0.05). Left out are cells that '
            'the errata affect, those whose minimum or maximum tells nothing, and what the slip of '
            'config/campaigns/paper.yaml was fitted to.'
        ],
    )


def resolution_table(comparison: PaperComparison) -> Table:
    """Table 3 for this robot, beside the paper's."""
    columns = [
        Column('ppr', 'PPR'),
        Column('linear_paper', 'paper', 'linear [mm]'),
        Column('linear_ours', 'computed', 'linear [mm]'),
        Column('angle_paper', 'paper', 'angle, both wheels [deg]'),
        Column('angle_ours', 'computed', 'angle, both wheels [deg]'),
    ]
    rows: List[List[Entry]] = []
    for computed, printed in comparison.resolutions:
        rows.append(
            [
                f'{computed.ppr:g}',
                Number(printed and 1e3 * printed.linear_m, 2),
                Number(1e3 * computed.linear_m, 2),
                Number(printed and math.degrees(printed.angle_rad), 3),
                Number(math.degrees(computed.two_wheel_angle_rad), 3),
            ]
        )
    return Table('paper_table3', 'Table 3 of the paper and computed: one pulse', columns, rows, [])


def errata_table() -> Table:
    """What is wrong in the paper itself."""
    columns = [Column('where', 'where'), Column('printed', 'printed'), Column('right', 'right'), Column('why', 'why')]
    return Table(
        'errata', 'Errata of the paper', columns, [[one.where, one.printed, one.right, one.why] for one in ERRATA], []
    )


def _rows(compared: Sequence[ComparedCell]) -> List[List[Entry]]:
    by_row: Dict[Tuple[str, Quantity], Dict[str, ComparedCell]] = {}
    for one in compared:
        by_row.setdefault((cell_head(one.cell), one.paper.quantity), {})[one.paper.statistic] = one
    return [
        [head, quantity.head, *(text for statistic in STATISTICS for text in _texts(of_row.get(statistic)))]
        for (head, quantity), of_row in by_row.items()
    ]


def _texts(one: ComparedCell) -> Tuple[str, str]:
    """The paper's number and ours, with marks."""
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
