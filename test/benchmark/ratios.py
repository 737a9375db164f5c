"""Ratios to a limit that is measured in the same run: as a table, and as JSON for all.py."""

from __future__ import annotations

import argparse
import json
import statistics
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Sequence

from tabulate import tabulate


class Ratio(NamedTuple):
    """Something that costs so many times what its limit costs, in each of some rounds."""

    name: str
    of: str  # the limit
    rounds: Sequence[float]
    most: Optional[float] = None  # what it is to stay below; None: nothing is asked for

    @property
    def median(self) -> float:
        """Return the middle of the rounds."""
        return statistics.median(self.rounds)


def print_ratios(ratios: Sequence[Ratio]) -> None:
    """Print each with the range of its rounds."""
    rows = [
        [
            ratio.name,
            ratio.of,
            f'{ratio.median:.3g}',
            f'{min(ratio.rounds):.3g} to {max(ratio.rounds):.3g}',
            '' if ratio.most is None else f'{ratio.most:g}',
        ]
        for ratio in ratios
    ]
    print(tabulate(rows, ['', 'in units of', 'median', 'rounds', 'to be below'], disable_numparse=True))


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add the option for the file."""
    parser.add_argument('--json', type=Path, metavar='FILE', help='write the ratios, too')


def write_ratios(path: Optional[Path], ratios: Sequence[Ratio]) -> None:
    """Write the ratios, where there is a file for them."""
    if path is not None:
        path.write_text(json.dumps([_as_json(ratio) for ratio in ratios], indent=1), encoding='utf-8')


def read_ratios(path: Path) -> List[Ratio]:
    """Return what `write_ratios` wrote."""
    return [Ratio(**fields) for fields in json.loads(path.read_text(encoding='utf-8'))]


def _as_json(ratio: Ratio) -> Dict[str, Any]:
    return {**ratio._asdict(), 'rounds': [float(f'{value:.4g}') for value in ratio.rounds]}
