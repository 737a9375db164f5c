"""The report: its sections, and the page that the template makes of them."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence

from diff_encoder_sim.analysis.closed_form import closed_form_table
from diff_encoder_sim.analysis.dataset import Dataset, distinct
from diff_encoder_sim.analysis.encoder_comparison import PprComparison, compare_encoders
from diff_encoder_sim.analysis.encoder_labels import encoders_text, enumeration, ppr_text
from diff_encoder_sim.analysis.figures.style import Figure
from diff_encoder_sim.analysis.first_trials import first_of_cells, sample_text
from diff_encoder_sim.analysis.html_templates import load_template
from diff_encoder_sim.analysis.paper.report_section import PaperSection
from diff_encoder_sim.analysis.quantities import REQUIRED_FRACTION
from diff_encoder_sim.analysis.report.chart_paths import path_indices
from diff_encoder_sim.analysis.report.headline import Headline, SummaryRow, headline, summary_rows
from diff_encoder_sim.analysis.report.origin import encoder_section, provenance, robot_section
from diff_encoder_sim.analysis.report.pictures import data_uri
from diff_encoder_sim.analysis.report.trial_charts import trial_charts
from diff_encoder_sim.analysis.report.trials import bag_links, failure_table, trial_table
from diff_encoder_sim.analysis.table import Table, html_table
from diff_encoder_sim.analysis.table_keys import setup_text
from diff_encoder_sim.analysis.variant_errors import VARIANTS, first_variant
from diff_encoder_sim.analysis.within_tolerance import COMPARED_POSES, TOLERANCE_TEXT
from diff_encoder_sim.trials.campaign_cells import VARIANT


def scope_text(dataset: Dataset) -> str:
    """Describe what was analysed."""
    cells, robot = dataset.cells(), dataset.robot
    counts = Counter(map(len, cells.values()))
    fewest, most = min(counts, default=0), max(counts, default=0)
    per_cell = f'{most}' if fewest == most else f'{fewest} to {most}'
    tests, encoders = enumeration(distinct(cell.test for cell in cells)), encoders_text(dataset.encoders())
    return (
        f'{len(dataset.trials)} trials: {tests} with {encoders}, {per_cell} per cell. '
        f'Wheel diameter {robot.wheel_diameter_m:g} m, separation {robot.wheel_separation_m:g} m.'
    )


def summary_content(dataset: Dataset) -> Dict[str, Any]:
    """Collect a table for each test and set of parameters: rows encoders, columns final poses."""
    main: Dict[str, List[SummaryRow]] = {}
    of_variants: Dict[str, List[SummaryRow]] = {}
    first = first_variant(dataset.cells())
    for row in summary_rows(dataset):
        tables = main if dict(row.varied).get(VARIANT, first) == first else of_variants
        tables.setdefault(setup_text(row.test, row.varied), []).append(row)
    return {
        'tolerance': TOLERANCE_TEXT,
        'required_percent': round(100 * REQUIRED_FRACTION),
        'heads': [{'text': pose.text, 'topic': pose.topics} for pose in COMPARED_POSES],
        'tables': {name: _encoder_rows(by_source) for name, by_source in main.items()},
        'of_variants': {name: _encoder_rows(by_source) for name, by_source in of_variants.items()},
    }


def _encoder_rows(by_source: Sequence[SummaryRow]) -> List[Dict[str, Any]]:
    return [
        {'encoder': ppr_text(label), 'fractions': [row.fractions[label] for row in by_source]}
        for label in by_source[0].fractions
    ]


def figures_content(figures: Sequence[Figure], tables: Sequence[Table]) -> Dict[str, Any]:
    """Collect the figures; that of variants with its table, as None where there are none."""
    shown = {figure.name: _embedded(figure) for figure in figures}
    table = next((table for table in tables if table.name == VARIANTS), None)
    return {
        'variants': table and {'figure': shown.pop(VARIANTS, None), 'table': html_table(table)},
        'figures': list(shown.values()),
    }


def _embedded(figure: Figure) -> Dict[str, str]:
    return {'caption': figure.caption, 'uri': data_uri(figure.svg, figure.png)}


def tables_content(dataset: Dataset, tables: Sequence[Table], compared: Sequence[PprComparison]) -> Dict[str, Any]:
    """Collect the tables, and the comparison of the encoders."""
    encoders, closed_form = compare_encoders(compared), closed_form_table(dataset)
    return {
        'goal_tables': [html_table(table) for table in tables if not table.name.endswith(('_intervals', VARIANTS))],
        'interval_tables': [html_table(table) for table in tables if table.name.endswith('_intervals')],
        'encoders': {**encoders._asdict(), 'table': encoders.table and html_table(encoders.table)},
        'closed_form': closed_form and html_table(closed_form),
    }


def trials_content(dataset: Dataset, shown: Dataset, folder: Path) -> Dict[str, Any]:
    """Collect the failures, and a row for each trial that is shown.

    Args:
        dataset: all trials.
        shown: the trials with rows: of many, some.
        folder: of the page, from which bags are linked.
    """
    return {
        'failures': html_table(failure_table(dataset)),
        'trials_shown': sample_text(shown, dataset) or f'All {len(dataset.trials)} trials',
        'trials': html_table(trial_table(shown)),
        'bags': bag_links(shown, folder),
        'with_path': path_indices(shown),
    }


def paper_content(section: PaperSection) -> Dict[str, Any]:
    """Collect the comparison with the paper; a row of claims has the result of each reading."""
    return {
        'texts': section.texts,
        'scores': html_table(section.scores),
        'readings': list(section.claims),
        'claims': list(zip(*section.claims.values())),
        'cells': [html_table(table) for table in section.cells],
        'errata': html_table(section.errata),
    }


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
