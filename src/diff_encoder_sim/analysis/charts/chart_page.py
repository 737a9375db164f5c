"""Templates of offline pages, and their block with controls, charts, data and the Vega library of vl-convert."""

from __future__ import annotations

import contextlib
import importlib.metadata
import json
import os
from pathlib import Path
from typing import Any, Dict, List, Literal, Mapping, NamedTuple, Sequence, Union

import altair as alt
import jinja2
import vl_convert
from markupsafe import Markup

from diff_encoder_sim.base.atomic_files import write_file

VEGA_LITE = '.'.join(alt.SCHEMA_VERSION.lstrip('v').split('.')[:2])  # version written by Altair
VALIDATE = False  # slow; a test validates
HEIGHT_PX = 340
STYLE = Path(__file__).parents[1] / 'report'  # folder of the shared parts of all pages
# Colours of the page, which has others in the dark.
_INK = {'labelColor': 'var(--ink, #333a42)', 'titleColor': 'var(--ink, #333a42)'}
_TEXT = {'labelFontSize': 12, 'titleFontSize': 12, 'titleFontWeight': 'normal', **_INK}
CONFIG: Dict[str, Any] = {
    'font': "system-ui, 'Segoe UI', Roboto, 'Liberation Sans', sans-serif",  # that of the page
    'background': None,
    'view': {'stroke': '#8a9099'},
    'axis': {**_TEXT, 'gridColor': 'var(--line, #e6e9ed)'},
    'legend': {**_TEXT, 'symbolStrokeWidth': 2, 'labelLimit': 300},
}


class Chart(NamedTuple):
    """Chart, which may use the page's choices as parameters: 'indexof(encoders, datum.encoder) >= 0'."""

    name: str  # unique in the page; letters, digits and hyphens
    title: str
    description: str  # legend, also for screen readers
    drawing: alt.LayerChart  # without width and title
    table: str = ''  # id of the page element with the numbers; '' if there is none


class Option(NamedTuple):
    """Value of a choice."""

    value: Union[str, int]
    label: str
    colour: str = ''  # CSS colour in charts; '' if it has none
    symbol: str = '●'  # symbol in charts, if it has a colour
    within: Union[str, int, None] = None  # offered while the choice `Choice.within` has this value


class Choice(NamedTuple):
    """User's choice on a page: a parameter of all its charts, by name."""

    name: str
    label: str
    options: Sequence[Option]
    chosen: Union[str, int, Sequence[Union[str, int]]]  # initial value; several for boxes
    look: Literal['checkbox', 'radio', 'select']  # for any number of options, one of a few, one of many
    within: str = ''  # for a list: name of the choice that filters its options
    # For a list: chart scrolled into view by a click on a mark with a field of the choice's name, which selects its
    # value. A page element with `data-choose` (values by name as JSON) acts in the same way.
    clicked_for: str = ''


def load_template(file: Path) -> Any:
    """Load a template that escapes data, rejects undefined names and may include files of its folder and of STYLE."""
    loader = jinja2.FileSystemLoader([str(file.parent), str(STYLE)])
    environment = jinja2.Environment(
        loader=loader, trim_blocks=True, lstrip_blocks=True, autoescape=True, undefined=jinja2.StrictUndefined
    )
    return environment.get_template(file.name)


def chart_of(rows: List[Dict[str, Any]], *filters: str) -> alt.Chart:
    """Return a chart of rows, of which those are shown for which the Vega expressions hold."""
    chart = alt.Chart(alt.InlineData(values=rows))  # no DataFrame: importing pandas takes half a second
    for one in filters:
        chart = chart.transform_filter(one)
    return chart


def with_legend(channel: Any, field: str, values: Mapping[str, Any], columns: Any = 1, **look: Any) -> Any:
    """Return a colour or a dash by field; a legend shows the whole domain of its scale, with or without marks."""
    scale = alt.Scale(domain=list(values), range=list(values.values()))
    return channel(field, title=None, scale=scale, legend=alt.Legend(orient='bottom', columns=columns, **look))


def zoomed(layer: Any, encodings: Sequence[str] = ('x', 'y')) -> Any:
    """Make the axes of a layer zoomable by drag, Ctrl with the wheel, and buttons."""
    wheel = 'wheel![event.ctrlKey || event.metaKey]'
    zoom = alt.selection_interval(name='zoom', bind='scales', zoom=wheel, encodings=list(encodings))
    return layer.properties(name='zoomed').add_params(zoom)  # Altair 5 would number it through all charts of a process


def charts_html(charts: Sequence[Chart], choices: Sequence[Choice] = ()) -> Markup:
    """Return the block for a page; it is hidden without JavaScript.

    An element `<details class="instead-of-charts" open>` of the page, with equivalent figures or tables, is folded when
    the charts are drawn, and printed instead of them.
    """
    content: Dict[str, Any] = {'charts': [], 'data': {}, 'choices': []}
    for chart in charts:
        spec = drawing_dict(chart.drawing)
        del spec['$schema']  # vega-embed warns if Altair is older than vl-convert
        for name, rows in spec['datasets'].items():  # columns take a third of the size of rows
            content['data'][name] = {key: [row[key] for row in rows] for key in rows[0]} if rows else {}
        spec.update(
            datasets=list(spec['datasets']),
            width='container',
            height=HEIGHT_PX,
            autosize={'type': 'fit-x', 'contains': 'padding'},
            description=f'{chart.title}. {chart.description}',
            params=[*({'name': choice.name, 'value': choice.chosen} for choice in choices), *spec.get('params', [])],
            config=CONFIG,
        )
        content['charts'].append({'name': chart.name, 'spec': spec})
    for choice in choices:
        content['choices'].append({'name': choice.name, 'values': [option.value for option in choice.options]})
        if choice.look == 'select':
            parents = [option.within for option in choice.options]
            content['choices'][-1].update(within=choice.within, parents=parents, clicked_for=choice.clicked_for)
    text = json.dumps(content, allow_nan=False, ensure_ascii=False, separators=(',', ':'))
    escaped = Markup(text.replace('<', '\\u003c'))  # data must not end the script
    template = load_template(Path(__file__).with_name('charts.html'))
    return Markup(template.render(charts=charts, choices=choices, content=escaped, library=Markup(vega_library())))


def vega_library() -> str:
    """Return vega-embed with Vega and Vega-Lite as a script, from the user's cache: bundling takes a second."""
    folder = Path(os.environ.get('XDG_CACHE_HOME') or '~/.cache', 'diff_encoder_sim')
    name = f'vega_{importlib.metadata.version("vl-convert-python")}_{VEGA_LITE}.js'
    with contextlib.suppress(OSError, RuntimeError):  # without a home
        return (folder.expanduser() / name).read_text(encoding='utf-8')
    library: str = vl_convert.javascript_bundle('window.vegaEmbed = vegaEmbed;', vl_version=VEGA_LITE)
    with contextlib.suppress(OSError, RuntimeError):
        folder.expanduser().mkdir(parents=True, exist_ok=True)
        write_file(folder.expanduser() / name, library.encode('utf-8'))
    return library


def drawing_dict(drawing: Any) -> Dict[str, Any]:
    """Return a chart as Vega-Lite, without a limit on rows."""
    with alt.data_transformers.enable('default', max_rows=None):
        spec: Dict[str, Any] = drawing.to_dict(validate=VALIDATE)
    return spec
