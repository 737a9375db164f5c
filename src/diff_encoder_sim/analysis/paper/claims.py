"""The paper's claims in our own words, each with the test that decides it on our trials."""

from __future__ import annotations

from typing import Callable, Dict, List, NamedTuple, Sequence, Tuple

from diff_encoder_sim.analysis.dataset import STANDARD_TESTS, Dataset, Varied
from diff_encoder_sim.analysis.paper.claim_samples import (
    TrialsByCell,
    pairs_of_pprs,
    pairs_of_y_and_x,
    pooled_over_tests,
    samples,
)
from diff_encoder_sim.analysis.paper.hypothesis_tests import (
    Evidence,
    Finding,
    all_reached,
    all_within,
    amcl_matches_global,
    first_errs_more,
    first_spreads_more,
    fractions_equal,
    fractions_within,
    spreads,
)
from diff_encoder_sim.analysis.paper.paper_cells import PPRS
from diff_encoder_sim.analysis.quantities import QUANTITIES, YAW, X, Y
from diff_encoder_sim.trials.pose_source import PoseSource

ODOM, GLOBAL, WORLD = PoseSource.ODOM, PoseSource.GLOBAL, PoseSource.WORLD

COARSE, FINE = PPRS[:2], PPRS[2:]
COARSE_AND_FINE = [(coarse, fine) for coarse in COARSE for fine in FINE]
EXTREMES = [(PPRS[0], PPRS[-1])]


class Claim(NamedTuple):
    """Something that the paper says of its results."""

    text: str
    where: str  # in the paper
    judge: Callable[[TrialsByCell], List[Evidence]]


class JudgedClaim(NamedTuple):
    """A claim and what our trials say of it."""

    text: str
    where: str
    varied: Varied  # what the trials have that others of the dataset have not
    verdict: str  # in words
    evidence: List[Evidence]

    @property
    def counts(self) -> str:
        """Count its parts by what they came to."""
        counts = {finding.value: sum(part.finding is finding for part in self.evidence) for finding in Finding}
        return ', '.join(f'{name} {count}' for name, count in counts.items() if count)


def judge_claims(dataset: Dataset) -> List[JudgedClaim]:
    """Every claim, for each set of varied parameters."""
    by_varied: Dict[Varied, TrialsByCell] = {}
    for cell, trials in dataset.cells().items():
        by_varied.setdefault(cell.varied, {})[cell.test, cell.ppr] = trials
    judged = []
    for varied, trials in by_varied.items():
        most = max(map(len, trials.values()))
        for claim in CLAIMS:
            evidence = claim.judge(trials)
            judged.append(JudgedClaim(claim.text, claim.where, varied, verdict(evidence, most), evidence))
    return judged


def verdict(evidence: Sequence[Evidence], trials: int) -> str:
    """One part that fails refutes a claim; it takes all of them to reproduce it."""
    findings = [part.finding for part in evidence]
    if Finding.FAILS in findings:
        return 'not reproduced'
    if findings and all(finding is Finding.HOLDS for finding in findings):
        return 'reproduced'
    return f'not decidable with {trials} trials'


def _heading_by_resolution(trials: TrialsByCell) -> List[Evidence]:
    """Over all tests, as the claim has it; of all three tables, for it does not say of which."""
    above, below = (
        [
            one
            for source in (ODOM, GLOBAL, WORLD)
            for one in pooled_over_tests(trials, source, STANDARD_TESTS, pprs, YAW)
        ]
        for pprs in (FINE, COARSE)
    )
    return fractions_within(0.9, above, below)


CLAIMS: Tuple[Claim, ...] = (
    Claim('The robot completes every route.', 'sections III and IV', all_reached),
    Claim(
        'The heading of odometry after the straight line spreads by less than the tolerance of '
        '3 degrees, with every encoder.',
        'section III, table 4',
        lambda trials: spreads(YAW.tolerance, below=samples(trials, ODOM, ['SL'], PPRS, [YAW])),
    ),
    Claim(
        'In turns on the spot, odometry with 1024 and 4096 PPR spreads less than with 40 and 90.',
        'section III, table 4',
        lambda trials: first_spreads_more(pairs_of_pprs(trials, ODOM, ['SMT'], COARSE_AND_FINE, QUANTITIES)),
    ),
    Claim(
        'A higher resolution gives steadier odometry: 1024 and 4096 PPR spread less than 40 and 90 in every test.',
        'sections III and IV, table 4',
        lambda trials: first_spreads_more(pairs_of_pprs(trials, ODOM, STANDARD_TESTS, COARSE_AND_FINE, QUANTITIES)),
    ),
    Claim(
        'A low resolution drifts: after the long drive the position by odometry is farther off '
        'with 40 PPR than with 4096.',
        'abstract, section IV',
        lambda trials: first_errs_more(pairs_of_pprs(trials, ODOM, ['DLD'], EXTREMES, [X, Y])),
    ),
    Claim(
        'The robot itself ends more scattered about the goal with 40 PPR than with 4096.',
        'section III, figure 4, table 5',
        lambda trials: first_spreads_more(pairs_of_pprs(trials, WORLD, STANDARD_TESTS, EXTREMES, [X, Y])),
    ),
    Claim(
        'The error across the drive (y) varies more than that along it (x).',
        'section III, figure 4',
        lambda trials: first_spreads_more(
            [pair for source in (ODOM, WORLD) for pair in pairs_of_y_and_x(trials, source, ['SL', 'DLD'], PPRS)]
        ),
    ),
    Claim(
        'Odometry is poor in the long drive: position spreads by more than 0.05 m with every encoder.',
        'section III, table 4',
        lambda trials: spreads(0.05, above=samples(trials, ODOM, ['DLD'], PPRS, [X, Y])),
    ),
    Claim(
        'In at most 20 per cent of the long drives is odometry within 0.05 m, with any encoder.',
        'section III, table 4',
        lambda trials: fractions_within(0.2, below=samples(trials, ODOM, ['DLD'], PPRS, [X, Y])),
    ),
    Claim(
        'By AMCL (/global_pose) every trial ends within 0.05 m in x and in y, with every encoder.',
        'section III, table 6',
        lambda trials: all_within(samples(trials, GLOBAL, STANDARD_TESTS, PPRS, [X, Y])),
    ),
    Claim(
        'In truth 85 to 100 per cent of the trials end within 0.05 m.',
        'section III, table 5',
        lambda trials: fractions_within(0.85, above=samples(trials, WORLD, STANDARD_TESTS, PPRS, [X, Y])),
    ),
    Claim(
        'The heading is within 3 degrees in less than 90 per cent of the trials with 40 and 90 '
        'PPR, in more than 90 per cent with 1024 and 4096.',
        'section III',
        _heading_by_resolution,
    ),
    Claim(
        'The resolution matters for the heading in the long drive: in truth it spreads more with '
        '40 PPR than with 4096.',
        'section III, table 5',
        lambda trials: first_spreads_more(pairs_of_pprs(trials, WORLD, ['DLD'], EXTREMES, [YAW])),
    ),
    Claim(
        'The position by AMCL hardly depends on the resolution: within tolerance as often with 40 PPR as with 4096.',
        'section IV, table 6',
        lambda trials: fractions_equal(pairs_of_pprs(trials, GLOBAL, STANDARD_TESTS, EXTREMES, [X, Y])),
    ),
    Claim(
        '/amcl_pose and /global_pose agree but for negligible differences.',
        'section III, figure 4',
        amcl_matches_global,
    ),
)
