"""Selects the final errors that a part of a claim is about."""

from __future__ import annotations

from typing import Dict, List, NamedTuple, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.dataset import TrialData
from diff_encoder_sim.analysis.final_errors import equal_trials, final_errors
from diff_encoder_sim.analysis.quantities import Quantity, X, Y
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource

# The trials of one set of parameters, by test and PPR.
TrialsByCell = Dict[Tuple[str, str], List[TrialData]]


class Sample(NamedTuple):
    """The errors of a pose source in one cell."""

    label: str  # as the report shows it
    values: np.ndarray  # (n,) in the quantity's unit
    quantity: Quantity


class Pair(NamedTuple):
    """Errors of equal trials, which are compared in pairs."""

    label: str  # as the report shows it
    names: Tuple[str, str]
    values: Tuple[np.ndarray, np.ndarray]  # (n,) each, in the quantity's unit
    quantity: Quantity


def samples(
    trials: TrialsByCell, source: PoseSource, tests: Sequence[str], pprs: Sequence[str], quantities: Sequence[Quantity]
) -> List[Sample]:
    """Return a sample for each cell and quantity; it is empty where there is no such cell."""
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
    """Pair equal trials with two encoders; a pair is empty where one of them is missing."""
    pairs = []
    for test in tests:
        for first, second in pprs:
            cells = equal_trials(trials.get((test, first), []), trials.get((test, second), []), source)
            pairs += [
                Pair(
                    f'{TOPIC_OF_SOURCE[source]} in {test}, {quantity.axis}',
                    (f'{first} PPR', f'{second} PPR'),
                    (final_errors(cells[0], source, quantity), final_errors(cells[1], source, quantity)),
                    quantity,
                )
                for quantity in quantities
            ]
    return pairs


def pairs_of_y_and_x(trials: TrialsByCell, source: PoseSource, tests: Sequence[str], pprs: Sequence[str]) -> List[Pair]:
    """Pair both errors of position of each trial."""
    pairs = []
    for test in tests:
        for ppr in pprs:
            cell = trials.get((test, ppr), [])
            label = f'{TOPIC_OF_SOURCE[source]} in {test} at {ppr} PPR'
            pairs.append(Pair(label, ('y', 'x'), (final_errors(cell, source, Y), final_errors(cell, source, X)), X))
    return pairs


def pooled_over_tests(
    trials: TrialsByCell, source: PoseSource, tests: Sequence[str], pprs: Sequence[str], quantity: Quantity
) -> List[Sample]:
    """Return a sample for each encoder over all tests."""
    return [
        Sample(
            f'{TOPIC_OF_SOURCE[source]} at {ppr} PPR, {quantity.axis}',
            final_errors([trial for test in tests for trial in trials.get((test, ppr), [])], source, quantity),
            quantity,
        )
        for ppr in pprs
    ]
