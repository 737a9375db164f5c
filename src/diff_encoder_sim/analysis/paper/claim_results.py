"""Tests the paper's claims on our trials."""

from __future__ import annotations

from typing import Dict, List, NamedTuple, Sequence

from diff_encoder_sim.analysis.dataset import Dataset, Varied
from diff_encoder_sim.analysis.paper.claim_samples import TrialsByCell
from diff_encoder_sim.analysis.paper.claims import CLAIMS, Claim
from diff_encoder_sim.analysis.paper.hypothesis_tests import Conclusion, HypothesisTest

# Smaller p-values are shown as smaller than this.
SMALLEST_P = 1e-4


class ClaimResult(NamedTuple):
    """A claim and what our trials show."""

    text: str
    where: str  # in the paper
    varied: Varied  # parameters that set these trials apart from others of the dataset
    conclusion: str
    tests: List[HypothesisTest]

    @property
    def p_text(self) -> str:
        """Return the p-value of the part that speaks most against the claim; empty where none was tested."""
        p_value = min((test.p_against for test in self.tests if test.p_against is not None), default=None)
        return '' if p_value is None else f'p {p_value:.2g}' if p_value >= SMALLEST_P else f'p < {SMALLEST_P:g}'

    @property
    def counts(self) -> str:
        """Count the parts of the claim by their conclusions."""
        counts = {conclusion: sum(test.conclusion is conclusion for test in self.tests) for conclusion in Conclusion}
        return ', '.join(f'{conclusion.value} {count}' for conclusion, count in counts.items() if count)


def check_claims(dataset: Dataset) -> List[ClaimResult]:
    """Test every claim, for each set of varied parameters."""
    by_varied: Dict[Varied, TrialsByCell] = {}
    for cell, trials in dataset.cells().items():
        by_varied.setdefault(cell.varied, {})[cell.test, cell.ppr] = trials
    return [_result(claim, varied, cells) for varied, cells in by_varied.items() for claim in CLAIMS]


def claim_conclusion(tests: Sequence[HypothesisTest]) -> str:
    """Conclude from the parts: one that fails contradicts a claim, all must hold to reproduce it."""
    conclusions = [test.conclusion for test in tests]
    if Conclusion.FAILS in conclusions:
        return 'contradicted'
    if conclusions and all(one is Conclusion.HOLDS for one in conclusions):
        return 'reproduced'
    return 'not contradicted' if any(test.p_against is not None for test in tests) else 'not tested: too few trials'


def _result(claim: Claim, varied: Varied, cells: TrialsByCell) -> ClaimResult:
    tests = claim.test(cells)
    return ClaimResult(claim.text, claim.where, varied, claim_conclusion(tests), tests)
