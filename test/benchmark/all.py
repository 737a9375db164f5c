#!/usr/bin/env python3
"""Run the benchmarks that print ratios, and gather these as JSON; with --against, show what became slower since."""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import List, Sequence

from ratio_changes import changes
from ratios import Ratio, add_json, read_ratios, write_ratios
from sourced import ADVICE, is_sourced
from tabulate import tabulate

BENCHMARKS = (
    'lockstep.py',
    'start_up.py',
    'growth.py',
    'sweeps.py',
    'campaign.py',
    'campaign_overhead.py',
    'lidar.py',
    'live_graph.py',
    'wheel_nodes.py',
)
LIVE = ('live_graph.py', 'wheel_nodes.py')


def main() -> None:
    """Print all tables; the exit status is 1 where something became slower."""
    arguments = _arguments()
    before = read_ratios(arguments.against) if arguments.against else []
    now = [ratio for name in _runnable(arguments.only) for ratio in _run(name)]
    write_ratios(arguments.json, now)
    if arguments.against:
        sys.exit(_print_changes(before, now))


def _runnable(names: Sequence[str]) -> List[str]:
    """Leave out what needs ROS where there is none, and say so."""
    left_out = [name for name in names if name in LIVE and not is_sourced()]
    if left_out:
        print(f'without {", ".join(left_out)}: {ADVICE}\n', flush=True)
    return [name for name in names if name not in left_out]


def _run(name: str) -> List[Ratio]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'ratios.json'
        subprocess.run([sys.executable, str(Path(__file__).with_name(name)), '--json', str(path)], check=True)
        return read_ratios(path)


def _print_changes(before: List[Ratio], now: List[Ratio]) -> int:
    found = changes(before, now)
    rows = [
        [change.name, f'{change.before:.3g}', f'{change.now:.3g}', 'slower' if change.is_slower else '']
        for change in found
    ]
    print(f'\n{tabulate(rows, ["", "before", "now", ""], disable_numparse=True)}')
    return int(any(change.is_slower for change in found))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--against', type=Path, metavar='JSON', help='what --json wrote, on the same machine')
    parser.add_argument('--only', nargs='+', default=BENCHMARKS, choices=BENCHMARKS, metavar='SCRIPT')
    add_json(parser)
    return parser.parse_args()


if __name__ == '__main__':
    main()
