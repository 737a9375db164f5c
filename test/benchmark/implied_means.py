"""The mean errors behind the paper's cells, which print none: what min, max, standard deviation and per cent imply."""

from __future__ import annotations

from typing import Dict, NamedTuple, Optional

import numpy as np

from diff_encoder_sim.analysis.paper.comparison import HALF_A_DIGIT
from diff_encoder_sim.analysis.paper.paper_cells import TRIALS
from diff_encoder_sim.analysis.statistics import LEVEL

SETS = 200_000
# Half of the sets are Gaussian; the others are Student's t with so many degrees of freedom, as errors with outliers.
HEAVY_TAIL_FREEDOM = 3
# How far a set's standard deviation may be from the printed one, relative, where rounding does not allow more.
STD_TOLERANCE = 0.02
FEWEST_SETS = 50  # that must agree, for a quantile to be known


class ImpliedMean(NamedTuple):
    """The centre of the distribution that 30 trials are drawn from, in their unit."""

    value: float  # the median of what is possible
    low: float  # 95 % of what is possible
    high: float


class MeanEstimator:
    """Estimates a mean from a sample's printed statistics.

    Every set of simulated values is shifted and stretched so that its minimum and maximum are the printed ones.
    Sets that then have the printed standard deviation and number within tolerance too are draws of the
    posterior, with a flat prior of centre and logarithm of scale. The numbers themselves choose between
    Gaussian errors and such with heavy tails; a skewed distribution is not considered.
    """

    def __init__(self, sets: int = SETS, trials: int = TRIALS) -> None:
        """Simulate the sets, the same in every run."""
        rng = np.random.default_rng(0)
        gaussian = rng.standard_normal((sets // 2, trials))
        heavy = rng.standard_t(HEAVY_TAIL_FREEDOM, (sets // 2, trials))
        self._values = np.concatenate((gaussian, heavy))
        self._min, self._max = self._values.min(axis=1), self._values.max(axis=1)
        self._std = self._values.std(axis=1, ddof=1)
        self._rounding = rng.uniform(-HALF_A_DIGIT, HALF_A_DIGIT, (2, len(self._values)))

    def estimate(self, printed: Dict[str, float], tolerance: float) -> Optional[ImpliedMean]:
        """Return the mean behind a sample; None where hardly any set has its statistics.

        Args:
            printed: by the names of `paper_cells.STATISTICS`.
            tolerance: which `pct_within` counts by, in the unit of the other statistics.
        """
        least, largest = printed['min'] + self._rounding[0], printed['max'] + self._rounding[1]
        scale = np.maximum(largest - least, 0.0) / (self._max - self._min)
        centre = least - scale * self._min
        allowed = max(HALF_A_DIGIT, STD_TOLERANCE * printed['std'])
        agree = np.flatnonzero(np.abs(scale * self._std - printed['std']) <= allowed)
        values = centre[agree, None] + scale[agree, None] * self._values[agree]
        within = np.count_nonzero(np.abs(values) <= tolerance, axis=1)
        agree = agree[within == round(printed['pct_within'] / 100.0 * values.shape[1])]
        if len(agree) < FEWEST_SETS:
            return None
        tail = (1.0 - LEVEL) / 2.0
        return ImpliedMean(*(float(value) for value in np.quantile(centre[agree], (0.5, tail, 1.0 - tail))))
