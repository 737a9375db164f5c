"""All files of an analysis."""
from __future__ import annotations

from pathlib import Path

from diff_encoder_sim.analysis.dataset import Dataset


def write_analysis(dataset: Dataset, folder: Path) -> str:
    """Write tables/, figures/ and report.html into a folder; returns the report's main line.

    Raises:
        OSError: a file cannot be written.
    """
    # Imported here: they bring matplotlib and scipy, which bad arguments need not wait for.
    from diff_encoder_sim.analysis.figures import write_figures
    from diff_encoder_sim.analysis.report import write_report
    from diff_encoder_sim.analysis.tables import write_tables
    write_tables(dataset, folder / 'tables')
    figures = write_figures(dataset, folder / 'figures')
    return write_report(dataset, figures, folder).main_line
