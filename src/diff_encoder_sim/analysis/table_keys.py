"""What rows and columns of all tables are known by: encoders, cells and what is varied."""

from __future__ import annotations

from typing import List, Sequence

from diff_encoder_sim.analysis.dataset import IDEAL, Cell, Dataset, Varied
from diff_encoder_sim.analysis.table_files import Column


def ppr_head(label: str) -> str:
    """An encoder for people."""
    return 'ideal odometry' if label == IDEAL else f'{label} PPR'


def cell_head(cell: Cell) -> str:
    """A cell for people."""
    return ', '.join([cell.test, ppr_head(cell.ppr), *varied_texts(cell.varied)])


def head_of_test(test: str, varied: Varied) -> str:
    """A test with one set of parameters, for people."""
    return ', '.join([test, *varied_texts(varied)])


def varied_texts(varied: Varied) -> List[str]:
    """Each parameter with its value."""
    return [f'{key} {value}' for key, value in varied]


def varied_keys(dataset: Dataset) -> List[str]:
    """Names of all parameters that are varied: a column each."""
    return list(dict.fromkeys(key for trial in dataset.trials for key, _ in trial.varied))


def key_columns(keys: Sequence[str]) -> List[Column]:
    """The first columns of a table: the test, and each of `varied_keys`."""
    return [Column('test', 'test'), *(Column(key, key) for key in keys)]


def key_entries(test: str, varied: Varied, keys: Sequence[str]) -> List[str]:
    """An entry for each of `key_columns`, empty where a key is not varied."""
    return [test, *(dict(varied).get(key, '') for key in keys)]
