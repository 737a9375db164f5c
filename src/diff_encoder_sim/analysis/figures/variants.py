"""Splits a dataset into variants, which have figures of their own."""

from __future__ import annotations

from typing import Dict, Iterable, List, NamedTuple

from diff_encoder_sim.analysis.dataset import CellKey, Dataset, TrialData, Varied, distinct
from diff_encoder_sim.analysis.table_keys import varied_texts
from diff_encoder_sim.trials.trials_csv import VARIANT


class Variant(NamedTuple):
    """Trials with the same values of all parameters that the campaign varies besides the encoder."""

    suffix: str  # of its figures' names; '' where there is one variant
    description: str  # for captions: the values; '' where nothing is varied
    labels: List[str]  # encoders of the whole dataset, ascending: the same colours in all
    cells: Dict[CellKey, List[TrialData]]

    def tests(self) -> List[str]:
        """Return the tests in the dataset's order."""
        return list(dict.fromkeys(cell.test for cell in self.cells))

    def of_test(self, test: str) -> Dict[str, List[TrialData]]:
        """Return the trials of a test by encoder, ascending."""
        return {cell.ppr: trials for cell, trials in self.cells.items() if cell.test == test}


def variants_of(dataset: Dataset) -> List[Variant]:
    """Split the dataset's trials by the values of the varied parameters.

    Of a campaign's named variants the first alone: the others are compared with it in a figure of their own.
    """
    cells = dataset.cells()
    all_varied = [varied for varied in distinct(cell.varied for cell in cells) if _is_of_first_variant(varied, cells)]
    return [
        Variant(
            '' if len(all_varied) == 1 else f'_variant{number}',
            ', '.join(varied_texts(varied)),
            dataset.encoders(),
            {cell: trials for cell, trials in cells.items() if cell.varied == varied},
        )
        for number, varied in enumerate(all_varied, start=1)
    ]


def _is_of_first_variant(varied: Varied, cells: Iterable[CellKey]) -> bool:
    first = next(iter(cells))
    return dict(varied).get(VARIANT) == dict(first.varied).get(VARIANT)
