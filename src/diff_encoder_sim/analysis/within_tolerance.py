"""Whether enough trials of a cell end within the tolerance.

At least four trials in five must end within it, and that must be known with 95 % confidence: for
that Wilson's interval of the fraction must lie on one side of 80 %.
"""

from __future__ import annotations

import enum
from typing import NamedTuple, Optional, Sequence

from diff_encoder_sim.analysis.dataset import TrialData
from diff_encoder_sim.analysis.final_errors import count_within_all, minus_truth, with_final_error
from diff_encoder_sim.analysis.quantities import LEVEL, QUANTITIES, REQUIRED_FRACTION, YAW, Quantity, X
from diff_encoder_sim.analysis.statistics import Interval, wilson
from diff_encoder_sim.drives.topics import PoseSource

TOLERANCE_TEXT = f'within {X.tolerance:g} m in x and y and {YAW.tolerance:g} degrees'


class Sufficiency(enum.Enum):
    """Whether the required fraction of trials ends within the tolerance."""

    YES = 'yes'
    NO = 'no'
    UNDECIDED = 'undecided'  # too few trials to know


class FractionWithin(NamedTuple):
    """How many trials of a cell end within the tolerance, by one pose source."""

    trials: int  # that ended with a pose of the source
    within: int  # in position and heading
    within_position: int  # in x and in y
    within_heading: int
    interval: Interval  # of the fraction within / trials

    @property
    def sufficiency(self) -> Sufficiency:
        """Compare the interval with the required fraction."""
        if self.interval.low >= REQUIRED_FRACTION:
            return Sufficiency.YES
        return Sufficiency.NO if self.interval.high < REQUIRED_FRACTION else Sufficiency.UNDECIDED


def fraction_within(
    trials: Sequence[TrialData], source: PoseSource, tolerances: Sequence[Quantity] = QUANTITIES, level: float = LEVEL
) -> Optional[FractionWithin]:
    """Count the trials within the tolerance, whatever their outcome; None where none has a pose of the source.

    Args:
        trials: of one cell.
        source: of the final pose.
        tolerances: of x, y and yaw; the paper's unless others are given.
        level: of confidence.
    """
    count = len(with_final_error(trials, source))
    if count == 0:
        return None
    x, y, yaw = tolerances
    within = count_within_all(trials, source, tolerances)
    position, heading = (count_within_all(trials, source, part) for part in ((x, y), (yaw,)))
    return FractionWithin(count, within, position, heading, wilson(within, count, level))


class ComparedPose(NamedTuple):
    """A final pose, and what it is compared with: the goal, or the true pose."""

    text: str
    topics: str
    source: PoseSource
    is_minus_truth: bool = False

    def fraction(self, trials: Sequence[TrialData]) -> Optional[FractionWithin]:
        """Count the trials of a cell within the tolerance, as `fraction_within` does."""
        return fraction_within(minus_truth(trials) if self.is_minus_truth else trials, self.source)


# Of the odometry at the goal, part of the error is that the robot stops elsewhere; minus the true pose it is its own.
COMPARED_POSES = (
    ComparedPose('true pose at the goal', '/world_pose', PoseSource.WORLD),
    ComparedPose('pose estimate at the goal', '/global_pose', PoseSource.GLOBAL),
    ComparedPose('odometry at the goal', '/odom', PoseSource.ODOM),
    ComparedPose('odometry at the true pose', '/odom minus /world_pose', PoseSource.ODOM, is_minus_truth=True),
)


def fewest_trials() -> int:
    """Return how many trials show the required fraction when all of them end within the tolerance."""
    count = 1
    while wilson(count, count, LEVEL).low < REQUIRED_FRACTION:
        count += 1
    return count
