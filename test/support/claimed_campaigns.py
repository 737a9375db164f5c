"""Campaigns made to reproduce or refute the paper's claims."""

import numpy as np

from diff_encoder_sim.analysis.paper.claims import CLAIMS, claim_conclusion
from diff_encoder_sim.analysis.paper.paper_cells import PPRS
from paper_datasets import dataset, trial

# The odometry's spread by PPR.
FALLING = {'40': 0.4, '90': 0.2, '1024': 0.02, '4096': 0.005}
FLAT = dict.fromkeys(PPRS, 0.1)
RISING = {'40': 0.005, '90': 0.02, '1024': 0.2, '4096': 0.4}


def campaign(spread_of_odom, count=30, seed=0, pprs=PPRS, tests=('SL', 'SMT', 'DLD'), **odd):
    """Every source of every cell, the odometry's spread by PPR; `odd` errors in every trial."""
    rng, cells = np.random.default_rng(seed), []
    for test in tests:
        for ppr in pprs:
            steady = rng.normal(0.0, 0.005, (count, 3)).tolist()
            of_odom = rng.normal(0.0, spread_of_odom[ppr], (count, 3)).tolist()
            cells.append(
                [
                    trial(test, ppr, number, **{'odom': drifted, 'global': row, 'amcl': row, 'world': row, **odd})
                    for number, (row, drifted) in enumerate(zip(steady, of_odom))
                ]
            )
    return dataset(*cells)


def conclusion_of(made, words):
    """What the trials show of the claim with these words."""
    (claim,) = [claim for claim in CLAIMS if words in claim.text]
    trials = {(cell.test, cell.ppr): of_cell for cell, of_cell in made.cells().items()}
    return claim_conclusion(claim.test(trials))
