"""What trials show about a share: whether at least so much of all trials ends within a tolerance.

Evidence is an e-value: the likelihood of the outcomes, averaged over the shares on one side of the required one, and
divided by their likelihood at the required share. While the truth is on the other side, its mean is 1 at most, and it
ever exceeds 1 / doubt with probability `doubt` at most, whenever and for whatever reason one looks (Ville's inequality;
Robbins, Annals of Mathematical Statistics 41, 1970; Ramdas, Grünwald, Vovk, Shafer, Statistical Science 38, 2023). So
trials may be added to an undecided result at any time. That holds for an encoder, too, that was chosen by trials of
another with equal random draws: a bound for all numbers of trials at once does not depend on what made one look.

The average is by Jeffreys' prior, Beta(1/2, 1/2), cut at the required share, which lies between 0 and 1.
"""

from __future__ import annotations

from functools import lru_cache
from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.sample_statistics import Interval
from diff_encoder_sim.base.deferred import deferred

optimize = deferred('scipy.optimize')
special = deferred('scipy.special')

JEFFREYS = 0.5  # both parameters of the prior

# A decision that is further off is too far off to say how far.
MOST_FORESEEN = 1000

# Bounds of a share are searched so far from 0, and from the fraction of the trials.
MARGIN = 1e-9


class TrialCounts(NamedTuple):
    """Trials of one test with one encoder."""

    within: int  # the tolerance
    trials: int

    @property
    def fraction(self) -> float:
        """Divide; there must be trials."""
        return self.within / self.trials


def log_evidence_for(within: np.ndarray, trials: np.ndarray, share: float) -> np.ndarray:
    """Compute the logarithm of the e-value against a true share of at most `share`.

    Args:
        within: trials within the tolerance, of any shape; only foreseen ones need not be whole.
        trials: all of them, in the same shape.
        share: required.
    """
    outside = trials - within
    with np.errstate(divide='ignore'):  # no evidence at all: the logarithm of 0
        above = _log_mass_above(share, within + JEFFREYS, outside + JEFFREYS)
    prior = _log_mass_above(share, np.array(JEFFREYS), np.array(JEFFREYS))
    return np.asarray(above - prior - within * np.log(share) - outside * np.log1p(-share))


def log_evidence_against(within: np.ndarray, trials: np.ndarray, share: float) -> np.ndarray:
    """Compute the logarithm of the e-value against a true share of at least `share`; arguments as above."""
    return log_evidence_for(trials - within, trials, 1.0 - share)


def shows_enough(counts: TrialCounts, share: float, doubt: float) -> bool:
    """Return whether the share in a test is shown to be more than `share`, at 1 - `doubt`."""
    return bool(_enough(np.array(counts.within), np.array(counts.trials), share, doubt))


def shows_too_few(tests: Sequence[TrialCounts], share: float, doubt: float) -> bool:
    """Return whether the share in at least one test is shown to be less than `share`, at 1 - `doubt`.

    The mean of the tests' e-values is an e-value itself, whatever they have in common. It is no less than what
    Bonferroni leaves of the largest.
    """
    within, trials = np.array(tests).T
    return bool(_too_few(within, trials, share, doubt))


def more_trials(tests: Sequence[TrialCounts], share: float, doubt: float) -> Optional[int]:
    """Return how many more trials of each test would decide if they went as those so far; None: over MOST_FORESEEN.

    0 where the present ones decide. The fractions so far are taken half a trial nearer to 1/2: 20 of 20 may not go on.
    """
    more = np.arange(MOST_FORESEEN + 1)
    within, trials = np.array(tests, dtype=float).T[:, :, np.newaxis]
    foreseen = within + more * (within + 0.5) / (trials + 1.0), trials + more
    decided = np.all(_enough(*foreseen, share, doubt), axis=0) | _too_few(*foreseen, share, doubt)
    return int(more[np.argmax(decided)]) if decided.any() else None


@lru_cache(maxsize=None)  # asked at each rank of a search
def looks(share: float, doubt: float, most: int) -> Tuple[int, ...]:
    """Return after how many trials to look: each time that one more of them may fail and the share is still shown.

    Args:
        share: required.
        doubt: of each decision.
        most: trials; no look is later. Where even so many show nothing although none fails, there is no look.
    """
    numbers = np.arange(1, most + 1)
    found: List[int] = []
    while True:
        shown = numbers[(numbers >= len(found)) & _enough(numbers - len(found), numbers, share, doubt)]
        if len(shown) == 0:
            return tuple(found)
        found.append(int(shown[0]))


def share_interval(counts: TrialCounts, confidence: float) -> Interval:
    """Return the shares that the trials do not exclude: each bound holds with `confidence`, at all times at once."""
    outside = TrialCounts(counts.trials - counts.within, counts.trials)
    return Interval(_lower_bound(counts, confidence), 1.0 - _lower_bound(outside, confidence))


def monotone_fractions(ranks: Sequence[TrialCounts]) -> List[float]:
    """Fit fractions that do not fall from rank to rank, by pooling adjacent violators.

    Args:
        ranks: of ascending quality, each with trials.
    """
    pools: List[TrialCounts] = []
    sizes: List[int] = []
    for counts in ranks:
        pool, size = counts, 1
        while pools and pools[-1].fraction >= pool.fraction:
            lower = pools.pop()
            pool, size = TrialCounts(lower.within + pool.within, lower.trials + pool.trials), size + sizes.pop()
        pools.append(pool)
        sizes.append(size)
    return [pool.fraction for pool, size in zip(pools, sizes) for _ in range(size)]


def _enough(within: np.ndarray, trials: np.ndarray, share: float, doubt: float) -> np.ndarray:
    return np.asarray(log_evidence_for(within, trials, share) >= -np.log(doubt))


def _too_few(within: np.ndarray, trials: np.ndarray, share: float, doubt: float) -> np.ndarray:
    """Judge tests along the first axis."""
    evidence = log_evidence_against(within, trials, share)
    return np.asarray(np.logaddexp.reduce(evidence, axis=0) - np.log(len(evidence)) >= -np.log(doubt))


def _log_mass_above(share: float, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Compute the logarithm of the integral of x^(a - 1) (1 - x)^(b - 1) from `share` to 1."""
    return np.asarray(special.betaln(a, b) + np.log(special.betainc(b, a, 1.0 - share)))


def _lower_bound(counts: TrialCounts, confidence: float) -> float:
    """Return the largest share that is shown to be exceeded; 0 without one."""
    within, trials = np.array(counts.within), np.array(counts.trials)

    def beyond(share: float) -> float:
        return float(log_evidence_for(within, trials, share) + np.log1p(-confidence))

    if counts.within == 0 or beyond(MARGIN) <= 0.0:
        return 0.0
    return float(optimize.brentq(beyond, MARGIN, counts.fraction - MARGIN))
