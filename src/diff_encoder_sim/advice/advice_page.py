"""Advice as an HTML page that works offline."""

from __future__ import annotations

from pathlib import Path

from diff_encoder_sim.advice.advice import Advice
from diff_encoder_sim.advice.advice_charts import advice_charts
from diff_encoder_sim.advice.advice_tables import advice_tables, closed_form_text, own_encoder_text
from diff_encoder_sim.analysis.html_templates import STYLE, load_template
from diff_encoder_sim.base.atomic_files import write_file

TEMPLATE = 'advice.html'


def write_page(advice: Advice, path: Path) -> None:
    """Write the page atomically.

    Raises:
        OSError: the file cannot be written.
    """
    template = load_template(TEMPLATE, Path(__file__).parent, STYLE)
    page = template.render(
        advice=advice,
        scope=_scope(advice),
        closed_form=closed_form_text(advice),
        own_encoder=own_encoder_text(advice),
        charts=advice_charts(advice),
        tables=list(advice_tables(advice)),
    )
    write_file(path, page.encode('utf-8'))


def _scope(advice: Advice) -> str:
    """Return the number of draws and trials behind the answers."""
    parts = []
    for curve in advice.curves.curves:
        draws = min(map(len, curve.errors.values()))
        parts.append(
            f'{curve.test}: at least {draws} samples of one drive with {curve.draws.drive.wheel_way_m:.3g} m per wheel'
        )
    trials = sum(counts.trials for tried in advice.tried for counts in list(tried.within.values())[:1])
    if trials:
        parts.append(f'{trials} closed-loop trials')
    return '; '.join(parts) + '.'
