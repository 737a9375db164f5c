"""How many cells of the paper a campaign meets, by source and test, and which of two campaigns fits better."""

from __future__ import annotations

from typing import Dict, List, NamedTuple, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.dataset import distinct
from diff_encoder_sim.analysis.paired_statistics import SIGNIFICANCE, mcnemar
from diff_encoder_sim.analysis.paper.paper_cells import PaperCell
from diff_encoder_sim.analysis.paper.paper_comparison import ComparedCell
from diff_encoder_sim.analysis.signed_rank import signed_rank_p
from diff_encoder_sim.drives.topics import PoseSource

# Compared cells of a campaign, or of one set of its varied parameters, by the name that tells them apart.
Readings = Dict[str, List[ComparedCell]]


class Score(NamedTuple):
    """How many cells agree, of those that are evidence."""

    compared: int
    inside: int  # our 95 % interval
    alone: int  # p at least 5 %, each cell for itself
    in_family: int  # not contradicted when all cells of a source and test are judged together


class BetterFit(NamedTuple):
    """Which of two readings agrees with more of the cells that are evidence in both."""

    only: Tuple[int, int]  # cells that agree with the first alone, and with the second alone
    mcnemar_p: float  # as if the cells were independent
    grouped_p: float  # signed ranks of the groups of cells with common trials: of one test and PPR


def score(cells: Sequence[ComparedCell]) -> Score:
    """Count the cells that agree."""
    evidence = [one for one in cells if one.is_evidence]
    return Score(
        len(evidence),
        sum(one.agreement.is_inside for one in evidence),
        sum(_agrees(one) for one in evidence),
        sum((one.p_adjusted or 0.0) >= SIGNIFICANCE for one in evidence),
    )


def scores_by_family(cells: Sequence[ComparedCell]) -> Dict[Tuple[PoseSource, str], Score]:
    """Score the cells of one reading by source and test, in the order of the sources."""
    order = list(PoseSource)
    keys = sorted(distinct((one.paper.source, one.paper.test) for one in cells), key=lambda key: order.index(key[0]))
    return {key: score([one for one in cells if (one.paper.source, one.paper.test) == key]) for key in keys}


def better_fit(first: Sequence[ComparedCell], second: Sequence[ComparedCell]) -> BetterFit:
    """Compare two readings cell by cell, whether each agrees for itself."""
    agrees = [{one.paper: _agrees(one) for one in cells if one.is_evidence} for cells in (first, second)]
    common = [cell for cell in agrees[0] if cell in agrees[1]]
    pair = [np.array([of_reading[cell] for cell in common], dtype=bool) for of_reading in agrees]
    only = (int(np.count_nonzero(pair[0] & ~pair[1])), int(np.count_nonzero(pair[1] & ~pair[0])))
    return BetterFit(only, mcnemar(pair[0], pair[1]).p_value, signed_rank_p(_differences(common, pair[0], pair[1])))


def _differences(cells: Sequence[PaperCell], first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return in how many more cells the first agrees than the second, (groups,): for each test and PPR."""
    groups = [(cell.test, cell.ppr) for cell in cells]
    balance = first.astype(float) - second.astype(float)
    return np.array([balance[[other == group for other in groups]].sum() for group in distinct(groups)])


def _agrees(one: ComparedCell) -> bool:
    return one.agreement.p_value is not None and one.agreement.p_value >= SIGNIFICANCE
