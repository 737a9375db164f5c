"""The key columns of all tables, and the names of cells and of varied parameters."""

from __future__ import annotations

from typing import List, Sequence

from diff_encoder_sim.analysis.dataset import CellKey, Dataset, Varied, distinct
from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.table import Column
from diff_encoder_sim.trials.trials_csv import VARIANT


def cell_text(cell: CellKey) -> str:
    """Return a cell as tables show it: `SL, 90 PPR`."""
    return ', '.join([cell.test, ppr_text(cell.ppr), *varied_texts(cell.varied)])


def setup_text(test: str, varied: Varied) -> str:
    """Return a test with its varied parameters as tables show it."""
    return ', '.join([test, *varied_texts(varied)])


def varied_texts(varied: Varied) -> List[str]:
    """Return each parameter with its value; a variant's name says what it is."""
    return [value if key == VARIANT else f'{key} {value}' for key, value in varied]


def varied_keys(dataset: Dataset) -> List[str]:
    """Return the names of all varied parameters; each has a column."""
    return distinct(key for trial in dataset.trials for key, _ in trial.varied)


def key_columns(keys: Sequence[str]) -> List[Column]:
    """Return the first columns of a table: the test, and each of `varied_keys`."""
    return [Column('test', 'test'), *(Column(key, key) for key in keys)]


def key_entries(test: str, varied: Varied, keys: Sequence[str]) -> List[str]:
    """Return an entry for each of `key_columns`, empty where a key is not varied."""
    return [test, *(dict(varied).get(key, '') for key in keys)]
