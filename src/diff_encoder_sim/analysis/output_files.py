"""Writes all files of an analysis. Importing this module imports matplotlib and scipy."""

from __future__ import annotations

from pathlib import Path
from typing import Optional

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.encoder_comparison import compare_pprs, comparison_table
from diff_encoder_sim.analysis.figures import write_figures
from diff_encoder_sim.analysis.output_folder import REPORT
from diff_encoder_sim.analysis.paper.report_section import paper_section
from diff_encoder_sim.analysis.report import write_report
from diff_encoder_sim.analysis.table import write_tables
from diff_encoder_sim.analysis.tables import all_tables


def write_files(dataset: Dataset, folder: Path, beside: Optional[Dataset] = None) -> str:
    """Write tables/, figures/ and the report into a folder; return the conclusions as lines for the terminal.

    Args:
        dataset: the trials.
        folder: an existing one.
        beside: other trials, shown in the comparison with the paper alone.

    Raises:
        ConfigError: the file of the paper's numbers cannot be read, or `beside` has no cell of the paper.
        OSError: a file cannot be written.
    """
    tables, compared = all_tables(dataset), compare_pprs(dataset)
    paper = paper_section([dataset, beside] if beside else [dataset])
    of_paper = [] if paper is None else [paper.scores, *paper.cells, paper.all_cells]
    write_tables([*tables, comparison_table(dataset, compared), *of_paper], folder / 'tables')
    figures = write_figures(dataset, folder / 'figures')
    lead = write_report(dataset, tables, compared, figures, paper, folder / REPORT)
    is_concluded = paper is not None and (beside is not None or paper.has_enough_trials)
    return '\n'.join([lead.text, *(paper.texts if paper and is_concluded else [])])
