"""Claims about every trial: the paper's count of all its trials against ours.

The paper's 30 of 30 trials are a sample: 29 of 30 of ours are no evidence against it (Fisher's exact test, p = 1).
All cells together are tested too, since a few trials in each may be many. Where trials of several cells have common
noise, that p-value is too small or too large by a little; each cell's is not.
"""

from __future__ import annotations

from typing import List, NamedTuple, Sequence

import numpy as np

from diff_encoder_sim.analysis.dataset import TrialData
from diff_encoder_sim.analysis.final_errors import count_within_all, final_error, with_final_error
from diff_encoder_sim.analysis.paper.claim_samples import TrialsByCell
from diff_encoder_sim.analysis.paper.hypothesis_tests import HypothesisTest, PartResult, concluded, too_few
from diff_encoder_sim.analysis.paper.paper_cells import TRIALS
from diff_encoder_sim.analysis.quantities import QUANTITIES, X, Y
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.se2 import wrap_angle
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome

stats = deferred('scipy.stats')

# A smaller difference is negligible, as a fraction of the tolerance.
NEGLIGIBLE_FRACTION = 0.1


class _Count(NamedTuple):
    """In how many trials of a cell the claim is true."""

    label: str
    true: int
    trials: int


def all_succeeded(trials: TrialsByCell) -> List[HypothesisTest]:
    """Test that every trial reached its goal."""
    return _tests(
        'reached the goal',
        [
            _Count(_label(*cell), sum(trial.outcome is Outcome.SUCCEEDED for trial in of_cell), len(of_cell))
            for cell, of_cell in trials.items()
        ],
    )


def all_within(
    trials: TrialsByCell, source: PoseSource, tests: Sequence[str], pprs: Sequence[str]
) -> List[HypothesisTest]:
    """Test that every trial ends within tolerance in x and in y."""
    cells = {(test, ppr): trials.get((test, ppr), []) for test in tests for ppr in pprs}
    return _tests(
        'within',
        [
            _Count(_label(*cell), count_within_all(of_cell, source, (X, Y)), len(with_final_error(of_cell, source)))
            for cell, of_cell in cells.items()
        ],
    )


def amcl_matches_global(trials: TrialsByCell) -> List[HypothesisTest]:
    """Test that the final /amcl_pose and /global_pose agree to a tenth of the tolerance, in every trial."""
    counts = []
    for cell, of_cell in trials.items():
        agree = [_is_negligible(trial) for trial in of_cell if _has_both(trial)]
        counts.append(_Count(_label(*cell), sum(agree), len(agree)))
    return _tests('agree', counts)


def _tests(what: str, counts: Sequence[_Count]) -> List[HypothesisTest]:
    """Compare each cell's count, and that of all, with as many of the paper's trials, all of them true."""
    counted = [one for one in counts if one.trials]
    parts = [_part(what, one, TRIALS) for one in counted]
    if len(counted) > 1:
        every = _Count('all cells', sum(one.true for one in counted), sum(one.trials for one in counted))
        parts.append(_part(what, every, TRIALS * len(counted)))
    return [*(too_few(one.label) for one in counts if not one.trials), *concluded(parts)]


def _part(what: str, count: _Count, theirs: int) -> PartResult:
    _, p_value = stats.fisher_exact(np.array([[count.true, count.trials - count.true], [theirs, 0]]))
    text = f'{count.label}: {count.true} of {count.trials} {what}, the paper {theirs} of {theirs}, p {p_value:.2g}'
    return PartResult(text, count.true == count.trials, float(p_value))


def _label(test: str, ppr: str) -> str:
    return f'{test} at {ppr} PPR'


def _has_both(trial: TrialData) -> bool:
    return all(final_error(trial, source) is not None for source in (PoseSource.AMCL, PoseSource.GLOBAL))


def _is_negligible(trial: TrialData) -> bool:
    amcl, estimate = final_error(trial, PoseSource.AMCL), final_error(trial, PoseSource.GLOBAL)
    if amcl is None or estimate is None:
        return False
    difference = (amcl.x_m - estimate.x_m, amcl.y_m - estimate.y_m, wrap_angle(amcl.yaw_rad - estimate.yaw_rad))
    return all(
        quantity.scale * abs(difference[quantity.component]) <= NEGLIGIBLE_FRACTION * quantity.tolerance
        for quantity in QUANTITIES
    )
