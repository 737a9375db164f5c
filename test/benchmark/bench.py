"""Shared by the benchmarks: command line, header with machine and commit, tables, ratios as JSON, plans of trials."""

from __future__ import annotations

import argparse
import importlib.util
import json
import math
import multiprocessing
import os
import platform
import statistics
import sys
from pathlib import Path
from typing import Any, Callable, List, NamedTuple, Optional, Sequence

import numpy as np
from tabulate import tabulate

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / 'test' / 'support'))
# With the workspace sourced the package is imported through catkin.
if importlib.util.find_spec('diff_encoder_sim') is None:
    sys.path.insert(1, str(ROOT / 'src'))  # after the scripts' folder, which package_environment leaves out

from diff_encoder_sim.base.bounds import Between  # noqa: E402 (found by the lines above)
from diff_encoder_sim.base.command_line import number_within  # noqa: E402
from diff_encoder_sim.base.processes import cpu_model, git  # noqa: E402
from diff_encoder_sim.base.se2 import wrap_angles  # noqa: E402
from diff_encoder_sim.drives.test_definition import find_world, load_test  # noqa: E402
from diff_encoder_sim.drives.trial_definition import Trial, TrialPlan  # noqa: E402

CONFIG, ALTO = ROOT / 'config', ROOT / 'urdf' / 'alto.urdf.xacro'
COUNT = number_within(Between(1, 1_000_000), int)
LEAST_CHANGE = 0.1  # medians that differ by less are equal


def parser(doc: Optional[str], has_ratios: bool = False, **counts: Any) -> argparse.ArgumentParser:
    """Return a parser with an option for each count, such as `trials=30`, and with --json and --against if wanted."""
    made = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in counts.items():
        made.add_argument(f'--{name}', type=COUNT, default=default, metavar='N', help='(default: %(default)s)')
    if has_ratios:
        made.add_argument('--json', type=Path, metavar='FILE', help='write the ratios')
        made.add_argument('--against', type=Path, metavar='FILE', help='report what became slower since --json FILE')
    return made


def print_header(title: str) -> None:
    host = f'{cpu_model()}, {os.cpu_count()} cores, {platform.system()} {platform.release()}'
    commit = git(ROOT, 'rev-parse', '--short', 'HEAD') or 'not a git checkout'
    changed = ' with changes' if git(ROOT, 'status', '--porcelain', 'src', 'urdf') else ''
    load = ', '.join(f'{value:.1f}' for value in os.getloadavg())
    python = platform.python_version()
    print(f'{title}\nmachine: {host}; load average {load}\npython:  {python}\ncommit:  {commit}{changed}\n', flush=True)


def print_table(rows: Sequence[Sequence[object]], heads: Sequence[str], names: int = 1) -> None:
    """Print rows of text and numbers; the first `names` columns are aligned left, the others right."""
    aligned = ['left'] * names + ['right'] * (len(heads) - names)
    texts = [[f'{cell:.4g}' if isinstance(cell, float) else str(cell) for cell in row] for row in rows]
    print(f'{tabulate(texts, heads, disable_numparse=True, colalign=aligned if rows else None)}\n', flush=True)


def minus(poses: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the differences of (..., 3) poses x [m], y [m], yaw [rad], in the axes of both."""
    differences = np.subtract(poses, others)
    differences[..., 2] = wrap_angles(differences[..., 2])
    return differences


def spreads(errors: np.ndarray) -> List[str]:
    """Return mean and standard deviation of (n, 3) errors x [m], y [m], yaw [rad], in mm and degrees."""
    shown = errors * (1e3, 1e3, math.degrees(1.0))
    return [
        f'{mean:+.{digits}f} ± {deviation:.{digits}f}'
        for mean, deviation, digits in zip(shown.mean(axis=0), shown.std(axis=0, ddof=1), (1, 1, 2))
    ]


class Ratio(NamedTuple):
    """Cost in units of a limit that is measured in the same run, in each of some rounds."""

    name: str
    of: str  # the limit
    rounds: Sequence[float]
    most: Optional[float] = None  # the median is to be below this


def report_ratios(options: argparse.Namespace, ratios: Sequence[Ratio]) -> None:
    """Print the ratios, write them to --json, and exit with 1 if one is slower than in --against.

    Slower: every round is above all rounds from before, and the median by more than LEAST_CHANGE.
    """
    old = {} if options.against is None else {tuple(each[:2]): each[2] for each in _read(options.against)}
    rows, slower = [], []
    for name, of, rounds, most in ratios:
        median, before = statistics.median(rounds), old.get((name, of))
        limit = '' if most is None else f'{most:g}' if median < most else f'{most:g}, is above'
        if before and min(rounds) > max(before) and median > (1.0 + LEAST_CHANGE) * statistics.median(before):
            slower.append(f'{name}: slower, before {statistics.median(before):.3g}, now {median:.3g}')
        rows.append([name, of, median, f'{min(rounds):.3g} to {max(rounds):.3g}', limit])
    print_table(rows, ['', 'in units of', 'median', 'rounds', 'to be below'], 2)
    if options.json:
        options.json.write_text(json.dumps(ratios))
    if slower:
        sys.exit('\n'.join(slower))


def _read(path: Path) -> List[Any]:
    try:
        return list(json.loads(path.read_text()))
    except (OSError, ValueError) as error:
        sys.exit(f'{path}: {error}; expected a file that --json wrote')


def plan_of(test: str, ppr: float, number: int, nav: str = 'embedded', bag: str = '') -> TrialPlan:
    """Return the plan of one trial of a test by its name; an empty `bag` is none."""
    definition = load_test(test, CONFIG)
    world = find_world(definition.world, ROOT / 'worlds')
    trial = Trial(test=definition, ppr={'left': ppr, 'right': ppr}, number=number, nav=nav)
    return TrialPlan(trial=trial, world=str(world), map=str(world.with_suffix('.yaml')), bag=bag)


def in_processes(work: Callable[[Any], Any], jobs: Sequence[Any], workers: int) -> List[Any]:
    with multiprocessing.Pool(workers) as pool:
        return pool.map(work, jobs, chunksize=1)


def package_environment() -> dict:
    return {**os.environ, 'PYTHONPATH': os.pathsep.join(filter(None, [*sys.path[1:]]))}
