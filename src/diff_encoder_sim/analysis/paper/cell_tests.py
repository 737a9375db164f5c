"""Statements about the trials of each cell that no chance plays a part in."""

from __future__ import annotations

from typing import List, Optional, Sequence

import numpy as np

from diff_encoder_sim.analysis.dataset import TrialData
from diff_encoder_sim.analysis.final_errors import final_error
from diff_encoder_sim.analysis.paper.claim_samples import TrialsByCell
from diff_encoder_sim.analysis.paper.hypothesis_tests import HypothesisTest, holds_if, too_few
from diff_encoder_sim.analysis.quantities import QUANTITIES
from diff_encoder_sim.base.se2 import wrap_angles
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.trial_outcome import Outcome

# A smaller difference is negligible, as a fraction of the tolerance.
NEGLIGIBLE_FRACTION = 0.1


def all_succeeded(trials: TrialsByCell) -> List[HypothesisTest]:
    """Test that every trial reached its goal."""
    tests = []
    for (test, ppr), of_cell in trials.items():
        count = sum(trial.outcome is Outcome.SUCCEEDED for trial in of_cell)
        text = f'{test} at {ppr} PPR: {count} of {len(of_cell)} reached the goal'
        tests.append(holds_if(count == len(of_cell), text))
    return tests


def amcl_matches_global(trials: TrialsByCell) -> List[HypothesisTest]:
    """Test that the final /amcl_pose and /global_pose agree to a tenth of the tolerance, in every trial."""
    limits = [NEGLIGIBLE_FRACTION * quantity.tolerance for quantity in QUANTITIES]
    tests = []
    for (test, ppr), of_cell in trials.items():
        label = f'{test} at {ppr} PPR'
        largest = _largest_differences(of_cell)
        if largest is None:
            tests.append(too_few(label))
            continue
        texts = [f'{value:.3g} {quantity.unit} in {quantity.axis}' for value, quantity in zip(largest, QUANTITIES)]
        agree = all(value <= limit for value, limit in zip(largest, limits))
        tests.append(holds_if(agree, f'{label}: largest differences {", ".join(texts)}'))
    return tests


def _largest_differences(trials: Sequence[TrialData]) -> Optional[List[float]]:
    """Return the largest absolute difference in each quantity; None where no trial has both poses."""
    poses = [(final_error(trial, PoseSource.AMCL), final_error(trial, PoseSource.GLOBAL)) for trial in trials]
    both = [(amcl, estimate) for amcl, estimate in poses if amcl is not None and estimate is not None]
    if not both:
        return None
    differences = np.array([np.subtract(amcl, estimate) for amcl, estimate in both])
    differences[:, 2] = wrap_angles(differences[:, 2])
    largest = np.abs(differences).max(axis=0)
    return [quantity.scale * float(largest[quantity.component]) for quantity in QUANTITIES]
