"""Writes the report: renders the template with its sections."""

from __future__ import annotations

from pathlib import Path
from typing import Sequence

import jinja2

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.figures.style import Figure
from diff_encoder_sim.analysis.ppr_comparison import PprComparison
from diff_encoder_sim.analysis.report.headline import Headline, headline
from diff_encoder_sim.analysis.report.pictures import data_uri
from diff_encoder_sim.analysis.report.provenance import provenance
from diff_encoder_sim.analysis.report.robot_section import robot_section
from diff_encoder_sim.analysis.report.sections import (
    paper_content,
    scope_text,
    summary_content,
    tables_content,
    trials_content,
)
from diff_encoder_sim.analysis.table import Table

TEMPLATE = 'page.html'


def write_report(
    dataset: Dataset, tables: Sequence[Table], compared: Sequence[PprComparison], figures: Sequence[Figure], path: Path
) -> Headline:
    """Write the page into an existing folder; return its headline.

    Args:
        dataset: the trials.
        tables: `all_tables` of the dataset.
        compared: `compare_pprs` of the dataset.
        figures: `write_figures` of the dataset.
        path: of the page.

    Raises:
        ConfigError: the file of the paper's numbers cannot be read.
        OSError: a figure cannot be read, or the file not be written.
    """
    lead = headline(dataset)
    page = _template().render(
        title=dataset.title,
        headline=lead,
        scope=scope_text(dataset),
        notes=dataset.notes,
        robot=robot_section(dataset),
        origin=provenance(dataset),
        figures=[{'caption': figure.caption, 'uri': data_uri(figure.svg, figure.png)} for figure in figures],
        summary=summary_content(dataset),
        paper=paper_content(dataset),
        **tables_content(dataset, tables, compared),
        **trials_content(dataset, path.parent),
    )
    # Bytes: the same line ends on every system.
    path.write_bytes(page.encode('utf-8'))
    return lead


def _template() -> jinja2.Template:
    """Load the template; it escapes all data and refuses unknown names."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(str(Path(__file__).parent)),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(TEMPLATE)
