"""Searches the smallest encoder with which a robot ends its tests within a tolerance."""

from __future__ import annotations

import math
from typing import Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

from tabulate import tabulate

from diff_encoder_sim.analysis.dataset import TrialData, Varied
from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.quantities import YAW, Quantity, X, Y
from diff_encoder_sim.analysis.table_keys import setup_text
from diff_encoder_sim.analysis.within_tolerance import FractionWithin, Sufficiency, fraction_within
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.evaluation.sample_statistics import LEVEL
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.trial_outcome import Outcome

# The criteria by the pose source that decides them. Odometry is compared with the true pose, not with the goal.
CRITERIA = {
    PoseSource.WORLD: 'true pose at the goal',
    PoseSource.GLOBAL: 'pose estimate at the goal',
    PoseSource.ODOM: 'odometry at the true pose',
}

FAR_OFF = Pose2D(math.inf, math.inf, math.inf)

_MARKS = {Sufficiency.YES: 'yes', Sufficiency.NO: 'no', Sufficiency.UNDECIDED: '?'}

Setup = Tuple[str, Varied]  # a test with its set of parameters


class Tolerance(NamedTuple):
    """The allowed error: in x and y each, and in heading."""

    position_m: float
    yaw_deg: float

    @property
    def quantities(self) -> Tuple[Quantity, ...]:
        """Return x, y and yaw with these tolerances."""
        return (
            X._replace(tolerance=self.position_m),
            Y._replace(tolerance=self.position_m),
            YAW._replace(tolerance=self.yaw_deg),
        )


class Advisor:
    """Searches encoders: ideal ones by bisection, which takes larger ones to be sufficient where a smaller one is.

    A few trials of each test decide most encoders; where they do not, more are run. Several looks at
    growing data would find by chance what is not so: each look has its part of 1 - LEVEL.
    """

    def __init__(
        self,
        labels: Sequence[str],
        looks: Sequence[int],
        tolerance: Tolerance,
        trials_with: Callable[[str, int], List[TrialData]],
    ) -> None:
        """Prepare the search.

        Args:
            labels: of encoders, ascending.
            looks: after how many trials of each test to look, ascending.
            tolerance: of the final errors.
            trials_with: runs so many trials of each test with an encoder.
        """
        self._labels = labels
        self._looks = looks
        self._tolerance = tolerance
        self._trials_with = trials_with
        self._tried: Dict[str, Dict[Setup, List[TrialData]]] = {}

    def smallest(self, source: PoseSource) -> Optional[str]:
        """Return the smallest encoder that is sufficient in every test; None where the largest is not."""
        if not self._is_sufficient(self._labels[-1], source):
            return None
        low, high = 0, len(self._labels) - 1
        while low < high:
            middle = (low + high) // 2
            if self._is_sufficient(self._labels[middle], source):
                high = middle
            else:
                low = middle + 1
        return self._labels[high]

    def sufficient(self, source: PoseSource) -> List[str]:
        """Return all encoders that are sufficient in every test: where counts do not tell which is better."""
        return [label for label in self._labels if self._is_sufficient(label, source)]

    def table(self) -> str:
        """Return the results of the encoders that were tried: a row for each test by each criterion."""
        labels = [label for label in self._labels if label in self._tried]
        rows = [
            [setup_text(*setup), text, *(_cell_text(self._fraction(label, setup, source)) for label in labels)]
            for setup in self._tried[labels[-1]]
            for source, text in CRITERIA.items()
        ]
        return tabulate(
            rows,
            ['test', '', *map(ppr_text, labels)],
            disable_numparse=True,
            colalign=('left', 'left', *['right'] * len(labels)),
        )

    def _is_sufficient(self, label: str, source: PoseSource) -> bool:
        """Run trials until all tests are decided, one fails, or there are no more looks."""
        for count in self._looks:
            self._run_trials(label, count)
            results = [self._sufficiency(label, setup, source) for setup in self._tried[label]]
            if Sufficiency.UNDECIDED not in results or Sufficiency.NO in results:
                break
        return all(result is Sufficiency.YES for result in results)

    def _run_trials(self, label: str, count: int) -> None:
        tried = self._tried.get(label, {})
        if min(map(len, tried.values()), default=0) < count:
            setups: Dict[Setup, List[TrialData]] = {}
            for trial in self._trials_with(label, count):
                setups.setdefault((trial.test, trial.varied), []).append(_with_criteria(trial))
            self._tried[label] = setups

    def _sufficiency(self, label: str, setup: Setup, source: PoseSource) -> Sufficiency:
        fraction = self._fraction(label, setup, source)
        return Sufficiency.NO if fraction is None else fraction.sufficiency

    def _fraction(self, label: str, setup: Setup, source: PoseSource) -> Optional[FractionWithin]:
        level = 1.0 - (1.0 - LEVEL) / len(self._looks)
        return fraction_within(self._tried[label][setup], source, self._tolerance.quantities, level)


def _with_criteria(trial: TrialData) -> TrialData:
    """Replace the errors by those of CRITERIA. A robot that gave up is not at its goal, wherever it stands."""
    errors = dict(trial.errors)
    if trial.outcome is not Outcome.SUCCEEDED:
        errors.update(dict.fromkeys(CRITERIA, FAR_OFF))
    errors[PoseSource.ODOM] = trial.odometry_minus_truth
    return trial._replace(errors=errors)


def _cell_text(fraction: Optional[FractionWithin]) -> str:
    return '' if fraction is None else f'{fraction.within}/{fraction.trials} {_MARKS[fraction.sufficiency]}'
