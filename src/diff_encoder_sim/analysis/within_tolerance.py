"""Whether enough trials of a cell end within a tolerance.

A cell reaches the tolerance when at least four trials in five end within it, and that is known with
95 % confidence: for that Wilson's interval of the share must lie on one side.
"""

from __future__ import annotations

import enum
from typing import NamedTuple, Optional, Sequence

from diff_encoder_sim.analysis.dataset import TrialData
from diff_encoder_sim.analysis.final_errors import count_within_all, with_final_error
from diff_encoder_sim.analysis.quantities import QUANTITIES, Quantity
from diff_encoder_sim.evaluation.sample_statistics import LEVEL, Interval, wilson
from diff_encoder_sim.trials.pose_source import PoseSource

# What the robot did, what it believed, and what it would have believed without a map.
WORDS_OF_SOURCE = {
    PoseSource.WORLD: 'in truth',
    PoseSource.GLOBAL: 'as the robot believes',
    PoseSource.ODOM: 'by odometry alone',
}

# Thirty trials of thirty show no more than 88 per cent: the paper's count cannot show 90.
REQUIRED_FRACTION = 0.8


class Reach(enum.Enum):
    """Whether the required share ends within the tolerance."""

    YES = 'yes'
    NO = 'no'
    UNDECIDED = 'undecided'


class Share(NamedTuple):
    """How many trials of a cell end within the tolerance, as a source says."""

    trials: int  # that ended with a pose of the source
    within: int  # in position and heading
    within_position: int  # in x and in y
    within_heading: int
    interval: Interval  # of the share `within`

    @property
    def reach(self) -> Reach:
        """What the interval tells."""
        if self.interval.low >= REQUIRED_FRACTION:
            return Reach.YES
        return Reach.NO if self.interval.high < REQUIRED_FRACTION else Reach.UNDECIDED


def fraction_within(
    trials: Sequence[TrialData], source: PoseSource, tolerances: Sequence[Quantity] = QUANTITIES, level: float = LEVEL
) -> Optional[Share]:
    """Of the trials that ended with a pose of the source, however they ended; None without one.

    Args:
        tolerances: of x, y and yaw; the paper's unless others are given.
        level: of confidence.
    """
    count = len(with_final_error(trials, source))
    if count == 0:
        return None
    x, y, yaw = tolerances
    within = count_within_all(trials, source, tolerances)
    return Share(
        count,
        within,
        count_within_all(trials, source, (x, y)),
        count_within_all(trials, source, (yaw,)),
        wilson(within, count, level),
    )


def fewest_trials() -> int:
    """How many trials it takes to reach the required share when all of them end within it."""
    count = 1
    while wilson(count, count, LEVEL).low < REQUIRED_FRACTION:
        count += 1
    return count
