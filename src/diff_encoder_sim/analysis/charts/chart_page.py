"""The part of a page that has its charts: what its reader may choose, charts, data and Vega, in one block of HTML.

Charts are drawn by Vega, which vl-convert has with it, so that any browser opens the page offline.
"""

from __future__ import annotations

import enum
import json
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Sequence, Union

import altair as alt
import vl_convert
from markupsafe import Markup

from diff_encoder_sim.analysis.html_templates import load_template

VEGA_LITE = '.'.join(alt.SCHEMA_VERSION.lstrip('v').split('.')[:2])  # that this Altair writes
HEIGHT_PX = 340
FONT = "system-ui, 'Segoe UI', Roboto, 'Liberation Sans', sans-serif"  # that of the page
_TEXT = {'labelFontSize': 12, 'titleFontSize': 12, 'titleFontWeight': 'normal'}
CONFIG: Dict[str, Any] = {
    'font': FONT,
    'background': None,
    'view': {'stroke': '#8a9099'},
    'axis': {**_TEXT, 'labelColor': '#333a42', 'gridColor': '#e6e9ed'},
    'legend': {**_TEXT, 'symbolStrokeWidth': 2},
}


class Chart(NamedTuple):
    """One chart; it may use the page's choices as parameters: 'indexof(encoders, datum.encoder) >= 0'."""

    name: str  # unique in the page; of letters, digits and hyphens
    title: str
    description: str  # what it shows and how it is read, for all readers and screen readers
    drawing: alt.LayerChart  # without width and title
    table: str = ''  # id of the page's element that has the numbers; '' if there is none


class Look(enum.Enum):
    """How a choice is shown."""

    BOXES = 'checkbox'  # any number of options
    BUTTONS = 'radio'  # one of a few
    LIST = 'select'  # one of many


class Option(NamedTuple):
    """One value of a choice."""

    value: Union[str, int]
    label: str
    colour: str = ''  # in which charts draw it, as CSS has it; '' if it has none
    symbol: str = '●'  # that charts draw for it, if it has a colour
    within: Union[str, int, None] = None  # offered while the choice `Choice.within` has this value


class Choice(NamedTuple):
    """What the reader of a page may choose: a parameter of all its charts, by its name."""

    name: str
    label: str
    options: Sequence[Option]
    chosen: Union[str, int, Sequence[Union[str, int]]]  # at first; several values for boxes
    look: Look
    within: str = ''  # of a list: the name of another choice, whose values its options are within
    # Of a list: a click on a mark whose data has a field of its name chooses that value, and brings this chart into
    # view. So does one on a hidden element of the page with `data-choose`, values by name as JSON.
    clicked_for: str = ''


def zoomed(layer: Any, encodings: Sequence[str] = ('x', 'y')) -> Any:
    """Let the reader zoom the axes of a layer: drag, Ctrl with the wheel, and buttons."""
    wheel = 'wheel![event.ctrlKey || event.metaKey]'
    zoom = alt.selection_interval(name='zoom', bind='scales', zoom=wheel, encodings=list(encodings))
    return layer.properties(name='zoomed').add_params(zoom)  # Altair 5 would number it through all charts of a process


def charts_html(charts: Sequence[Chart], choices: Sequence[Choice] = ()) -> Markup:
    """Return the block, once for a page; it is hidden if scripts do not run.

    An element `<details class="instead-of-charts" open>` of the page, with pictures or tables of the same, is folded
    once the charts are drawn, and is printed in their place.

    Args:
        charts: in the order of the page, two abreast if there is room.
        choices: what the reader may choose, above the charts.
    """
    drawn, data = [], {}
    for chart in charts:
        spec = drawing_dict(chart.drawing)
        data.update(spec.pop('datasets', {}))
        parameters = [{'name': choice.name, 'value': choice.chosen} for choice in choices]
        spec.update(
            width='container',
            height=HEIGHT_PX,
            autosize={'type': 'fit-x', 'contains': 'padding'},
            description=f'{chart.title}. {chart.description}',
            params=[*parameters, *spec.get('params', [])],
            config=CONFIG,
        )
        vega = vl_convert.vegalite_to_vega(spec, vl_version=VEGA_LITE)
        del vega['$schema']  # an older Vega's than the page has, if Altair is older than vl-convert: it would warn
        drawn.append({'name': chart.name, 'spec': vega})
    content = {
        'charts': drawn,
        'data': {name: _columns(rows) for name, rows in data.items()},
        'choices': [_choice(choice) for choice in choices],
    }
    text = json.dumps(content, allow_nan=False, ensure_ascii=False, separators=(',', ':'))
    return Markup(
        load_template('charts.html', Path(__file__).parent).render(
            charts=charts,
            choices=choices,
            content=Markup(text.replace('<', '\\u003c')),  # so that nothing in it ends the script
            library=Markup(vl_convert.javascript_bundle('window.vegaEmbed = vegaEmbed;', vl_version=VEGA_LITE)),
        )
    )


def drawing_dict(drawing: Any) -> Dict[str, Any]:
    """Return a chart as Vega-Lite, with any number of rows."""
    with alt.data_transformers.enable('default', max_rows=None):
        spec: Dict[str, Any] = drawing.to_dict(validate=False)  # a test validates; it takes longer than the drawing
    return spec


def _choice(choice: Choice) -> Dict[str, Any]:
    values, parents = [option.value for option in choice.options], [option.within for option in choice.options]
    of_list = {'within': choice.within, 'parents': parents, 'clicked_for': choice.clicked_for}
    return {'name': choice.name, 'values': values, **(of_list if choice.look is Look.LIST else {})}


def _columns(rows: Sequence[Dict[str, Any]]) -> Dict[str, List[Any]]:
    """Return the values by key: a third of the size of rows."""
    return {key: [row[key] for row in rows] for key in rows[0]} if rows else {}
