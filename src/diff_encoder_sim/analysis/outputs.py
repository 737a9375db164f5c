"""All files of an analysis."""

from __future__ import annotations

from pathlib import Path

from diff_encoder_sim.analysis.dataset import Dataset

REPORT = 'report.html'


def write_analysis(dataset: Dataset, folder: Path) -> str:
    """Write tables/, figures/ and the report into a folder; returns the report's main line.

    Raises:
        ConfigError: the file of the paper's numbers cannot be read.
        OSError: a file cannot be written.
    """
    # Imported here: they bring matplotlib and scipy, which bad arguments need not wait for.
    from diff_encoder_sim.analysis.comparison_table import comparison_table
    from diff_encoder_sim.analysis.figures import write_figures
    from diff_encoder_sim.analysis.ppr_comparison import compare_pprs
    from diff_encoder_sim.analysis.report import write_report
    from diff_encoder_sim.analysis.table_files import write_tables
    from diff_encoder_sim.analysis.tables import all_tables

    tables, compared = all_tables(dataset), compare_pprs(dataset)
    # Hundreds of comparisons: nobody reads them on paper.
    write_tables(tables, [comparison_table(dataset, compared)], folder / 'tables')
    figures = write_figures(dataset, folder / 'figures')
    return write_report(dataset, tables, compared, figures, folder / REPORT)
