#!/usr/bin/env python3
"""How processor time and memory grow with the size of maps, the length of routes and the number of trials.

A cost in proportion to the size has the exponent 1. Each size is measured in its own process, several times.
"""

from __future__ import annotations

import math
import multiprocessing
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Callable, Dict, List, NamedTuple, Sequence

import bench
import numpy as np

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.test_definition import Segment, TestDefinition
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_params import CostmapParams
from diff_encoder_sim.navigation.global_planner import GlobalPlanner
from diff_encoder_sim.navigation.navigator_params import NavfnParams
from diff_encoder_sim.trials.campaign_cells import Campaign
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.results import ResultStore
from diff_encoder_sim.trials.robot_params import load_robot_config, override
from diff_encoder_sim.trials.trials_csv import TABLE, TrialRow, table_of
from lockstep_trials import run_trial

Work = Callable[[], object]
RESOLUTION_M, PILLARS_APART_M, PILLAR_M, STRETCH_M = 0.1, 5.0, 0.4, 10.0
# Of final errors with the coarsest encoder: x [m], y [m], yaw [rad].
SPREAD, TIMED_OUT_FRACTION = np.array([0.02, 0.05, 0.02]), 0.01
LEAST_S, LEAST_MEMORY_BYTES = 5e-3, 4e6  # below these, most of a cost does not depend on the size
MOST = 1.5  # growth of the cost per unit from the last size but one to the last


class Cost(NamedTuple):
    """Processor time of a process and its children, and the peak of its memory above the start."""

    user_s: float
    memory_bytes: float


def likelihood_field(side_m: int, folder: Path) -> Work:
    amcl, grid = Amcl(AmclParams(), _grid(5), np.random.default_rng(0)), _grid(side_m)
    return lambda: amcl.set_map(grid)


def global_plan(side_m: int, folder: Path) -> Work:
    planner, corner_m = GlobalPlanner(NavfnParams(), Costmap(CostmapParams(), _grid(side_m))), 0.5 * side_m - 1.0
    return lambda: planner.make_plan(Pose2D(-corner_m, -corner_m, 0.0), Pose2D(corner_m, corner_m, 0.0))


def scripted_trial(length_m: int, folder: Path) -> Work:
    """Run a scripted trial to and fro in the hallway, with its bag."""
    stretches = [Segment(straight=STRETCH_M * (-1) ** number) for number in range(round(length_m / STRETCH_M))]
    test = TestDefinition(name='to_and_fro', world='hallway', drive=stretches)
    plan, params = (
        bench.plan_of('SL', 90, 1, 'scripted', str(folder / 'trial.bag')),
        override(load_robot_config(bench.CONFIG), {}),
    )
    plan = plan.model_copy(update={'trial': plan.trial.model_copy(update={'test': test})})
    return lambda: run_trial(plan, bench.ALTO, params, 'minimal')


def resuming(trials: int, folder: Path) -> Work:
    campaign = _make_results(folder / 'results', math.ceil(trials / 12))
    return lambda: ResultStore(folder / 'results', campaign, {}).finish()


def analyzing(trials: int, folder: Path) -> Work:
    """Run analyze on the results of the paper's cells."""
    _make_results(folder / 'results', math.ceil(trials / 12))
    command = [sys.executable, str(bench.ROOT / 'scripts' / 'analyze'), str(folder / 'results')]
    return lambda: subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=bench.package_environment())


def _make_results(folder: Path, trials: int) -> Campaign:
    """Write results of the paper's cells that are sampled, not simulated, with this number of trials each."""
    campaign = load_campaign('paper', bench.ROOT, {'trials': trials, 'record': 'none'})
    ResultStore(folder, campaign, {}).finish()
    rng, rows = np.random.default_rng(1), []
    for job in campaign.trials():
        spread = SPREAD * campaign.cells[0].encoder.ppr.left / job.cell.encoder.ppr.left
        errors = {source: Pose2D(*rng.normal(0.0, spread).tolist()) for source in PoseSource}
        outcome = Outcome.TIMED_OUT if rng.random() < TIMED_OUT_FRACTION else Outcome.SUCCEEDED
        rows.append(TrialRow(*job.identity(), outcome, '', 60.0, errors, 20.0, 1.0, ''))
    (folder / TABLE).write_bytes(table_of(rows, list(campaign.params.varied_values)))
    return campaign


