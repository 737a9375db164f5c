"""The paper's numbers beside those of one or two datasets: tables for files and the report, and a few sentences."""

from __future__ import annotations

import math
from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.analysis.dataset import STANDARD_TESTS, Dataset, Varied, distinct
from diff_encoder_sim.analysis.paper.claims import ClaimResult, check_claims
from diff_encoder_sim.analysis.paper.comparison import (
    ComparedCell,
    PaperComparison,
    Readings,
    Score,
    compare_with_paper,
    score,
)
from diff_encoder_sim.analysis.paper.paper_cells import ERRATA, STATISTICS, TRIALS, PaperCell, errata_of, of_paper
from diff_encoder_sim.analysis.quantities import Quantity
from diff_encoder_sim.analysis.table import Column, Entry, Number, Table
from diff_encoder_sim.analysis.table_keys import varied_keys, varied_texts
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource

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

SCORE_NOTE = (
    "A cell agrees unless chance alone does not explain the difference, with the sampling error of the paper's 30 "
    "trials and of ours (standard deviation: F-test, careful where our tails are heavy; % within: Fisher's exact "
    'test; min and max: ranks, and beyond all of ours an exponential tail). The cells of a row are judged '
    'together (p at least 0.05 after Holm): of equal robots, one row in twenty would have a cell that does not '
    'agree. Not counted are cells that the errata affect, the numbers that config/campaigns/paper.yaml was fitted '
    'to, and minima and maxima that nothing can be concluded from.'
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


def score_table(readings: Readings) -> Table:
    """Count the cells that agree by source and test, with a group of columns for each of several readings."""
    columns = [Column('source', 'source'), Column('test', 'test')]
    for label in readings:
        group = label if len(readings) > 1 else ''
        columns += [Column(f'{group}_{name}'.lstrip('_'), name, group) for name in Score._fields]
    found = {(one.paper.source, one.paper.test) for cells in readings.values() for one in cells}
    rows: List[List[Entry]] = []
    for source, test in ((source, test) for source in PoseSource for test in STANDARD_TESTS if (source, test) in found):
        entries: List[Entry] = [TOPIC_OF_SOURCE[source], test]
        for cells in readings.values():
            of_family = [one for one in cells if (one.paper.source, one.paper.test) == (source, test)]
            entries += [Number(value if of_family else None, 0) for value in score(of_family)]
        rows.append(entries)
    rows.append(['all', '', *(Number(value, 0) for cells in readings.values() for value in score(cells))])
    return Table('paper_scores', 'Cells of the paper that agree with ours', columns, rows, [SCORE_NOTE])


class PaperSection(NamedTuple):
    """What is shown of the paper, beside each reading of it: a dataset, or a set of its varied parameters."""

    scores: Table
    texts: List[str]  # the scores in sentences
    claims: Dict[str, List[ClaimResult]]  # by reading
    cells: List[Table]
    all_cells: Table  # too long to show
    errata: Table
    has_enough_trials: bool  # as many as the paper has: with few, nearly everything agrees


def paper_section(datasets: Sequence[Dataset]) -> Optional[PaperSection]:
    """Compare datasets with the paper; None where there is but one and it has no cell of the paper, or another robot.

    Raises:
        ConfigError: the file of the paper's numbers cannot be read, or one of several has no cell of the paper.
    """
    datasets = [of_paper(dataset) for dataset in datasets]
    comparisons = [compare_with_paper(dataset) for dataset in datasets]
    if len(datasets) == 1 and not comparisons[0].rows:
        return None
    for dataset, comparison in zip(datasets, comparisons):
        if not comparison.rows:
            raise ConfigError(
                f'{dataset.folder or dataset.title}: has no cell of the paper; '
                f"expected the paper's robot and tests (SL, SMT or DLD, navigated) with 40, 90, 1024 or 4096 PPR"
            )
    names = _names(datasets)
    readings = _readings(names, comparisons)
    return PaperSection(
        score_table(readings),
        [
            f'{label}: of {{0.compared}} cells of the paper {{0.agree}} agree with ours.'.format(score(cells))
            for label, cells in readings.items()
        ],
        _claims(names, datasets, readings),
        [resolution_table(comparisons[0]), *cell_tables(readings)],
        all_cells_table(readings),
        errata_table(),
        all(one.trials >= TRIALS for cells in readings.values() for one in cells),
    )


def _readings(names: Sequence[str], comparisons: Sequence[PaperComparison]) -> Readings:
    """Return the compared cells of each reading."""
    return {
        _label(name, varied): [one for one in comparison.rows if one.cell.varied == varied]
        for name, comparison in zip(names, comparisons)
        for varied in distinct(one.cell.varied for one in comparison.rows)
    }


def _claims(names: Sequence[str], datasets: Sequence[Dataset], readings: Readings) -> Dict[str, List[ClaimResult]]:
    """Return the results of all claims by reading."""
    claims: Dict[str, List[ClaimResult]] = {label: [] for label in readings}
    for name, dataset in zip(names, datasets):
        for result in check_claims(dataset):
            claims.setdefault(_label(name, result.varied), []).append(result)
    return {label: claims[label] for label in readings}


def _names(datasets: Sequence[Dataset]) -> List[str]:
    """Return names that differ: the titles, or else the folders, or else numbers; none where parameters tell enough."""
    if len(datasets) == 1 and varied_keys(datasets[0]):
        return ['']
    titles = [dataset.title for dataset in datasets]
    folders = [str(dataset.folder) for dataset in datasets]
    numbers = [f'{title} ({number})' for number, title in enumerate(titles, start=1)]
    return next(names for names in (titles, folders, numbers) if len(set(names)) == len(names))


def _label(name: str, varied: Varied) -> str:
    return ', '.join(filter(None, [name, *varied_texts(varied)]))
