"""Writes all files of an analysis. Importing this module imports matplotlib and scipy."""

from __future__ import annotations

from pathlib import Path

from diff_encoder_sim.analysis.comparison_table import comparison_table
from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.figures import write_figures
from diff_encoder_sim.analysis.output_folder import REPORT
from diff_encoder_sim.analysis.ppr_comparison import compare_pprs
from diff_encoder_sim.analysis.report import write_report
from diff_encoder_sim.analysis.report.headline import Headline
from diff_encoder_sim.analysis.table_files import write_tables
from diff_encoder_sim.analysis.tables import all_tables


def write_files(dataset: Dataset, folder: Path) -> Headline:
    """Write tables/, figures/ and the report into a folder; return the report's headline.

    Raises:
        ConfigError: the file of the paper's numbers cannot be read.
        OSError: a file cannot be written.
    """
    tables, compared = all_tables(dataset), compare_pprs(dataset)
    # The comparisons have hundreds of rows: as CSV only.
    write_tables(tables, [comparison_table(dataset, compared)], folder / 'tables')
    figures = write_figures(dataset, folder / 'figures')
    return write_report(dataset, tables, compared, figures, folder / REPORT)