SIDES_M, TRIALS = (20, 50, 100, 200, 500), (12, 120, 1200, 12_000, 100_000)
GROWTHS: Dict[str, tuple] = {  # title: work, sizes, power of the size that the cost is in proportion to
    'likelihood field, by side [m]': (likelihood_field, SIDES_M, 2),
    'global plan, by side [m]': (global_plan, SIDES_M, 2),
    'scripted trial, by route [m]': (scripted_trial, (10, 100, 1000), 1),
    'opening a finished campaign, by trials': (resuming, TRIALS, 1),
    'analyze, by trials': (analyzing, TRIALS, 1),
}


def main() -> None:
    made = bench.parser(__doc__, has_ratios=True, repeats=2)
    made.add_argument('--only', choices=list(GROWTHS), help='one of the tables')
    arguments = made.parse_args()
    bench.print_header('Growth of processor time and memory')
    titles = [arguments.only] if arguments.only else list(GROWTHS)
    ratios = [_measure(title, *GROWTHS[title], arguments.repeats) for title in titles]
    bench.report_ratios(arguments, ratios)


def _measure(
    title: str, prepare: Callable[[int, Path], Work], sizes: Sequence[int], power: int, repeats: int
) -> bench.Ratio:
    rounds = [[_cost(prepare, size) for size in sizes] for _ in range(repeats)]
    costs = [Cost(*map(min, zip(*of_size))) for of_size in zip(*rounds)]
    units = [size**power for size in sizes]
    times_s, memories_bytes = zip(*costs)
    columns = [
        sizes,
        [f'{time_s:.3f}' for time_s in times_s],
        _exponents(units, times_s, LEAST_S),
        [f'{memory_bytes / 1e6:.0f}' for memory_bytes in memories_bytes],
        _exponents(units, memories_bytes, LEAST_MEMORY_BYTES),
    ]
    heads = [title, 'processor [s]', 'exponent', 'memory [MB]', 'exponent']
    bench.print_table(list(zip(*columns)), heads)
    by_round = [each[-1].user_s / each[-2].user_s * units[-2] / units[-1] for each in rounds]
    return bench.Ratio(f'{title}: {sizes[-1]}', f'in proportion to {sizes[-2]}', by_round, MOST)


def _exponents(units: Sequence[int], costs: Sequence[float], least: float) -> List[str]:
    """Return the exponent from each size to the next, as text; '' if a cost is not above `least`."""
    found = ['']
    for small, large, before, after in zip(units, units[1:], costs, costs[1:]):
        is_measured = min(before, after) > least
        found.append(f'{math.log(after / before) / math.log(large / small):.2f}' if is_measured else '')
    return found


def _cost(prepare: Callable[[int, Path], Work], size: int) -> Cost:
    """Return the cost in a forked process, which has no memory of other sizes."""
    with multiprocessing.get_context('fork').Pool(1) as pool:
        return pool.apply(_measured, (prepare, size))


def _measured(prepare: Callable[[int, Path], Work], size: int) -> Cost:
    with tempfile.TemporaryDirectory() as folder:
        work = prepare(size, Path(folder))
        Path('/proc/self/clear_refs').write_text('5')  # resets the peak
        began_bytes, began_s = _resident_bytes('VmRSS'), _user_s()
        work()
        started_bytes = 1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
        return Cost(_user_s() - began_s, max(_resident_bytes('VmHWM') - began_bytes, started_bytes))


def _user_s() -> float:
    return sum(resource.getrusage(who).ru_utime for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def _resident_bytes(name: str) -> int:
    lines = Path('/proc/self/status').read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(name))


def _grid(side_m: int) -> OccupancyGrid:
    """Return a square map around the origin: a wall around it, and a pillar in each 5 m square."""
    cells, apart, wide = (round(length_m / RESOLUTION_M) for length_m in (side_m, PILLARS_APART_M, PILLAR_M))
    grid = np.full((cells, cells), FREE, np.int8)
    grid[[0, 1, -2, -1]], grid[:, [0, 1, -2, -1]] = OCCUPIED, OCCUPIED
    has_pillar = (np.arange(cells) - apart // 2) % apart < wide
    grid[np.ix_(has_pillar, has_pillar)] = OCCUPIED
    return OccupancyGrid(grid, RESOLUTION_M, Pose2D(-0.5 * side_m, -0.5 * side_m, 0.0))


if __name__ == '__main__':
    main()
