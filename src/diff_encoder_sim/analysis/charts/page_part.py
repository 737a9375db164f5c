"""Makes the part of a page that has its charts: choices, charts, data and the library, in one block of HTML."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Dict, List, Sequence

from markupsafe import Markup

from diff_encoder_sim.analysis.charts.chart import Chart, Choice, Data, Look
from diff_encoder_sim.analysis.html_templates import load_template

TEMPLATE = 'charts.html'
LIBRARY = Path(__file__).parent / 'library'

# In this order: the second needs the first.
SCRIPTS = ('vega.min.js', 'vega-lite.min.js')


def charts_html(charts: Sequence[Chart], data: Data, choices: Sequence[Choice] = ()) -> Markup:
    """Return the block, once for a page; it is hidden where scripts do not run.

    An element `<details class="instead-of-charts" open>` of the page, with pictures or tables of the same, is folded
    once the charts are drawn, and is printed in their place.

    Args:
        charts: in the order of the page, two abreast where there is room.
        data: what the charts draw.
        choices: what the reader may choose, above the charts.

    Raises:
        ValueError: a number is not finite.
    """
    content = {
        'charts': [{'name': chart.name, 'spec': _with_parameters(chart, choices)} for chart in charts],
        'data': {name: _columns(rows) for name, rows in data.items()},
        'choices': [_choice(choice) for choice in choices],
    }
    text = json.dumps(content, allow_nan=False, ensure_ascii=False, separators=(',', ':'))
    # So that nothing in it ends the script.
    content_json = Markup(text.replace('<', '\\u003c'))
    return Markup(
        load_template(TEMPLATE, Path(__file__).parent).render(
            charts=charts, choices=choices, content=content_json, library=_library()
        )
    )


def _with_parameters(chart: Chart, choices: Sequence[Choice]) -> Dict[str, Any]:
    """Return the specification with what all charts have in common."""
    parameters = [{'name': choice.name, 'value': choice.chosen} for choice in choices]
    return {
        'height': 300,
        **chart.spec,
        'width': 'container',
        'autosize': {'type': 'fit-x', 'contains': 'padding'},
        'description': f'{chart.title}. {chart.description}',
        'params': [*parameters, *chart.spec.get('params', [])],
    }


def _choice(choice: Choice) -> Dict[str, Any]:
    values, parents = [option.value for option in choice.options], [option.within for option in choice.options]
    of_list = {'within': choice.within, 'parents': parents, 'clicked_for': choice.clicked_for}
    return {'name': choice.name, 'values': values, **(of_list if choice.look is Look.LIST else {})}


def _columns(rows: Sequence[Any]) -> Dict[str, List[Any]]:
    """Return the values by key: a third of the size of rows."""
    return {key: [row[key] for row in rows] for key in rows[0]} if rows else {}


def _library() -> List[Markup]:
    return [Markup((LIBRARY / name).read_text(encoding='utf-8')) for name in SCRIPTS]
