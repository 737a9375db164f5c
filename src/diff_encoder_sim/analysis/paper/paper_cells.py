"""The paper's tables 4 to 6 as data, and our final errors in their terms."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from diff_encoder_sim.analysis.dataset import TrialData
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.paths import package_folder

TRIALS = 30  # behind each cell
PPRS = ('40', '90', '1024', '4096')
STATISTICS = ('min', 'max', 'std', 'pct_within')

# Names of /world_pose and /global_pose in a campaign's results.
_SOURCES = {'odom': 'odom', 'world_pose': 'world', 'global_pose': 'global'}


class Quantity(NamedTuple):
    """A component of the final pose minus the goal, as the paper has it."""

    name: str  # with its unit
    component: int  # of TrialData.errors
    scale: float  # from SI to the paper's unit
    tolerance: float  # in the paper's unit

    @property
    def axis(self) -> str:
        """Without the unit: x, y or yaw."""
        return self.name.rpartition('_')[0]

    @property
    def unit(self) -> str:
        """Of scaled errors: m or deg."""
        return self.name.rpartition('_')[2]

    @property
    def head(self) -> str:
        """For people."""
        return f'{self.axis} [{self.unit}]'


QUANTITIES = (
    Quantity('x_m', 0, 1.0, 0.05),
    Quantity('y_m', 1, 1.0, 0.05),
    Quantity('yaw_deg', 2, 180.0 / math.pi, 3.0),
)
X, Y, YAW = QUANTITIES


class PaperCell(NamedTuple):
    """One number of the paper."""

    table: int
    source: str  # of campaign.row.SOURCES
    test: str
    ppr: str  # as in analysis.dataset
    quantity: Quantity
    statistic: str  # of STATISTICS
    value: float  # [m], [deg] or per cent


def load_paper_cells(path: Optional[Union[str, Path]] = None) -> List[PaperCell]:
    """The cells in the file's order; config/paper/tables_4_5_6.csv unless another is given.

    Raises:
        ConfigError: the file cannot be read, or a line of it is bad.
    """
    path = Path(path or package_folder() / 'config' / 'paper' / 'tables_4_5_6.csv')
    by_name = {quantity.name: quantity for quantity in QUANTITIES}
    try:
        with path.open(newline='', encoding='utf-8') as file:
            return [
                PaperCell(
                    int(row['table']),
                    _SOURCES[row['source']],
                    row['test'],
                    row['ppr'],
                    by_name[row['quantity']],
                    row['statistic'],
                    float(row['value']),
                )
                for row in csv.DictReader(file)
            ]
    except OSError as error:
        raise ConfigError(f'{path}: cannot be read: {error.strerror}') from None
    except (KeyError, ValueError, TypeError) as error:
        raise ConfigError(f'{path}: {error}; allowed: lines as in {path.parent / "README.md"}') from None


def with_final_error(trials: Sequence[TrialData], source: str) -> List[TrialData]:
    """The trials that a cell of the paper would pool: however they ended, as there.

    Of a torn bag nobody knows where it would have ended.
    """
    return [trial for trial in trials if trial.outcome != 'torn' and trial.errors.get(source) is not None]


def equal_trials(
    first: Sequence[TrialData], second: Sequence[TrialData], source: str
) -> Tuple[List[TrialData], List[TrialData]]:
    """Of two cells the trials of equal number that both have a final error, in one order."""
    of_first, of_second = (
        {trial.trial: trial for trial in with_final_error(trials, source)} for trials in (first, second)
    )
    numbers = [number for number in of_first if number in of_second]
    return [of_first[number] for number in numbers], [of_second[number] for number in numbers]


def final_errors(trials: Sequence[TrialData], source: str, quantity: Quantity) -> np.ndarray:
    """(n,) final pose minus goal of `with_final_error`, in the paper's unit."""
    return quantity.scale * np.array(
        [trial.errors[source][quantity.component] for trial in with_final_error(trials, source)]
    )


def count_within(values: np.ndarray, quantity: Quantity) -> int:
    """How many errors are within the paper's tolerance."""
    return int(np.count_nonzero(np.abs(values) <= quantity.tolerance))


def count_within_all(trials: Sequence[TrialData], source: str, quantities: Sequence[Quantity] = QUANTITIES) -> int:
    """How many of `with_final_error` are within the tolerances of all quantities at once."""
    return int(
        np.count_nonzero(
            np.all(
                [np.abs(final_errors(trials, source, quantity)) <= quantity.tolerance for quantity in quantities],
                axis=0,
            )
        )
    )
