"""Ratios to a limit that is measured in the same run: as a table, and as JSON for all.py."""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence

from checkout import measured_on
from pydantic import Field, FiniteFloat
from tabulate import tabulate
from typing_extensions import Annotated

from diff_encoder_sim.base.atomic_files import write_file
from diff_encoder_sim.base.errors import ConfigError, in_one_line
from diff_encoder_sim.base.params import Params


class Ratio(NamedTuple):
    """Something that costs so many times what its limit costs, in each of some rounds."""

    name: str
    of: str  # the limit
    rounds: Annotated[Sequence[FiniteFloat], Field(min_length=1)]
    most: Optional[FiniteFloat] = None  # what it is to stay below; None: nothing is asked for

    @property
    def median(self) -> float:
        """Return the middle of the rounds."""
        return statistics.median(self.rounds)

    @property
    def limit(self) -> str:
        """Return what it is to stay below, and whether it does not, as text."""
        if self.most is None:
            return ''
        return f'{self.most:g}' if self.median < self.most else f'{self.most:g}, is above'


class Measured(Params):
    """What --json writes: the ratios of each script, and what they were measured on."""

    host: str
    python: str
    commit: str
    ratios: Dict[str, List[Ratio]]


def print_ratios(ratios: Sequence[Ratio]) -> None:
    """Print each with the range of its rounds."""
    rows = [
        [
            ratio.name,
            ratio.of,
            f'{ratio.median:.3g}',
            f'{min(ratio.rounds):.3g} to {max(ratio.rounds):.3g}',
            ratio.limit,
        ]
        for ratio in ratios
    ]
    print(tabulate(rows, ['', 'in units of', 'median', 'rounds', 'to be below'], disable_numparse=True))


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add the option for the file."""
    parser.add_argument('--json', type=_new_file, metavar='FILE', help='write the ratios, too')


def write_ratios(path: Optional[Path], ratios: Sequence[Ratio]) -> None:
    """Write the ratios of this script, where there is a file for them."""
    write_measured(path, {Path(sys.argv[0]).name: ratios})


def write_measured(path: Optional[Path], ratios: Mapping[str, Sequence[Ratio]]) -> None:
    """Write the ratios of each script, where there is a file for them."""
    if path is not None:
        by_script = {script: [_as_json(ratio) for ratio in several] for script, several in ratios.items()}
        text = json.dumps({**measured_on()._asdict(), 'ratios': by_script}, indent=1)
        write_file(path, text.encode())


def read_measured(path: Path) -> Measured:
    """Return what `write_measured` wrote.

    Raises:
        ConfigError: it cannot be read, or is nothing that --json writes.
    """
    try:
        content = json.loads(path.read_bytes())
    except OSError as error:
        raise ConfigError(f'{path}: {error.strerror}') from None
    except (ValueError, RecursionError) as error:
        raise ConfigError(f'{path}: {in_one_line(error)}; allowed: JSON that --json wrote') from None
    return Measured.from_mapping(content, str(path))


def _new_file(text: str) -> Path:
    """Return a path that can be written: before minutes of measuring, not after."""
    path = Path(text)
    if path.is_dir() or not os.access(path.parent, os.W_OK):
        raise argparse.ArgumentTypeError(f'given {text!r}; allowed: a file, in a folder that can be written to')
    return path


def _as_json(ratio: Ratio) -> Dict[str, Any]:
    return {**ratio._asdict(), 'rounds': [float(f'{value:.4g}') for value in ratio.rounds]}
