"""The mean errors that the paper's tables imply, beside ours: where a column is off, not only scattered."""

from __future__ import annotations

from collections import defaultdict
from typing import Dict, List, Tuple

import numpy as np

from diff_encoder_sim.analysis.dataset import Dataset, distinct
from diff_encoder_sim.analysis.final_errors import final_errors
from diff_encoder_sim.analysis.paper.errata import errata_of
from diff_encoder_sim.analysis.paper.implied_means import MeanEstimator
from diff_encoder_sim.analysis.paper.paper_cells import STATISTICS, load_paper_cells
from diff_encoder_sim.analysis.quantities import QUANTITIES, Quantity
from diff_encoder_sim.analysis.sample_statistics import mean_interval
from diff_encoder_sim.analysis.table import Column, Entry, Table
from diff_encoder_sim.analysis.table_keys import cell_text
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource

NOTE = (
    'Final pose minus goal; in brackets 95 %. The paper prints no means: its min, max, standard deviation and per cent '
    'within imply them, if errors scatter evenly about the mean. –: not known, or an erratum.'
)

PaperRow = Dict[Quantity, Dict[str, float]]  # what is printed, by statistic


def mean_table(datasets: Dict[str, Dataset]) -> Table:
    """Build the table of means of all cells that the paper and a dataset have, with a column for each dataset by name.

    Raises:
        ConfigError: the file of the paper's numbers cannot be read.
    """
    labels = ['ours'] if len(datasets) == 1 else list(datasets)
    columns = [Column('source', 'source'), Column('cell', 'cell')]
    columns += [
        Column(f'{quantity.name}_{whose}', whose, quantity.head)
        for quantity in QUANTITIES
        for whose in ('paper', *labels)
    ]
    estimator, ours = MeanEstimator(), [dataset.cells() for dataset in datasets.values()]
    rows: List[List[Entry]] = []
    for (source, *of_paper), printed in _paper_rows().items():
        for cell in distinct(one for cells in ours for one in cells if [one.test, one.ppr] == of_paper):
            entries: List[Entry] = [TOPIC_OF_SOURCE[source], cell_text(cell)]
            for quantity in QUANTITIES:
                entries.append(_paper_text(estimator, printed[quantity], quantity))
                entries += [_our_text(final_errors(cells.get(cell, []), source, quantity)) for cells in ours]
            rows.append(entries)
    return Table('paper_means', "Means that the paper's numbers imply, and ours", columns, rows, [NOTE])


def _paper_rows() -> Dict[Tuple[PoseSource, str, str], PaperRow]:
    rows: Dict[Tuple[PoseSource, str, str], PaperRow] = defaultdict(lambda: {quantity: {} for quantity in QUANTITIES})
    for cell in load_paper_cells():
        if not errata_of(cell):
            rows[cell.source, cell.test, cell.ppr][cell.quantity][cell.statistic] = cell.value
    return rows


def _paper_text(estimator: MeanEstimator, printed: Dict[str, float], quantity: Quantity) -> str:
    if len(printed) < len(STATISTICS):
        return '–'
    implied = estimator.estimate(printed, quantity.tolerance)
    return '–' if implied is None else _text(*implied)


def _our_text(values: np.ndarray) -> str:
    return '–' if len(values) < 2 else _text(float(values.mean()), *mean_interval(values))


def _text(value: float, low: float, high: float) -> str:
    return f'{value:.3f} ({low:.3f} to {high:.3f})'
