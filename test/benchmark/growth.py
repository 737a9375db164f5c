#!/usr/bin/env python3
"""How processor time and memory grow with map size, route length, particles, beams and trials: a table each, with the
exponents between neighbours. A cost in proportion to the size has the exponent 1. Each size is measured in a process of
its own. What the system spends, most of it on giving new pages of memory, is apart: it depends on the machine."""

from __future__ import annotations

import argparse
import math
import multiprocessing
import resource
from pathlib import Path
from typing import Callable, List, NamedTuple, Sequence

import growing_work as work
import numpy as np
from checkout import print_header
from counts import COUNT
from ratios import Ratio, add_json, print_ratios, write_ratios
from tabulate import tabulate

SIDES_M = (20, 50, 100, 200, 500)
# Below these, what does not depend on the size is the larger part.
LEAST_S, LEAST_MEMORY_BYTES = 5e-3, 4e6


class Growth(NamedTuple):
    """Something that is measured by size."""

    name: str
    prepare: Callable[[int], work.Work]
    sizes: Sequence[int]
    longest: Sequence[int] = ()  # sizes that take minutes
    power: int = 1  # what is in proportion grows by this power of the size: cells by the square of a side
    most: float = 1.5  # that the cost per unit may grow from the last size but one to the last
    reason: str = ''  # why it grows by more


class Cost(NamedTuple):
    """What one size takes."""

    user_s: float  # processor time
    system_s: float
    memory_bytes: float  # at most, beside what there was before; of a process that it starts, all


GROWTHS = (
    Growth('reading a map, by side [m]', work.reading_a_map, SIDES_M, power=2, most=3.0),  # a few ms at 200 m
    Growth('likelihood field, by side [m]', work.likelihood_field, SIDES_M, power=2),
    Growth('rasterising a world, by side [m]', work.rasterising, SIDES_M, power=2),
    Growth('global costmap, by side [m]', work.global_costmap, SIDES_M, power=2),
    Growth(
        'global plan, by side [m]',
        work.global_plan,
        SIDES_M,
        power=2,
        reason='cells leave a heap in the order of their cost: n log n',
    ),
    Growth('20 scans, by side of the world [m]', work.scanning, SIDES_M, power=2),
    Growth('100 updates of AMCL, by particles', work.weighing_particles, (100, 1000, 10_000)),
    Growth('100 updates of AMCL, by beams', work.weighing_beams, (30, 60, 180, 360)),
    Growth('scripted trial, by route [m]', work.driving, (10, 100, 1000), (10_000,)),
    Growth('errors along a path, by its length [m]', work.comparing_paths, (10, 100, 1000, 10_000)),
    Growth('campaign of trials that do nothing, by trials', work.trivial_trials, (10, 100, 1000), (10_000, 100_000)),
    Growth('resuming a finished campaign, by trials', work.resuming, (12, 120, 1200, 12_000, 100_000)),
    Growth('analyze, by trials', work.analysing, (12, 120, 1200, 12_000, 100_000)),
)


def main() -> None:
    """Print the tables."""
    arguments = _arguments()
    print_header('Growth of processor time and memory')
    ratios = []
    for growth in GROWTHS:
        if arguments.only in growth.name:
            sizes = [*growth.sizes, *growth.longest] if arguments.long else growth.sizes
            ratios.append(_measure(growth, sizes, arguments.repeats))
    print_ratios(ratios)
    write_ratios(arguments.json, ratios)


def _measure(growth: Growth, sizes: Sequence[int], repeats: int) -> Ratio:
    growth.prepare(sizes[0])()  # compiles
    rounds = [[_cost(growth, size) for size in sizes] for _ in range(repeats)]
    _print_table(growth, sizes, [Cost(*map(min, zip(*costs))) for costs in zip(*rounds)])
    before, last = sizes[-2:]
    factor = (last / before) ** growth.power
    by_round = [costs[-1].user_s / costs[-2].user_s / factor for costs in rounds]
    return Ratio(f'{growth.name}: {last}', f'in proportion to {before}', by_round, growth.most)


def _print_table(growth: Growth, sizes: Sequence[int], costs: Sequence[Cost]) -> None:
    units = [size**growth.power for size in sizes]
    users_s, systems_s, memories_bytes = zip(*costs)
    rows = zip(
        map(str, sizes),
        [f'{user_s:.3f}' for user_s in users_s],
        _exponents(units, users_s, LEAST_S),
        [f'{system_s:.3f}' for system_s in systems_s],
        [f'{memory_bytes / 1e6:.0f}' for memory_bytes in memories_bytes],
        _exponents(units, memories_bytes, LEAST_MEMORY_BYTES),
    )
    exponent = 'exponent by cells' if growth.power == 2 else 'exponent'
    heads = [growth.name, 'processor [s]', exponent, 'system [s]', 'memory [MB]', exponent]
    print(tabulate(rows, heads, disable_numparse=True, stralign='right'))
    print(f'above 1: {growth.reason}\n' if growth.reason else '', flush=True)


def _exponents(units: Sequence[int], costs: Sequence[float], least: float) -> List[str]:
    """Return the exponent from each size to the next, as text; '' where a cost is not above `least`."""
    pairs = zip(zip(units, costs), zip(units[1:], costs[1:]))
    return [
        '',
        *(
            f'{math.log(after / before) / math.log(large / small):.2f}' if min(before, after) > least else ''
            for (small, before), (large, after) in pairs
        ),
    ]


def _cost(growth: Growth, size: int) -> Cost:
    """Return the cost in a process that has what is compiled, and nothing of other sizes."""
    fork = multiprocessing.get_context('fork')
    ours, theirs = fork.Pipe(duplex=False)
    process = fork.Process(target=_report, args=(growth.prepare, size, theirs))
    process.start()
    theirs.close()
    cost: Cost = ours.recv()
    process.join()
    return cost


def _report(prepare: Callable[[int], work.Work], size: int, answer: multiprocessing.connection.Connection) -> None:
    call = prepare(size)
    Path('/proc/self/clear_refs').write_text('5')  # the peak begins anew
    had_bytes, began_s = _resident_bytes('VmRSS'), _processor_s()
    call()
    user_s, system_s = _processor_s() - began_s
    started_bytes = 1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    answer.send(Cost(user_s, system_s, max(_resident_bytes('VmHWM') - had_bytes, started_bytes)))
    work.remove_files()


def _processor_s() -> np.ndarray:
    """Return the processor time of this process and of those that it has started: the user's and the system's."""
    usages = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return np.sum([[usage.ru_utime, usage.ru_stime] for usage in usages], axis=0)


def _resident_bytes(name: str) -> int:
    (line,) = [line for line in Path('/proc/self/status').read_text().splitlines() if line.startswith(name)]
    return 1024 * int(line.split()[1])


def _in_a_title(text: str) -> str:
    if not any(text in growth.name for growth in GROWTHS):
        titles = '; '.join(growth.name for growth in GROWTHS)
        raise argparse.ArgumentTypeError(f'given {text!r}; allowed: a part of one of these: {titles}')
    return text


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--repeats', type=COUNT, default=2)
    parser.add_argument(
        '--only', type=_in_a_title, default='', metavar='TEXT', help='of those tables whose title has it'
    )
    parser.add_argument('--long', action='store_true', help='sizes that take minutes, too: 10 km, 100,000 trials')
    add_json(parser)
    return parser.parse_args()


if __name__ == '__main__':
    main()
