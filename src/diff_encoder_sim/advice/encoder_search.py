"""The smallest encoder with which a robot ends its tests within a tolerance."""

from __future__ import annotations

import math
from typing import Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

from tabulate import tabulate

from diff_encoder_sim.analysis.dataset import TrialData, Varied
from diff_encoder_sim.analysis.quantities import YAW, Quantity, X, Y
from diff_encoder_sim.analysis.table_keys import head_of_test, ppr_head
from diff_encoder_sim.analysis.within_tolerance import Reach, Share, fraction_within
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.evaluation.sample_statistics import LEVEL
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.trial_outcome import Outcome

# The questions, by the source that answers them. Odometry is compared with the true pose, not with the goal.
WORDS = {
    PoseSource.WORLD: 'the robot is at its goal',
    PoseSource.GLOBAL: 'it believes that it is',
    PoseSource.ODOM: 'its odometry is right',
}

NOWHERE = Pose2D(math.inf, math.inf, math.inf)

_MARKS = {Reach.YES: 'yes', Reach.NO: 'no', Reach.UNDECIDED: '?'}

Test = Tuple[str, Varied]  # with its set of parameters


class Tolerance(NamedTuple):
    """How far off is allowed: in x and y each, and in heading."""

    position_m: float
    yaw_deg: float

    @property
    def quantities(self) -> Tuple[Quantity, ...]:
        """As shares are counted by."""
        return (
            X._replace(tolerance=self.position_m),
            Y._replace(tolerance=self.position_m),
            YAW._replace(tolerance=self.yaw_deg),
        )


class Advisor:
    """Looks for encoders by halves: what one reaches, those with more pulses are taken to reach.

    A few trials of each test decide most encoders; where they do not, more are asked for. Looking
    several times would find by chance what is not so: each look has its part of 1 - LEVEL.
    """

    def __init__(
        self,
        labels: Sequence[str],
        looks: Sequence[int],
        tolerance: Tolerance,
        trials_with: Callable[[str, int], List[TrialData]],
    ) -> None:
        """Of what to ask, and whom.

        Args:
            labels: of encoders, ascending.
            looks: after how many trials of each test to look, ascending.
            trials_with: runs so many trials of each test with an encoder.
        """
        self._labels = labels
        self._looks = looks
        self._tolerance = tolerance
        self._trials_with = trials_with
        self._tried: Dict[str, Dict[Test, List[TrialData]]] = {}

    def smallest(self, source: PoseSource) -> Optional[str]:
        """With which every test reaches the tolerance; None where the largest does not."""
        if not self._reaches(self._labels[-1], source):
            return None
        low, high = 0, len(self._labels) - 1
        while low < high:
            middle = (low + high) // 2
            if self._reaches(self._labels[middle], source):
                high = middle
            else:
                low = middle + 1
        return self._labels[high]

    def table(self) -> str:
        """What the encoders that were tried reach: a row for each test by each question."""
        labels = [label for label in self._labels if label in self._tried]
        rows = [
            [head_of_test(*test), words, *(_text(self._share(label, test, source)) for label in labels)]
            for test in self._tried[labels[-1]]
            for source, words in WORDS.items()
        ]
        return tabulate(
            rows,
            ['test', '', *map(ppr_head, labels)],
            disable_numparse=True,
            colalign=('left', 'left', *['right'] * len(labels)),
        )

    def _reaches(self, label: str, source: PoseSource) -> bool:
        """Whether all tests are known to."""
        for count in self._looks:
            self._look(label, count)
            reached = [
                share.reach if share else Reach.NO
                for share in (self._share(label, test, source) for test in self._tried[label])
            ]
            if Reach.UNDECIDED not in reached or Reach.NO in reached:
                break
        return all(reach is Reach.YES for reach in reached)

    def _look(self, label: str, count: int) -> None:
        tried = self._tried.get(label, {})
        if min(map(len, tried.values()), default=0) < count:
            tests: Dict[Test, List[TrialData]] = {}
            for trial in self._trials_with(label, count):
                tests.setdefault((trial.test, trial.varied), []).append(_judged(trial))
            self._tried[label] = tests

    def _share(self, label: str, test: Test, source: PoseSource) -> Optional[Share]:
        level = 1.0 - (1.0 - LEVEL) / len(self._looks)
        return fraction_within(self._tried[label][test], source, self._tolerance.quantities, level)


def _judged(trial: TrialData) -> TrialData:
    """With its drift. A robot that gave up is not at its goal, wherever it stands."""
    errors = dict(trial.errors)
    if trial.outcome is not Outcome.SUCCEEDED:
        errors.update(dict.fromkeys(WORDS, NOWHERE))
    errors[PoseSource.ODOM] = trial.odometry_minus_truth
    return trial._replace(errors=errors)


def _text(share: Optional[Share]) -> str:
    return '' if share is None else f'{share.within}/{share.trials} {_MARKS[share.reach]}'
