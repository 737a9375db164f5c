"""The section of the report that compares the dataset with the paper."""

from __future__ import annotations

from typing import Dict, List, NamedTuple, Optional

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.paper.against_paper import cell_tables, errata_table, resolution_table, score_table
from diff_encoder_sim.analysis.paper.claim_results import ClaimResult, check_claims
from diff_encoder_sim.analysis.paper.paper_comparison import compare_with_paper
from diff_encoder_sim.analysis.table import Table
from diff_encoder_sim.analysis.table_keys import varied_texts


class PaperSection(NamedTuple):
    """What the report shows of the paper."""

    scores: Table
    claims: Dict[str, List[ClaimResult]]  # by the values of the varied parameters, '' without
    cells: List[Table]
    errata: Table


def paper_section(dataset: Dataset) -> Optional[PaperSection]:
    """Compare the dataset with the paper; None where they have no cell in common.

    Raises:
        ConfigError: the file of the paper's numbers cannot be read.
    """
    comparison = compare_with_paper(dataset)
    if not comparison.rows:
        return None
    claims: Dict[str, List[ClaimResult]] = {}
    for claim in check_claims(dataset):
        claims.setdefault(', '.join(varied_texts(claim.varied)), []).append(claim)
    cells = [resolution_table(comparison), *cell_tables(comparison)]
    return PaperSection(score_table(comparison), claims, cells, errata_table())
