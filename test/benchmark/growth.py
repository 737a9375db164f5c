#!/usr/bin/env python3
"""How processor time grows with map size, route length, particles, beams and trials: a table each, with the exponent
between neighbours. A cost in proportion to the size has the exponent 1."""

from __future__ import annotations

import argparse
import math
import resource
import time
from typing import Callable, List, NamedTuple, Sequence, Tuple

import growing_work as work
from checkout import print_header
from ratios import Ratio, add_json, print_ratios, write_ratios
from tabulate import tabulate

SIDES_M = (20, 50, 100, 200, 500)


class Growth(NamedTuple):
    """Something that is measured by size."""

    name: str
    prepare: Callable[[int], work.Work]
    sizes: Sequence[int]
    power: int = 1  # what is in proportion grows by this power of the size: cells by the square of a side
    most: float = 1.5  # that the cost per unit may grow from the last size but one to the last


GROWTHS = (
    Growth('reading a map, by side [m]', work.reading_a_map, SIDES_M, 2, 2.0),
    Growth('likelihood field, by side [m]', work.likelihood_field, SIDES_M, 2, 2.0),
    Growth('rasterising a world, by side [m]', work.rasterising, SIDES_M[:-1], 2),
    Growth('global costmap, by side [m]', work.global_costmap, SIDES_M, 2, 2.0),
    Growth('global plan, by side [m]', work.global_plan, SIDES_M, 2, 2.0),
    Growth('20 scans, by side of the world [m]', work.scanning, SIDES_M, 2),
    Growth('5 updates of AMCL, by particles', work.weighing_particles, (100, 1000, 10_000)),
    Growth('5 updates of AMCL, by beams', work.weighing_beams, (30, 60, 180, 360)),
    Growth('scripted trial, by route [m]', work.driving, (10, 100, 1000)),
    Growth('errors along a path, by its length [m]', work.comparing_paths, (10, 100, 1000, 10_000)),
    Growth('resuming a finished campaign, by trials', work.resuming, (12, 120, 1200, 12_000, 100_000)),
    Growth('analyze, by trials', work.analysing, (12, 120, 1200, 12_000, 100_000)),
)


def main() -> None:
    """Print the tables."""
    arguments = _arguments()
    print_header('Growth of processor time')
    ratios = [_measure(growth, arguments.repeats) for growth in GROWTHS if arguments.only in growth.name]
    print_ratios(ratios)
    write_ratios(arguments.json, ratios)


def _measure(growth: Growth, repeats: int) -> Ratio:
    growth.prepare(growth.sizes[0])()  # compiles
    rounds = [[_spent_s(growth.prepare(size)) for size in growth.sizes] for _ in range(repeats)]
    costs_s = [min(costs) for costs in zip(*rounds)]
    rows = [
        [f'{size}', f'{cost_s:.4f}', exponent]
        for size, cost_s, exponent in zip(growth.sizes, costs_s, ['', *_exponents(growth, costs_s)])
    ]
    print(f'{tabulate(rows, [growth.name, "processor [s]", "exponent"], disable_numparse=True)}\n', flush=True)
    before, last = growth.sizes[-2:]
    factor = (last / before) ** growth.power
    return Ratio(
        f'{growth.name}: {last}', f'in proportion to {before}', [r[-1] / r[-2] / factor for r in rounds], growth.most
    )


def _exponents(growth: Growth, costs_s: Sequence[float]) -> List[str]:
    pairs: List[Tuple[float, float]] = [
        (math.log(after_s / before_s), growth.power * math.log(large / small))
        for before_s, after_s, small, large in zip(costs_s, costs_s[1:], growth.sizes, growth.sizes[1:])
    ]
    return [f'{cost / size:.2f}' for cost, size in pairs]


def _spent_s(call: work.Work) -> float:
    """Return the processor time of a call, of the processes that it starts, too."""
    began_s = _processor_s()
    call()
    return _processor_s() - began_s


def _processor_s() -> float:
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--repeats', type=int, default=2)
    parser.add_argument('--only', default='', metavar='TEXT', help='of those tables whose title has it')
    add_json(parser)
    return parser.parse_args()


if __name__ == '__main__':
    main()
