"""The errors whose standard deviations are drawn against the encoder's resolution."""

from __future__ import annotations

from typing import Callable, NamedTuple, Sequence

import numpy as np

from diff_encoder_sim.analysis.dataset import TrialData
from diff_encoder_sim.analysis.final_errors import final_errors, odometry_minus_truth
from diff_encoder_sim.analysis.quantities import Quantity
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource

ErrorsOf = Callable[[Sequence[TrialData], Quantity], np.ndarray]


class Series(NamedTuple):
    """One line of the figure."""

    label: str
    colour: str  # of Okabe and Ito's palette, for colour-blind readers
    marker: str
    errors: ErrorsOf  # of a cell


def _final(source: PoseSource, colour: str, marker: str) -> Series:
    def errors(trials: Sequence[TrialData], quantity: Quantity) -> np.ndarray:
        return final_errors(trials, source, quantity)

    return Series(f'{TOPIC_OF_SOURCE[source]} minus goal', colour, marker, errors)


SERIES = (
    Series('/odom minus /world_pose', '#0072b2', 'o', odometry_minus_truth),
    _final(PoseSource.ODOM, '#56b4e9', 's'),
    _final(PoseSource.WORLD, '#000000', 'D'),
    _final(PoseSource.GLOBAL, '#d55e00', '^'),
    _final(PoseSource.AMCL, '#e69f00', 'v'),
)
