"""Writes the page: what its sections show, and the template that they go into."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence

import jinja2

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.figures.style import Figure
from diff_encoder_sim.analysis.paper.report_section import paper_section
from diff_encoder_sim.analysis.ppr_comparison import PprComparison
from diff_encoder_sim.analysis.quantities import YAW, X
from diff_encoder_sim.analysis.report.closed_form_table import closed_form_table
from diff_encoder_sim.analysis.report.encoders import compare_encoders
from diff_encoder_sim.analysis.report.headline import main_line
from diff_encoder_sim.analysis.report.html_table import html_table
from diff_encoder_sim.analysis.report.pictures import data_uri
from diff_encoder_sim.analysis.report.provenance import provenance
from diff_encoder_sim.analysis.report.summary import Line, answer, encoder_names, listed
from diff_encoder_sim.analysis.report.trials import bag_links, failure_table, trial_table
from diff_encoder_sim.analysis.table_files import Table
from diff_encoder_sim.analysis.table_keys import head_of_test, ppr_head
from diff_encoder_sim.analysis.within_tolerance import REQUIRED_FRACTION, WORDS_OF_SOURCE
from diff_encoder_sim.recording.topics import TOPIC_OF_SOURCE

TEMPLATE = 'page.html'


def write_report(
    dataset: Dataset, tables: Sequence[Table], compared: Sequence[PprComparison], figures: Sequence[Figure], path: Path
) -> str:
    """Write the page into an existing folder; returns its main line, the answer in a sentence.

    Args:
        tables: `all_tables` of the dataset.
        compared: `compare_pprs` of the dataset.

    Raises:
        ConfigError: the file of the paper's numbers cannot be read.
        OSError: a figure cannot be read, or the file not be written.
    """
    sentence = main_line(dataset)
    page = (
        _environment()
        .get_template(TEMPLATE)
        .render(
            title=dataset.title,
            main_line=sentence,
            scope=_scope(dataset),
            notes=dataset.notes,
            origin=provenance(dataset),
            figures=[{'caption': figure.caption, 'uri': data_uri(figure.svg, figure.png)} for figure in figures],
            **_answer(dataset),
            **_tables(dataset, tables, compared),
            **_trials(dataset, path.parent),
            paper=_paper(dataset),
        )
    )
    # The same bytes on every system.
    path.write_bytes(page.encode('utf-8'))
    return sentence


def _environment() -> jinja2.Environment:
    """All that comes from data is escaped; a name that the template misspells is an error."""
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(str(Path(__file__).parent)),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def _scope(dataset: Dataset) -> str:
    """How much was analysed."""
    cells = dataset.cells()
    counts = Counter(map(len, cells.values()))
    fewest, most = min(counts, default=0), max(counts, default=0)
    each = f'{most}' if fewest == most else f'{fewest} to {most}'
    tests, robot = list(dict.fromkeys(cell.test for cell in cells)), dataset.robot
    return (
        f'{len(dataset.trials)} trials: {listed(tests)} with '
        f'{encoder_names(dataset.encoders())}, {each} a cell. Wheel diameter '
        f'{robot.wheel_diameter_m:g} m, separation {robot.wheel_separation_m:g} m.'
    )


def _answer(dataset: Dataset) -> Dict[str, Any]:
    """A table for each test and set of parameters: rows encoders, columns sources."""
    heads = [{'words': words, 'topic': TOPIC_OF_SOURCE[source]} for source, words in WORDS_OF_SOURCE.items()]
    by_test: Dict[str, List[Line]] = {}
    for line in answer(dataset):
        by_test.setdefault(head_of_test(line.test, line.varied), []).append(line)
    return {
        'tolerance': f'{X.tolerance:g} m in x and in y and {YAW.tolerance:g} degrees',
        'required_percent': round(100 * REQUIRED_FRACTION),
        'answer': [
            {
                'name': name,
                'heads': heads,
                'rows': [
                    {'encoder': ppr_head(label), 'shares': [line.shares[label] for line in lines]}
                    for label in lines[0].shares
                ],
            }
            for name, lines in by_test.items()
        ],
    }


def _tables(dataset: Dataset, tables: Sequence[Table], compared: Sequence[PprComparison]) -> Dict[str, Any]:
    encoders, closed_form = compare_encoders(compared), closed_form_table(dataset)
    return {
        'goal_tables': [html_table(table) for table in tables if not table.name.endswith('_intervals')],
        'interval_tables': [html_table(table) for table in tables if table.name.endswith('_intervals')],
        'encoders': {
            'count': encoders.count,
            'verdicts': encoders.verdicts,
            'table': encoders.table and html_table(encoders.table),
        },
        'closed_form': closed_form and html_table(closed_form),
    }


def _trials(dataset: Dataset, folder: Path) -> Dict[str, Any]:
    return {
        'failures': html_table(failure_table(dataset)),
        'trial_count': len(dataset.trials),
        'trials': html_table(trial_table(dataset)),
        'bags': bag_links(dataset, folder),
    }


def _paper(dataset: Dataset) -> Optional[Dict[str, Any]]:
    section = paper_section(dataset)
    return section and {
        'scores': html_table(section.scores),
        'claims': section.claims,
        'cells': [html_table(table) for table in section.cells],
        'errata': html_table(section.errata),
    }
