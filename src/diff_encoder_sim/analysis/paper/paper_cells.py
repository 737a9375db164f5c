"""The paper's tables 4 to 6 as data."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Union

from diff_encoder_sim.analysis.quantities import QUANTITIES, Quantity
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.drives.topics import PoseSource

TRIALS = 30  # behind each cell
PPRS = ('40', '90', '1024', '4096')
STATISTICS = ('min', 'max', 'std', 'pct_within')

# The names in the file.
_SOURCES = {'odom': PoseSource.ODOM, 'world_pose': PoseSource.WORLD, 'global_pose': PoseSource.GLOBAL}
_QUANTITIES = {quantity.name: quantity for quantity in QUANTITIES}


class PaperCell(NamedTuple):
    """One number of the paper's tables."""

    table: int
    source: PoseSource
    test: str
    ppr: str  # encoder label
    quantity: Quantity
    statistic: str  # of STATISTICS
    value: float  # [m], [deg] or per cent


def load_paper_cells(path: Optional[Union[str, Path]] = None) -> List[PaperCell]:
    """Load the cells in the file's order from config/paper/tables_4_5_6.csv, unless another file is given.

    Raises:
        ConfigError: the file cannot be read, or a line of it is bad.
    """
    path = Path(path or package_folder() / 'config' / 'paper' / 'tables_4_5_6.csv')
    try:
        with path.open(newline='', encoding='utf-8') as file:
            return [_cell(row) for row in csv.DictReader(file)]
    except OSError as error:
        raise ConfigError(f'{path}: cannot be read: {error.strerror}') from None
    except (KeyError, ValueError, TypeError) as error:
        raise ConfigError(f'{path}: {error}; allowed: lines as in {path.parent / "README.md"}') from None


def _cell(row: Dict[str, str]) -> PaperCell:
    return PaperCell(
        int(row['table']),
        _SOURCES[row['source']],
        row['test'],
        row['ppr'],
        _QUANTITIES[row['quantity']],
        row['statistic'],
        float(row['value']),
    )
