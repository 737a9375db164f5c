"""The trials that are shown one by one, where there are more than a page can hold."""

from __future__ import annotations

from diff_encoder_sim.analysis.dataset import Dataset

# Of more trials, some are shown: the report stays below 5 MB.
MOST_SHOWN = 2000


def first_of_cells(dataset: Dataset) -> Dataset:
    """Return the dataset with the first trials of each cell, equally many: `MOST_SHOWN` in all, or one of each cell.

    First ones have equal numbers in all cells, and are as good a sample as any: trials differ by seed alone.
    """
    cells = dataset.cells()
    if len(dataset.trials) <= MOST_SHOWN:
        return dataset
    of_each = max(1, MOST_SHOWN // len(cells))
    return dataset._replace(trials=[trial for trials in cells.values() for trial in trials[:of_each]])


def sample_text(shown: Dataset, whole: Dataset) -> str:
    """Return which trials of a dataset are shown; '' where all are."""
    if len(shown.trials) == len(whole.trials):
        return ''
    most = max(map(len, shown.cells().values()))
    return f'The first {most} trials of each cell, of {len(whole.trials)}'
