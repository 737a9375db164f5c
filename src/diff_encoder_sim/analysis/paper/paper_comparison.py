"""Compares the paper's tables 3 to 6 with our own numbers. It prints no mean."""

from __future__ import annotations

from collections import Counter
from typing import Dict, Iterator, List, NamedTuple, Optional, Tuple

from diff_encoder_sim.analysis.dataset import CellKey, Dataset
from diff_encoder_sim.analysis.encoder_labels import ppr_values
from diff_encoder_sim.analysis.final_errors import final_errors
from diff_encoder_sim.analysis.paper.errata import errata_of
from diff_encoder_sim.analysis.paper.paper_cells import PaperCell, load_paper_cells
from diff_encoder_sim.analysis.paper.printed_resolutions import ComparedResolution, compare_resolutions
from diff_encoder_sim.analysis.paper.statistic_tests import COMPARISONS, Agreement
from diff_encoder_sim.evaluation.paired_statistics import SIGNIFICANCE
from diff_encoder_sim.trials.pose_source import PoseSource

# The only cells that parameters were fitted to: table, test, PPR and quantity
# (docs/adr/0012-calibration.md).
CALIBRATED = (4, 'SL', '4096', 'y_m')


class ComparedCell(NamedTuple):
    """A number of the paper and ours."""

    paper: PaperCell
    cell: CellKey  # ours; there are several of one test and PPR where parameters are varied
    trials: int  # ours
    agreement: Agreement
    errata: List[str]  # keys of errata.ERRATA

    @property
    def is_compatible(self) -> Optional[bool]:
        """Return whether chance alone can explain the difference; None where that is unknown."""
        p_value = self.agreement.p_value
        return None if p_value is None else p_value >= SIGNIFICANCE

    @property
    def is_calibrated(self) -> bool:
        """Return whether config/campaigns/paper.yaml was fitted to it, so that it is no prediction."""
        paper = self.paper
        return (paper.table, paper.test, paper.ppr, paper.quantity.name) == CALIBRATED


class Score(NamedTuple):
    """How many cells of a kind agree; chance alone makes about one in twenty differ."""

    tested: int
    compatible: int


class PaperComparison(NamedTuple):
    """All numbers that the paper and the dataset both have."""

    rows: List[ComparedCell]
    resolutions: List[ComparedResolution]  # table 3 for this robot, PPR ascending

    def scores(self) -> Dict[Tuple[PoseSource, str], Score]:
        """Score the predictions by source and PPR, without the cells that the paper's errata affect."""
        sound = [row for row in self.rows if row.is_compatible is not None and not row.errata and not row.is_calibrated]
        tested = Counter((row.paper.source, row.paper.ppr) for row in sound)
        compatible = Counter((row.paper.source, row.paper.ppr) for row in sound if row.is_compatible)
        return {key: Score(count, compatible[key]) for key, count in tested.items()}


def compare_with_paper(dataset: Dataset) -> PaperComparison:
    """Compare each number of the paper with ours, where the dataset has its test and PPR.

    Raises:
        ConfigError: the file of the paper's numbers cannot be read.
    """
    resolutions = compare_resolutions(ppr_values(dataset.encoders()), *dataset.robot)
    return PaperComparison(list(_compared_cells(dataset, load_paper_cells())), resolutions)


def _compared_cells(dataset: Dataset, printed: List[PaperCell]) -> Iterator[ComparedCell]:
    for cell, trials in dataset.cells().items():
        for paper in printed:
            if (paper.test, paper.ppr) == (cell.test, cell.ppr):
                values = final_errors(trials, paper.source, paper.quantity)
                agreement = COMPARISONS[paper.statistic](values, paper.value, paper.quantity)
                if agreement is not None:
                    yield ComparedCell(paper, cell, len(values), agreement, errata_of(paper))
