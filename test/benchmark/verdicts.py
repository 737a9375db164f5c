#!/usr/bin/env python3
"""How often the comparison with the paper finds differences between equal robots, by the shape of their errors.

A family is 12 cells with the four statistics of the paper's tables, of 30 trials of ours and 30 of theirs.
"""

from __future__ import annotations

from typing import Callable, Dict, List

import numpy as np
from bench import parser, print_header, print_table

from diff_encoder_sim.analysis.paper.comparison import STATISTICS, TRIALS, agreement
from diff_encoder_sim.analysis.quantities import YAW
from diff_encoder_sim.analysis.statistics import SIGNIFICANCE, holm

CELLS = 12
QUANTITY = YAW._replace(tolerance=1.0)
SHAPES: Dict[str, Callable[[np.random.Generator], np.ndarray]] = {
    'normal': lambda rng: rng.standard_normal(TRIALS),
    'uniform': lambda rng: rng.uniform(-1.7, 1.7, TRIALS),
    'whole pulses': lambda rng: np.round(rng.standard_normal(TRIALS)),
    'double exponential': lambda rng: rng.laplace(size=TRIALS),
    'exponential': lambda rng: rng.exponential(size=TRIALS),
    'normal, 5 % five times as far': lambda rng: (
        rng.standard_normal(TRIALS) * np.where(rng.uniform(size=TRIALS) < 0.05, 5.0, 1.0)
    ),
}


def main() -> None:
    families = parser(__doc__, families=400).parse_args().families
    print_header(f'False alarms of {families} families of {len(STATISTICS) * CELLS} cells of equal robots [%]')
    rows = []
    for name, draw in SHAPES.items():
        p_values = np.array([_family(draw, np.random.default_rng([1, seed])) for seed in range(families)])
        contradicted = np.mean([min(holm(family.ravel().tolist())) < SIGNIFICANCE for family in p_values])
        alone = np.mean(p_values < SIGNIFICANCE, axis=(0, 1))
        rows.append([name, *(f'{100.0 * rate:.1f}' for rate in (*alone, contradicted))])
    print_table(rows, ['errors', *(f'{name},\nalone' for name in STATISTICS), 'a cell of\nthe family'])


def _family(draw: Callable[[np.random.Generator], np.ndarray], rng: np.random.Generator) -> List[List[float]]:
    """Return the p-values of each cell's statistics; 1 where nothing can be concluded."""
    cells = []
    for _ in range(CELLS):
        ours, theirs = draw(rng), draw(rng)
        printed = {'min': theirs.min(), 'max': theirs.max(), 'std': theirs.std(ddof=1)}
        printed['pct_within'] = 100.0 * np.mean(np.abs(theirs) <= QUANTITY.tolerance)
        found = [agreement(statistic, ours, float(printed[statistic]), QUANTITY) for statistic in STATISTICS]
        cells.append([1.0 if one is None or one.p_value is None else one.p_value for one in found])
    return cells


if __name__ == '__main__':
    main()
