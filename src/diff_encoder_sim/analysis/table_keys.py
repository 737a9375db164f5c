"""What rows and columns of all tables are known by: encoders, cells and what is varied."""
from __future__ import annotations

from typing import List, Sequence

from diff_encoder_sim.analysis.dataset import IDEAL, Cell, Dataset, Varied

LEVEL = 0.95        # of all intervals in tables


def ppr_head(label: str) -> str:
    """An encoder for people."""
    return 'ideal odometry' if label == IDEAL else f'{label} PPR'


def cell_head(cell: Cell) -> str:
    """A cell for people."""
    varied = ''.join(f', {key} {value}' for key, value in cell.varied)
    return f'{cell.test}, {ppr_head(cell.ppr)}{varied}'


def varied_keys(dataset: Dataset) -> List[str]:
    """Names of all parameters that are varied: a column each."""
    return list(dict.fromkeys(key for trial in dataset.trials for key, _ in trial.varied))


def varied_values(varied: Varied, keys: Sequence[str]) -> List[str]:
    """A value for each key, empty where it is not varied."""
    return [dict(varied).get(key, '') for key in keys]
