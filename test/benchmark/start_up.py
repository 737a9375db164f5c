#!/usr/bin/env python3
"""How long a user waits: for --help of each command, and from `campaign` to its first finished trial, with kernels that
are still to be compiled (cold) and with those that this left (warm)."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Dict, List

from bench import ROOT, Ratio, package_environment, parser, print_header, report_ratios

# Wall time that is asked for [s].
MOST_OF_HELP = 0.3
MOST_OF_FIRST = {'cold': 25.0, 'warm': 8.0}
CAMPAIGN = ['--config', 'quick', '--tests', 'SL', '--ppr', '90', '--trials', '1', '--workers', '1']
LOOK_EVERY_S = 0.02


def main() -> None:
    arguments = parser(__doc__, has_ratios=True, repeats=7, campaigns=3).parse_args()
    print_header('Start-up, wall time')
    ratios = _until_help(arguments.repeats) + _until_first_trial(arguments.campaigns)
    report_ratios(arguments, ratios)


def _until_help(repeats: int) -> List[Ratio]:
    scripts = sorted(path for path in (ROOT / 'scripts').iterdir() if path.is_file() and 'parser=' in path.read_text())
    commands = {f'{path.name} --help': [str(path), '--help'] for path in scripts}
    bare_s = [_run_s(['-c', 'pass']) for _ in range(repeats)]
    helps_s = {name: [_run_s(words) for _ in range(repeats)] for name, words in commands.items()}
    helps = [Ratio(name, 's', rounds, MOST_OF_HELP) for name, rounds in helps_s.items()]
    return [Ratio('python -c pass', 's', bare_s), *helps]


def _run_s(words: List[str]) -> float:
    began_s = time.perf_counter()
    subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL, env=package_environment())
    return time.perf_counter() - began_s


def _until_first_trial(repeats: int) -> List[Ratio]:
    took_s: Dict[str, List[float]] = {state: [] for state in MOST_OF_FIRST}
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as kernels:
            for rounds in took_s.values():  # the first one compiles
                rounds.append(_first_trial_s({'NUMBA_CACHE_DIR': kernels}))
    name = 'campaign, to its first trial, '
    return [Ratio(name + state, 's', rounds, MOST_OF_FIRST[state]) for state, rounds in took_s.items()]


def _first_trial_s(kernels: Dict[str, str]) -> float:
    with tempfile.TemporaryDirectory() as folder, open(Path(folder) / 'said', 'wb') as said:
        words = [sys.executable, str(ROOT / 'scripts' / 'campaign'), *CAMPAIGN, '--out', f'{folder}/out']
        began_s = time.perf_counter()
        process = subprocess.Popen(words, env={**package_environment(), **kernels}, stdout=said, stderr=said)
        table = Path(folder) / 'out' / 'trials.csv'
        while process.poll() is None and not (table.is_file() and table.read_bytes().count(b'\n') > 1):
            time.sleep(LOOK_EVERY_S)
        took_s = time.perf_counter() - began_s
        if process.wait() != 0:
            sys.exit((Path(folder) / 'said').read_text(encoding='utf-8'))
    return took_s


if __name__ == '__main__':
    main()
