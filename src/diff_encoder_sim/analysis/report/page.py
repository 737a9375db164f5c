"""Writes the report: renders the template with its sections."""

from __future__ import annotations

from pathlib import Path
from typing import Optional, Sequence

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.figures.style import Figure
from diff_encoder_sim.analysis.first_trials import first_of_cells
from diff_encoder_sim.analysis.html_templates import load_template
from diff_encoder_sim.analysis.paper.report_section import PaperSection
from diff_encoder_sim.analysis.ppr_comparison import PprComparison
from diff_encoder_sim.analysis.report.encoder_section import encoder_section
from diff_encoder_sim.analysis.report.headline import Headline, headline
from diff_encoder_sim.analysis.report.provenance import provenance
from diff_encoder_sim.analysis.report.robot_section import robot_section
from diff_encoder_sim.analysis.report.sections import (
    figures_content,
    paper_content,
    scope_text,
    summary_content,
    tables_content,
    trials_content,
)
from diff_encoder_sim.analysis.report.trial_charts import trial_charts
from diff_encoder_sim.analysis.table import Table

TEMPLATE = 'page.html'


def write_report(
    dataset: Dataset,
    tables: Sequence[Table],
    compared: Sequence[PprComparison],
    figures: Sequence[Figure],
    paper: Optional[PaperSection],
    path: Path,
) -> Headline:
    """Write the page into an existing folder; return its headline.

    Args:
        dataset: the trials.
        tables: `all_tables` of the dataset.
        compared: `compare_pprs` of the dataset.
        figures: `write_figures` of the dataset.
        paper: the comparison with the paper; None where there is nothing to compare.
        path: of the page.

    Raises:
        OSError: a figure cannot be read, or the file not be written.
    """
    lead, shown = headline(dataset), first_of_cells(dataset)
    page = load_template(TEMPLATE, Path(__file__).parent).render(
        title=dataset.title,
        headline=lead,
        scope=scope_text(dataset),
        notes=dataset.notes,
        robot=robot_section(dataset),
        real_encoders=encoder_section(dataset),
        origin=provenance(dataset),
        summary=summary_content(dataset),
        paper=paper and paper_content(paper),
        **figures_content(figures, tables),
        **tables_content(dataset, tables, compared),
        **trials_content(dataset, shown, path.parent),
        charts=trial_charts(dataset, shown),
    )
    # Bytes: the same line ends on every system.
    path.write_bytes(page.encode('utf-8'))
    return lead
