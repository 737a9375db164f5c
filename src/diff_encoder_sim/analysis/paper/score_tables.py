"""The scores of one or more readings of the paper as a table, and which of them fits best in a sentence."""

from __future__ import annotations

from typing import List, Optional, Sequence

from diff_encoder_sim.analysis.dataset import distinct
from diff_encoder_sim.analysis.paired_statistics import SIGNIFICANCE
from diff_encoder_sim.analysis.paper.paper_comparison import ComparedCell
from diff_encoder_sim.analysis.paper.scores import Readings, Score, better_fit, score, scores_by_family
from diff_encoder_sim.analysis.table import Column, Entry, Number, Table
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE

HEADS = {'compared': 'compared', 'inside': 'inside', 'alone': 'agree alone', 'in_family': 'agree in family'}
NOTES = (
    (
        'Inside: the paper\'s number lies in our 95 % interval (in brackets in "Cells side by side"). That leaves out '
        'the sampling error of its own 30 trials: of equal robots, five in six standard deviations would be inside.'
    ),
    (
        'Alone: p at least 0.05 with the sampling error of both (standard deviation: F-test, careful where our '
        "tails are heavy; % within: Fisher's exact test; min and max: ranks, and beyond all of ours an exponential "
        'tail). Of equal robots, up to one in twenty would not agree.'
    ),
    (
        'In family: the cells of a row of this table are judged together (p at least 0.05 after Holm). Of equal '
        'robots, one row in twenty would have a cell that does not agree.'
    ),
    (
        'Not counted are cells that the errata affect, the numbers that config/campaigns/paper.yaml was fitted to, and '
        'minima and maxima that nothing can be concluded from. Cells are dependent: x, y and heading of a cell are '
        'of the same trials, so are its four statistics, and equal trials have equal noise with each encoder.'
    ),
)
_ALL = 'all'


def score_table(readings: Readings) -> Table:
    """Count the cells that agree by source and test, with a group of columns for each of several readings."""
    columns = [Column('source', 'source'), Column('test', 'test')]
    for label in readings:
        group = label if len(readings) > 1 else ''
        columns += [Column(f'{group}_{name}'.lstrip('_'), head, group) for name, head in HEADS.items()]
    by_family = [scores_by_family(cells) for cells in readings.values()]
    rows: List[List[Entry]] = []
    for source, test in distinct(key for scores in by_family for key in scores):
        rows.append([TOPIC_OF_SOURCE[source], test, *_entries([scores.get((source, test)) for scores in by_family])])
    rows.append([_ALL, '', *_entries([score(cells) for cells in readings.values()])])
    return Table('paper_scores', 'Cells of the paper that agree with ours', columns, rows, list(NOTES))


def score_text(label: str, cells: List[ComparedCell]) -> str:
    """Return the total score of a reading in a sentence."""
    total = score(cells)
    return (
        f'{label}: of {total.compared} cells of the paper {total.inside} are inside our 95 % interval; {total.alone} '
        f'agree, each alone; {total.in_family} agree in their families.'
    )


def fit_texts(readings: Readings) -> List[str]:
    """Compare the first reading with each other in a sentence; they should have equal trials."""
    if not readings:
        return []
    (first, cells), *others = readings.items()
    return [_fit_text(first, cells, label, other) for label, other in others]


def _fit_text(first: str, first_cells: List[ComparedCell], second: str, second_cells: List[ComparedCell]) -> str:
    fit = better_fit(first_cells, second_cells)
    more = first if fit.only[0] > fit.only[1] else second
    if fit.grouped_p < SIGNIFICANCE:
        conclusion = f'{more} fits the paper better'
    elif fit.only[0] == fit.only[1]:
        conclusion = f'{first} and {second} fit the paper equally well'
    else:
        conclusion = f'{more} fits the paper better, but by no more than chance explains'
    return (
        f'Over equal trials, {conclusion}: {fit.only[0]} cells agree with {first} alone, {fit.only[1]} with {second} '
        f'alone (p {fit.grouped_p:.2g} by the signed ranks of the tests and encoders, whose cells share their trials; '
        f'McNemar over cells, as if they were independent: p {fit.mcnemar_p:.2g}).'
    )


def _entries(scores: Sequence[Optional[Score]]) -> List[Entry]:
    return [Number(value, 0) for each in scores for value in (each or [None] * len(HEADS))]
