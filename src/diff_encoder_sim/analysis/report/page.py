"""Writes the page: what its sections show, and the template that they go into."""
from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Sequence

import jinja2

from diff_encoder_sim.analysis.claims import judge_claims
from diff_encoder_sim.analysis.dataset import TOPIC_OF_SOURCE, Dataset
from diff_encoder_sim.analysis.figures.style import Figure
from diff_encoder_sim.analysis.paper import compare_with_paper
from diff_encoder_sim.analysis.paper_cells import X, YAW
from diff_encoder_sim.analysis.report.against_paper import (accuracy_table, cell_tables,
                                                            errata_table, finding_counts,
                                                            score_table)
from diff_encoder_sim.analysis.report.answer import (REQUIRED_SHARE, WORDS_OF_SOURCE, Line,
                                                     answer, encoder_names, listed)
from diff_encoder_sim.analysis.report.closed_form import closed_form_table
from diff_encoder_sim.analysis.report.encoders import compare_encoders
from diff_encoder_sim.analysis.report.html_table import html_table
from diff_encoder_sim.analysis.report.main_line import main_line
from diff_encoder_sim.analysis.report.pictures import data_uri
from diff_encoder_sim.analysis.report.provenance import provenance
from diff_encoder_sim.analysis.report.trials import bag_links, failure_table, trial_table
from diff_encoder_sim.analysis.tables import all_tables, ppr_head

NAME = 'report.html'
TEMPLATE = 'page.html'


class Report(NamedTuple):
    """What was written."""

    path: Path
    main_line: str      # the answer in a sentence


def write_report(dataset: Dataset, figures: Sequence[Figure], folder: Path) -> Report:
    """Write report.html into an existing folder.

    Raises:
        ConfigError: a bag or the file of the paper's numbers cannot be read.
        OSError: a figure cannot be read, or the file not be written.
    """
    sentence = main_line(dataset)
    path = folder / NAME
    page = _environment().get_template(TEMPLATE).render(
        title=dataset.title, main_line=sentence, scope=_scope(dataset),
        notes=dataset.notes, origin=provenance(dataset),
        figures=[{'caption': figure.caption, 'uri': data_uri(figure.svg, figure.png)}
                 for figure in figures],
        **_answer(dataset), **_tables(dataset), **_trials(dataset, folder), paper=_paper(dataset))
    # The same bytes on every system.
    path.write_bytes(page.encode('utf-8'))
    return Report(path, sentence)


def _environment() -> jinja2.Environment:
    """All that comes from data is escaped; a name that the template misspells is an error."""
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(str(Path(__file__).parent)), autoescape=True,
        undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True)


def _scope(dataset: Dataset) -> str:
    """How much was analysed."""
    cells = dataset.cells()
    counts = Counter(map(len, cells.values()))
    fewest, most = min(counts, default=0), max(counts, default=0)
    each = f'{most}' if fewest == most else f'{fewest} to {most}'
    tests, encoders = (list(dict.fromkeys(getattr(cell, key) for cell in cells))
                       for key in ('test', 'ppr'))
    robot = dataset.robot
    return (f'{len(dataset.trials)} trials: {listed(tests)} with {encoder_names(encoders)}, {each} '
            f'a cell. Wheel diameter {robot.wheel_diameter_m:g} m, separation '
            f'{robot.wheel_separation_m:g} m.')


def _answer(dataset: Dataset) -> Dict[str, Any]:
    """A table for each test and set of parameters: rows encoders, columns sources."""
    heads = [{'words': words, 'topic': TOPIC_OF_SOURCE[source]}
             for source, words in WORDS_OF_SOURCE.items()]
    by_test: Dict[str, List[Line]] = {}
    for line in answer(dataset):
        by_test.setdefault(', '.join([line.test, *_texts(line.varied)]), []).append(line)
    return {'tolerance': f'{X.tolerance:g} m in x and in y and {YAW.tolerance:g} degrees',
            'required_percent': round(100 * REQUIRED_SHARE),
            'answer': [{'name': name, 'heads': heads, 'rows': [
                {'encoder': ppr_head(label), 'shares': [line.shares[label] for line in lines]}
                for label in lines[0].shares]} for name, lines in by_test.items()]}


def _tables(dataset: Dataset) -> Dict[str, Any]:
    tables = all_tables(dataset)
    encoders, closed_form = compare_encoders(dataset), closed_form_table(dataset)
    return {'goal_tables': [html_table(table) for table in tables
                            if not table.name.endswith('_intervals')],
            'interval_tables': [html_table(table) for table in tables
                                if table.name.endswith('_intervals')],
            'encoders': {'count': encoders.count, 'verdicts': encoders.verdicts,
                         'table': encoders.table and html_table(encoders.table)},
            'closed_form': closed_form and html_table(closed_form)}


def _trials(dataset: Dataset, folder: Path) -> Dict[str, Any]:
    return {'failures': html_table(failure_table(dataset)), 'trial_count': len(dataset.trials),
            'trials': html_table(trial_table(dataset)), 'bags': bag_links(dataset, folder)}


def _paper(dataset: Dataset) -> Dict[str, Any]:
    comparison = compare_with_paper(dataset)
    if not comparison.rows:
        return {'cells': []}
    judged: Dict[str, List[Dict[str, Any]]] = {}
    for claim in judge_claims(dataset):
        judged.setdefault(', '.join(_texts(claim.varied)), []).append(
            {**claim._asdict(), 'counts': finding_counts(claim)})
    return {'cells': [html_table(table) for table in (accuracy_table(comparison),
                                                      *cell_tables(comparison))],
            'scores': html_table(score_table(comparison)), 'errata': html_table(errata_table()),
            'claims': [{'name': name, 'claims': claims} for name, claims in judged.items()]}


def _texts(varied: Sequence[Any]) -> List[str]:
    return [f'{key} {value}' for key, value in varied]
