"""Compares the paper's tables 3 to 6 with our own numbers. It prints no mean."""

from __future__ import annotations

from typing import Dict, Iterator, List, NamedTuple, Optional, Tuple

from diff_encoder_sim.analysis.dataset import CellKey, Dataset, Varied
from diff_encoder_sim.analysis.encoder_labels import ppr_values
from diff_encoder_sim.analysis.final_errors import final_errors
from diff_encoder_sim.analysis.paired_statistics import SIGNIFICANCE, holm
from diff_encoder_sim.analysis.paper.errata import errata_of
from diff_encoder_sim.analysis.paper.paper_cells import PaperCell, load_paper_cells
from diff_encoder_sim.analysis.paper.printed_resolutions import ComparedResolution, compare_resolutions
from diff_encoder_sim.analysis.paper.statistic_tests import COMPARISONS, Agreement
from diff_encoder_sim.drives.topics import PoseSource

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
    p_adjusted: Optional[float]  # by Holm, over the cells of its family that are evidence; None where it is none

    @property
    def is_calibrated(self) -> bool:
        """Return whether config/campaigns/paper.yaml was fitted to it, so that it is no prediction."""
        paper = self.paper
        return (paper.table, paper.test, paper.ppr, paper.quantity.name) == CALIBRATED

    @property
    def is_evidence(self) -> bool:
        """Return whether it speaks for or against: a sound number of the paper, not fitted to, that can be tested."""
        return not self.errata and not self.is_calibrated and self.agreement.p_value is not None

    @property
    def is_contradicted(self) -> bool:
        """Return whether chance does not explain the difference, corrected for the number of cells in its family."""
        return self.p_adjusted is not None and self.p_adjusted < SIGNIFICANCE

    @property
    def family(self) -> Tuple[PoseSource, str, Varied]:
        """Return what the cells that are judged together have in common."""
        return self.paper.source, self.paper.test, self.cell.varied


class PaperComparison(NamedTuple):
    """All numbers that the paper and the dataset both have."""

    rows: List[ComparedCell]
    resolutions: List[ComparedResolution]  # table 3 for this robot, PPR ascending


def compare_with_paper(dataset: Dataset) -> PaperComparison:
    """Compare each number of the paper with ours, where the dataset has its test and PPR.

    Raises:
        ConfigError: the file of the paper's numbers cannot be read.
    """
    resolutions = compare_resolutions(ppr_values(dataset.encoders()), *dataset.robot)
    return PaperComparison(_judged(list(_compared_cells(dataset, load_paper_cells()))), resolutions)


def _judged(cells: List[ComparedCell]) -> List[ComparedCell]:
    """Correct the p-values in each family for the number of its cells."""
    families: Dict[Tuple[PoseSource, str, Varied], List[int]] = {}
    for index, one in enumerate(cells):
        if one.is_evidence:
            families.setdefault(one.family, []).append(index)
    for indices in families.values():
        adjusted = holm([p_value for index in indices if (p_value := cells[index].agreement.p_value) is not None])
        for index, p_value in zip(indices, adjusted):
            cells[index] = cells[index]._replace(p_adjusted=p_value)
    return cells


def _compared_cells(dataset: Dataset, printed: List[PaperCell]) -> Iterator[ComparedCell]:
    for cell, trials in dataset.cells().items():
        for paper in printed:
            if (paper.test, paper.ppr) == (cell.test, cell.ppr):
                values = final_errors(trials, paper.source, paper.quantity)
                agreement = COMPARISONS[paper.statistic](values, paper.value, paper.quantity)
                if agreement is not None:
                    yield ComparedCell(paper, cell, len(values), agreement, errata_of(paper), None)
