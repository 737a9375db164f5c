"""Which of our errors a part of a claim is about."""

from __future__ import annotations

from typing import Dict, List, NamedTuple, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.dataset import TrialData
from diff_encoder_sim.analysis.final_errors import equal_trials, final_errors
from diff_encoder_sim.analysis.quantities import Quantity, X, Y
from diff_encoder_sim.recording.topics import TOPIC_OF_SOURCE
from diff_encoder_sim.trials.pose_source import PoseSource

# Of one set of parameters, by test and PPR.
TrialsByCell = Dict[Tuple[str, str], List[TrialData]]


class Sample(NamedTuple):
    """Errors of a source in one cell."""

    label: str  # for people
    values: np.ndarray
    quantity: Quantity


class Pair(NamedTuple):
    """Errors of equal trials, which are compared one by one."""

    label: str
    names: Tuple[str, str]
    values: Tuple[np.ndarray, np.ndarray]
    quantity: Quantity


def samples(
    trials: TrialsByCell, source: PoseSource, tests: Sequence[str], pprs: Sequence[str], quantities: Sequence[Quantity]
) -> List[Sample]:
    """Of each cell and quantity; without values where there is no such cell."""
    return [
        Sample(
            f'{TOPIC_OF_SOURCE[source]} in {test} at {ppr} PPR, {quantity.axis}',
            final_errors(trials.get((test, ppr), []), source, quantity),
            quantity,
        )
        for test in tests
        for ppr in pprs
        for quantity in quantities
    ]


def pairs_of_pprs(
    trials: TrialsByCell,
    source: PoseSource,
    tests: Sequence[str],
    pprs: Sequence[Tuple[str, str]],
    quantities: Sequence[Quantity],
) -> List[Pair]:
    """The same trials with two encoders; without values where one is missing."""
    pairs = []
    for test in tests:
        for two in pprs:
            cells = equal_trials(*(trials.get((test, ppr), []) for ppr in two), source)
            pairs += [
                Pair(
                    f'{TOPIC_OF_SOURCE[source]} in {test}, {quantity.axis}',
                    (f'{two[0]} PPR', f'{two[1]} PPR'),
                    (final_errors(cells[0], source, quantity), final_errors(cells[1], source, quantity)),
                    quantity,
                )
                for quantity in quantities
            ]
    return pairs


def pairs_of_y_and_x(trials: TrialsByCell, source: PoseSource, tests: Sequence[str], pprs: Sequence[str]) -> List[Pair]:
    """Both errors of position of each trial."""
    return [
        Pair(
            f'{TOPIC_OF_SOURCE[source]} in {test} at {ppr} PPR',
            ('y', 'x'),
            (
                final_errors(trials.get((test, ppr), []), source, Y),
                final_errors(trials.get((test, ppr), []), source, X),
            ),
            X,
        )
        for test in tests
        for ppr in pprs
    ]


def pooled_over_tests(
    trials: TrialsByCell, source: PoseSource, tests: Sequence[str], pprs: Sequence[str], quantity: Quantity
) -> List[Sample]:
    """Of each encoder in all the tests that there are."""
    return [
        Sample(
            f'{TOPIC_OF_SOURCE[source]} at {ppr} PPR, {quantity.axis}',
            final_errors([trial for test in tests for trial in trials.get((test, ppr), [])], source, quantity),
            quantity,
        )
        for ppr in pprs
    ]
