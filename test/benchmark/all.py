#!/usr/bin/env python3
"""Run the benchmarks that print ratios, and gather these as JSON; with --against, show what became slower since."""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Dict, List, Sequence

from checkout import measured_on
from ratio_changes import changes, one_sided
from ratios import Measured, Ratio, add_json, read_measured, write_measured
from sourced import ADVICE, is_sourced
from tabulate import tabulate

from diff_encoder_sim.base.command_start import STOPPED
from diff_encoder_sim.base.errors import ConfigError

BENCHMARKS = ('lockstep.py', 'start_up.py', 'growth.py', 'campaign.py', 'kernels.py', 'live_graph.py')
LIVE = ('live_graph.py',)


def main() -> None:
    """Print all tables; the exit status is 1 where something failed, is missing or became slower."""
    arguments = _arguments()
    now: Dict[str, List[Ratio]] = {}
    failed = []
    try:
        for name in _runnable(arguments.only):
            if not _run(name, now):
                failed.append(name)
            write_measured(arguments.json, now)  # after each: what is measured stays, whatever comes
    except KeyboardInterrupt:
        print(f'all.py: stopped; measured were: {", ".join(now) or "none"}', file=sys.stderr)
        sys.exit(STOPPED)
    status = _print_changes(arguments.against, arguments.only, now) if arguments.against else 0
    if failed:
        sys.exit(f'all.py: failed: {", ".join(failed)}')
    sys.exit(status)


def _runnable(names: Sequence[str]) -> List[str]:
    """Leave out what needs ROS where there is none, and say so."""
    left_out = [name for name in names if name in LIVE and not is_sourced()]
    if left_out:
        print(f'without {", ".join(left_out)}: {ADVICE}\n', flush=True)
    return [name for name in names if name not in left_out]


def _run(name: str, now: Dict[str, List[Ratio]]) -> bool:
    """Add a script's ratios, also those of one that failed after it had written them; return whether it did not."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'ratios.json'
        done = subprocess.run([sys.executable, str(Path(__file__).with_name(name)), '--json', str(path)], check=False)
        if path.exists():
            now.update(read_measured(path).ratios)
    return done.returncode == 0


def _print_changes(then: Measured, asked_for: Sequence[str], now: Dict[str, List[Ratio]]) -> int:
    """Compare the scripts that were asked for; return the exit status."""
    before = [ratio for script in asked_for for ratio in then.ratios.get(script, [])]
    measured = [ratio for ratios in now.values() for ratio in ratios]
    found = changes(before, measured)
    rows = [
        [change.name, f'{change.before:.3g}', f'{change.now:.3g}', change.limit, 'slower' if change.is_slower else '']
        for change in found
    ]
    print(f'\n{tabulate(rows, ["", "before", "now", "to be below", ""], disable_numparse=True)}')
    missing, new = one_sided(before, measured)
    for title, names in (('only before', missing), ('only now', new)):
        print(''.join(f'{title}: {name}\n' for name in names), end='')
    _print_difference(then)
    return int(bool(missing) or any(change.is_slower for change in found))


def _print_difference(then: Measured) -> None:
    """Say where numbers may differ for another reason than a change of this package."""
    here = measured_on()
    for what, before, now in (('host', then.host, here.host), ('python', then.python, here.python)):
        if before != now:
            print(f'another {what} before: {before}; now: {now}')


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--against', type=_measured, metavar='JSON', help='what --json wrote, on the same machine')
    parser.add_argument('--only', nargs='+', default=BENCHMARKS, choices=BENCHMARKS, metavar='SCRIPT')
    add_json(parser)
    arguments = parser.parse_args()
    if arguments.against and not set(arguments.only).intersection(arguments.against.ratios):
        given = ', '.join(arguments.against.ratios) or 'nothing'
        parser.error(f'argument --against: given results of {given}; allowed: of {", ".join(arguments.only)}')
    return arguments


def _measured(text: str) -> Measured:
    try:
        return read_measured(Path(text))
    except ConfigError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


if __name__ == '__main__':
    main()
