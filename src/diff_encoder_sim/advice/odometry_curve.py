"""Odometry error at the goal over the range of encoders, and the lowest sufficient counts."""

from __future__ import annotations

import math
from typing import Dict, List, NamedTuple, Optional, Sequence

import numpy as np

from diff_encoder_sim.advice.answers import Requirement
from diff_encoder_sim.advice.drive_draws import ROBOTS_CAUSES, Amounts, DriveDraws
from diff_encoder_sim.advice.encoder_search import TrialCounts, monotone_fractions
from diff_encoder_sim.analysis.closed_form import STRAIGHT_WITHIN, closed_form_std
from diff_encoder_sim.analysis.results_table import RobotGeometry
from diff_encoder_sim.analysis.statistics import Interval, wilson
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.wheels.encoder_params import PerWheel
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

special = deferred('scipy.special')


def closed_form_counts(requested: Trial, robot: RobotGeometry, requirement: Requirement) -> float:
    """Return the lowest counts per revolution at which odometry at the goal is within the tolerance.

    Across a straight line of length S the error is the difference of two phases that are uniform in a pulse d, times
    S / L: the fraction within tol is 1 - (1 - c)^2 with c = tol L / (S d). All other errors are assumed normal with
    `closed_form_std`. The axis that needs the most counts decides.
    """
    to_goal = requested.goal().relative_to(requested.test.start.pose())
    reach = np.full(3, _normal_reach(requirement.share))
    if max(abs(to_goal.y_m), abs(to_goal.yaw_rad)) <= STRAIGHT_WITHIN and to_goal.x_m != 0.0:
        # A triangle from -w to w has the standard deviation w / sqrt(6).
        reach[:2] = math.sqrt(6.0) * (1.0 - math.sqrt(1.0 - requirement.share))
    return float(np.max(closed_form_std(requested, robot, 1.0) * reach / requirement.tolerances))


def local_counts(robot: RobotGeometry, requirement: Requirement) -> float:
    """Return the lowest counts at which the heading is within the tolerance for random wheel phases.

    Localization corrects all other errors; the rest is assumed normal with a standard deviation of (d / L) sqrt(1/3).
    """
    sd_of_one_count_rad = math.pi * robot.wheel_diameter_m / robot.wheel_separation_m / math.sqrt(3.0)
    return sd_of_one_count_rad * _normal_reach(requirement.share) / requirement.yaw_rad


def _normal_reach(share: float) -> float:
    return float(special.ndtri(0.5 + 0.5 * share))


# The range of the curve, in counts per revolution of the wheel.
FEWEST_COUNTS, MOST_COUNTS, PER_OCTAVE = 8.0, 65536.0, 4

DRAWS = 1000
# Finer steps and more draws near the required success rate.
FINE_POINTS, FINE_DRAWS = 10, 8000


class Curve(NamedTuple):
    """Final errors of one test, (draws, 3) odometry minus truth in the axes of the map: [m], [m], [rad]."""

    draws: DriveDraws
    errors: Dict[float, np.ndarray]  # by counts per revolution

    @property
    def test(self) -> str:
        """Return the name of the test."""
        return self.draws.drive.test


class SmallestCounts(NamedTuple):
    """Lowest counts per revolution that meet a requirement."""

    counts: float
    interval: Interval  # certainly too few, certainly enough


class OdometryCurves:
    """Curves of a robot's tests."""

    def __init__(self, tests: Sequence[DriveDraws], params: EncoderParams, amounts: Amounts = ROBOTS_CAUSES) -> None:
        """Sample the curves.

        Args:
            tests: one drive per test.
            params: parameters of the robot's encoder; its counts are replaced.
            amounts: amounts of the other causes.
        """
        self._params, self._amounts = params, amounts
        counts = self._between(FEWEST_COUNTS, MOST_COUNTS, round(PER_OCTAVE * math.log2(MOST_COUNTS / FEWEST_COUNTS)))
        encoders = list(map(self.encoder, counts))
        self.curves = [Curve(draws, dict(zip(counts, draws.errors(encoders, DRAWS, amounts)))) for draws in tests]

    def encoder(self, counts: float) -> EncoderParams:
        """Return the robot's encoder with other counts per revolution."""
        return self._params.model_copy(update={'ppr': PerWheel(left=counts, right=counts)})

    @property
    def counts(self) -> List[float]:
        """Return the sampled counts per revolution, ascending."""
        return sorted(self.curves[0].errors)

    def share(self, counts: float, requirement: Requirement) -> Interval:
        """Return the interval of the success rate in the worst test."""
        return min(share_within(curve.errors[counts], requirement) for curve in self.curves)

    def smallest(self, requirement: Requirement) -> Optional[SmallestCounts]:
        """Return the lowest counts that meet the requirement; None if even the highest fail."""
        roughly = self._smallest(requirement)
        if roughly is None:
            return None
        before = roughly.interval.low
        between = self._between(before, roughly.interval.high, FINE_POINTS)
        encoders = list(map(self.encoder, between))
        for curve in self.curves:
            is_met = share_within(curve.errors[before], requirement).low >= requirement.share
            errors = curve.draws.errors(encoders, DRAWS if is_met else FINE_DRAWS, self._amounts)
            curve.errors.update(zip(between, errors))
        return self._smallest(requirement)

    def _smallest(self, requirement: Requirement) -> Optional[SmallestCounts]:
        """Return the smallest counts such that they and all larger counts meet the requirement.

        If a drive ends after whole pulses, fewer counts may be better by chance.
        """
        counts = self.counts
        shares = np.array([self.share(each, requirement) for each in counts])
        certain, possible = (max(np.flatnonzero(~is_met), default=-1) + 1 for is_met in (shares >= requirement.share).T)
        if certain == len(counts):
            return None
        too_few = counts[max(0, possible - 1)]
        # A monotone fit of each curve reaches the required fraction here.
        likely = 0.0
        for curve in self.curves:
            within = [requirement.within(curve.errors[each]) for each in counts]
            fractions = monotone_fractions([TrialCounts(int(each.sum()), len(each)) for each in within])
            crossing = float(np.exp(np.interp(requirement.share, fractions, np.log(counts))))
            likely = max(likely, *self.whole([crossing]))
        return SmallestCounts(min(max(likely, too_few), counts[certain]), Interval(too_few, counts[certain]))

    def _between(self, low: float, high: float, steps: int) -> List[float]:
        return self.whole(np.geomspace(low, high, steps + 1).tolist())

    def whole(self, counts: Sequence[float]) -> List[float]:
        """Return the nearest counts that the encoder can have, ascending and unique."""
        model = self._params.encoder
        step = model.counts_that_repeat * model.shaft_turns_per_wheel_turn
        return sorted({step * max(1, round(each / step)) for each in counts})


def counts_by_ppr(params: EncoderParams) -> EncoderParams:
    """Return the encoder with its counts set by `ppr` instead of its datasheet."""
    free = params.encoder.model_copy(update={'lines': None, 'pole_pairs': None, 'bits': None})
    return params.model_copy(update={'encoder': free})


def share_within(errors: np.ndarray, requirement: Requirement) -> Interval:
    """Return the confidence interval of the success rate from (draws, 3) errors."""
    return wilson(int(requirement.within(errors).sum()), len(errors), requirement.confidence)
