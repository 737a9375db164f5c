"""The paper's numbers beside ours, as tables."""

from __future__ import annotations

import math
from typing import Dict, List, Optional, Sequence, Tuple

from diff_encoder_sim.analysis.dataset import distinct
from diff_encoder_sim.analysis.paper.errata import ERRATA, errata_of
from diff_encoder_sim.analysis.paper.paper_cells import STATISTICS, PaperCell
from diff_encoder_sim.analysis.paper.paper_comparison import ComparedCell, PaperComparison
from diff_encoder_sim.analysis.paper.scores import Readings
from diff_encoder_sim.analysis.quantities import Quantity
from diff_encoder_sim.analysis.table import Column, Entry, Number, Table
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE

HEADS = {'min': 'min', 'max': 'max', 'std': 'std. dev.', 'pct_within': '% within'}
PRINTED = 'printed'  # in the paper; a campaign may be called paper
DIFFERS, ERRATUM, CALIBRATED = '≠', '†', '*'
LEGEND = (
    f'{DIFFERS} contradicted: chance alone does not explain the difference (p < 0.05 after Holm, over all cells of the '
    f"source and test). {ERRATUM} the paper's number is among its errata. {CALIBRATED} the slip of "
    f'config/campaigns/paper.yaml was fitted to this number. Neither is tested.'
)
INTERVAL_LEGEND = (
    "In brackets our 95 % interval; of min and max, where those of the paper's number of trials lie (inf: too few of "
    'ours for a bound).'
)


def cell_tables(readings: Readings) -> List[Table]:
    """Build tables 4 to 6 with the paper's numbers beside ours, of one reading with its intervals."""
    is_single = len(readings) == 1
    labels = ['ours'] if is_single else list(readings)
    columns = [Column('cell', 'cell'), Column('quantity', 'error')]
    columns += [
        Column(f'{statistic}_{whose}', whose, HEADS[statistic])
        for statistic in STATISTICS
        for whose in (PRINTED, *labels)
    ]
    notes = [INTERVAL_LEGEND, LEGEND] if is_single else [LEGEND]
    tables = []
    for number in sorted({one.paper.table for cells in readings.values() for one in cells}):
        by_reading = [{one.paper: one for one in cells if one.paper.table == number} for cells in readings.values()]
        printed = distinct(paper for of_reading in by_reading for paper in of_reading)
        title = f'Table {number} of the paper ({TOPIC_OF_SOURCE[printed[0].source]}) and ours'
        tables.append(Table(f'paper_table{number}', title, columns, _cell_rows(printed, by_reading), notes))
    return tables


def all_cells_table(readings: Readings) -> Table:
    """List every compared number of each reading, with its tests."""
    names = ('campaign', 'table', 'source', 'test', 'ppr', 'quantity', 'statistic')
    numbers = ('paper', 'ours', 'low', 'high', 'p', 'p_holm')
    columns = [Column(name, name) for name in (*names, *numbers, 'left_out')]
    rows = [_all_entries(label, one) for label, cells in readings.items() for one in cells]
    return Table('paper_cells', 'Cells of the paper and ours', columns, rows, [])


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


def _cell_rows(printed: Sequence[PaperCell], by_reading: Sequence[Dict[PaperCell, ComparedCell]]) -> List[List[Entry]]:
    by_row: Dict[Tuple[str, Quantity], Dict[str, PaperCell]] = {}
    for paper in printed:
        by_row.setdefault((f'{paper.test}, {paper.ppr} PPR', paper.quantity), {})[paper.statistic] = paper
    rows: List[List[Entry]] = []
    for (cell, quantity), of_row in by_row.items():
        entries: List[Entry] = [cell, quantity.head]
        for statistic in STATISTICS:
            entries += _texts(of_row.get(statistic), by_reading)
        rows.append(entries)
    return rows


def _texts(paper: Optional[PaperCell], by_reading: Sequence[Dict[PaperCell, ComparedCell]]) -> List[str]:
    """Format the paper's number and that of each reading, with marks."""
    if paper is None:
        return ['–'] * (1 + len(by_reading))
    decimals = 1 if paper.statistic == 'pct_within' else 3
    found = [of_reading.get(paper) for of_reading in by_reading]
    mark = f' {ERRATUM}' if errata_of(paper) else ''
    return [f'{paper.value:.{decimals}f}{mark}', *(_our_text(one, decimals, len(found) == 1) for one in found)]


def _our_text(one: Optional[ComparedCell], decimals: int, has_interval: bool) -> str:
    if one is None:
        return '–'
    ours = f'{one.agreement.ours:.{decimals}f}'
    if has_interval:
        low, high = one.agreement.interval
        ours += f' ({low:.{decimals}f} to {high:.{decimals}f})'
    marks = [DIFFERS] * one.is_contradicted + [CALIBRATED] * one.is_calibrated
    return ' '.join([ours, *marks])


def _all_entries(label: str, one: ComparedCell) -> List[Entry]:
    """Return an entry for each column of `all_cells_table`."""
    paper, found = one.paper, one.agreement
    names = (f'{paper.table}', paper.source.value, paper.test, paper.ppr, paper.quantity.name, paper.statistic)
    numbers = (paper.value, found.ours, *found.interval, found.p_value, one.p_adjusted)
    left_out = [*one.errata, *(['calibrated'] if one.is_calibrated else [])]
    return [label, *names, *(Number(value, 4) for value in numbers), ' '.join(left_out)]
