"""The first question of the report: with which encoders do enough trials end within the tolerance?"""

from __future__ import annotations

from typing import Dict, List, NamedTuple, Optional

from diff_encoder_sim.analysis.dataset import CellKey, Dataset, Varied
from diff_encoder_sim.analysis.within_tolerance import COMPARED_POSES, ComparedPose, FractionWithin


class SummaryRow(NamedTuple):
    """One test with one set of parameters, by one final pose."""

    test: str
    varied: Varied
    pose: ComparedPose
    fractions: Dict[str, Optional[FractionWithin]]  # by encoder, ascending; None without a final pose


def summary_rows(dataset: Dataset) -> List[SummaryRow]:
    """Count the trials within tolerance: by test and set of parameters, a row for each of `COMPARED_POSES`."""
    cells, labels = dataset.cells(), dataset.encoders()
    rows = []
    for test, varied in dataset.setups():
        trials = {label: cells.get(CellKey(test, label, varied)) for label in labels}
        for pose in COMPARED_POSES:
            fractions = {label: pose.fraction(of_cell) for label, of_cell in trials.items() if of_cell}
            rows.append(SummaryRow(test, varied, pose, fractions))
    return rows
