"""The question that the report answers first: with which encoder does the robot end at its goal?

A cell reaches the tolerance when at least four trials in five end within it, and that is known with
95 % confidence: for that Wilson's interval of the share must lie on one side.
"""
from __future__ import annotations

import enum
from typing import Dict, List, NamedTuple, Optional, Sequence

from diff_encoder_sim.analysis.dataset import IDEAL, Cell, Dataset, TrialData, Varied
from diff_encoder_sim.analysis.paper_cells import X, Y, YAW, count_within_all, with_final_error
from diff_encoder_sim.analysis.statistics import LEVEL, Interval, wilson
from diff_encoder_sim.analysis.table_keys import ppr_head

# What the robot did, what it believed, and what it would have believed without a map.
WORDS_OF_SOURCE = {'world': 'in truth', 'global': 'as the robot believes',
                   'odom': 'by odometry alone'}

# Thirty trials of thirty show no more than 88 per cent: the paper's count cannot show 90.
REQUIRED_SHARE = 0.8


class Reach(enum.Enum):
    """Whether the required share ends within the tolerance."""

    YES = 'yes'
    NO = 'no'
    UNDECIDED = 'undecided'


class Share(NamedTuple):
    """How many trials of a cell end within the tolerance, as a source says."""

    trials: int             # that ended with a pose of the source
    within: int             # in position and heading
    within_position: int    # in x and in y
    within_heading: int
    interval: Interval      # of the share `within`

    @property
    def reach(self) -> Reach:
        """What the interval tells."""
        if self.interval.low >= REQUIRED_SHARE:
            return Reach.YES
        return Reach.NO if self.interval.high < REQUIRED_SHARE else Reach.UNDECIDED


class Line(NamedTuple):
    """A row of the answer: a test by one source."""

    test: str
    varied: Varied
    source: str
    shares: Dict[str, Optional[Share]]      # by encoder, ascending; None without a final pose


def answer(dataset: Dataset) -> List[Line]:
    """By test and set of parameters, a row for each of `WORDS_OF_SOURCE`."""
    cells, labels = dataset.cells(), dataset.encoders()
    return [Line(test, varied, source, {
        label: share_within(cells[Cell(test, label, varied)], source)
        for label in labels if Cell(test, label, varied) in cells})
        for test, varied in dict.fromkeys((cell.test, cell.varied) for cell in cells)
        for source in WORDS_OF_SOURCE]


def share_within(trials: Sequence[TrialData], source: str) -> Optional[Share]:
    """Of the trials that ended with a pose of the source, however they ended; None without one."""
    count = len(with_final_error(trials, source))
    if count == 0:
        return None
    within = count_within_all(trials, source)
    return Share(count, within, count_within_all(trials, source, (X, Y)),
                 count_within_all(trials, source, (YAW,)), wilson(within, count, LEVEL))


def fewest_trials() -> int:
    """How many trials it takes to reach the required share when all of them end within it."""
    count = 1
    while wilson(count, count, LEVEL).low < REQUIRED_SHARE:
        count += 1
    return count


def encoder_names(labels: Sequence[str]) -> str:
    """Of one or more encoders, the unit once."""
    if IDEAL in labels:
        return listed([ppr_head(label) for label in labels])
    return ppr_head(listed(labels))


def listed(texts: Sequence[str]) -> str:
    """As a sentence has it: a, b and c."""
    return ' and '.join([', '.join(texts[:-1]), texts[-1]] if len(texts) > 1 else texts)
