"""The paper's claims in our own words, each with the hypothesis tests of its parts."""

from __future__ import annotations

from typing import Callable, List, NamedTuple, Tuple

from diff_encoder_sim.analysis.dataset import STANDARD_TESTS
from diff_encoder_sim.analysis.paper.claim_samples import (
    TrialsByCell,
    pairs_of_pprs,
    pairs_of_y_and_x,
    pooled_over_tests,
    samples,
)
from diff_encoder_sim.analysis.paper.every_trial import all_succeeded, all_within, amcl_matches_global
from diff_encoder_sim.analysis.paper.hypothesis_tests import HypothesisTest
from diff_encoder_sim.analysis.paper.limit_tests import fractions_within, spreads
from diff_encoder_sim.analysis.paper.paired_tests import first_errs_more, first_spreads_more, fractions_equal
from diff_encoder_sim.analysis.paper.paper_cells import PPRS
from diff_encoder_sim.analysis.quantities import QUANTITIES, YAW, X, Y
from diff_encoder_sim.drives.topics import PoseSource

ODOM, GLOBAL, WORLD = PoseSource.ODOM, PoseSource.GLOBAL, PoseSource.WORLD

COARSE, FINE = PPRS[:2], PPRS[2:]
COARSE_AND_FINE = [(coarse, fine) for coarse in COARSE for fine in FINE]
EXTREMES = [(PPRS[0], PPRS[-1])]


class Claim(NamedTuple):
    """A statement of the paper about its results."""

    text: str
    where: str  # in the paper
    test: Callable[[TrialsByCell], List[HypothesisTest]]  # a hypothesis test for each part


def _heading_by_resolution(trials: TrialsByCell) -> List[HypothesisTest]:
    """Test the heading over all tests, as the claim does, in all three tables: it does not name one."""
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
    Claim('The robot completes every route.', 'sections III and IV', all_succeeded),
    Claim(
        'The heading of odometry after the straight line spreads by less than the tolerance of '
        '3 degrees, with every encoder.',
        'section III, table 4',
        lambda trials: spreads(YAW.tolerance, below=samples(trials, ODOM, ['SL'], PPRS, [YAW])),
    ),
    Claim(
        'In turns in place, odometry with 1024 and 4096 PPR spreads less than with 40 and 90.',
        'section III, table 4',
        lambda trials: first_spreads_more(pairs_of_pprs(trials, ODOM, ['SMT'], COARSE_AND_FINE, QUANTITIES)),
    ),
    Claim(
        'A higher resolution gives steadier odometry: 1024 and 4096 PPR spread less than 40 and 90 in every test.',
        'sections III and IV, table 4',
        lambda trials: first_spreads_more(pairs_of_pprs(trials, ODOM, STANDARD_TESTS, COARSE_AND_FINE, QUANTITIES)),
    ),
    Claim(
        'A low resolution drifts: after the long drive the position error of odometry is larger '
        'with 40 PPR than with 4096.',
        'abstract, section IV',
        lambda trials: first_errs_more(pairs_of_pprs(trials, ODOM, ['DLD'], EXTREMES, [X, Y])),
    ),
    Claim(
        'The true final position spreads more about the goal with 40 PPR than with 4096.',
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
        'Odometry is within 0.05 m in at most 20 per cent of the long drives, with any encoder.',
        'section III, table 4',
        lambda trials: fractions_within(0.2, below=samples(trials, ODOM, ['DLD'], PPRS, [X, Y])),
    ),
    Claim(
        'By AMCL (/global_pose) every trial ends within 0.05 m in x and in y, with every encoder.',
        'section III, table 6',
        lambda trials: all_within(trials, GLOBAL, STANDARD_TESTS, PPRS),
    ),
    Claim(
        'The true position ends within 0.05 m in 85 to 100 per cent of the trials.',
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
        'The resolution matters for the heading in the long drive: the true heading spreads more with '
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
