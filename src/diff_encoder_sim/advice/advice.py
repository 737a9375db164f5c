"""Results of a search for the encoder that a robot needs."""

from __future__ import annotations

from typing import Dict, List, NamedTuple, Optional

from diff_encoder_sim.advice.answers import Answer, Budget, Criterion, Requirement
from diff_encoder_sim.advice.encoder_search import TrialCounts
from diff_encoder_sim.advice.listed_encoders import ListedEncoder
from diff_encoder_sim.advice.odometry_curve import OdometryCurves, closed_form_counts
from diff_encoder_sim.analysis.results_table import RobotGeometry
from diff_encoder_sim.navigation.goal_stopping import StopSpread


class TriedEncoder(NamedTuple):
    """Closed-loop trials of one test with one encoder."""

    test: str
    label: str
    counts: float  # per revolution of the wheel
    within: Dict[Criterion, TrialCounts]
    truth: Optional[Budget]  # of trials that reached the goal with all encoders; None if too few
    budgeted: int  # number of these trials


class Advice(NamedTuple):
    """Results of an advice; without trials, only of odometry."""

    robot: str
    own_counts: Optional[float]  # of the robot's own encoder, per revolution of the wheel
    requirement: Requirement
    curves: OdometryCurves
    geometry: RobotGeometry  # that odometry assumes
    answers: Dict[Criterion, Answer]
    budgets: Dict[str, Dict[float, Budget]]  # error budgets of odometry, by test and counts
    stopping: Dict[str, Dict[str, StopSpread]]  # upper bounds in closed form, by encoder and cause
    tried: List[TriedEncoder]
    encoders: List[ListedEncoder]

    @property
    def closed_form(self) -> Dict[str, float]:
        """Return, by test, the lowest counts at which quantisation errors meet the requirement."""
        drives = (curve.draws.drive for curve in self.curves.curves)
        return {drive.test: closed_form_counts(drive.requested, self.geometry, self.requirement) for drive in drives}
