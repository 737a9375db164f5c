"""A recorded drive with other encoders as an HTML page that works offline: paths, errors, spread and budget."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Sequence, Tuple

import altair as alt
import numpy as np
from altair.utils.schemapi import debug_mode

from diff_encoder_sim.analysis.charts import chart_page
from diff_encoder_sim.analysis.charts.chart_page import Chart, Choice, Option, chart_of, with_legend, zoomed
from diff_encoder_sim.analysis.charts.drawings import GREY, PLAIN, encoder_colours, equal_axes, floor_of, tips
from diff_encoder_sim.analysis.report.about import PageAbout, save_page
from diff_encoder_sim.analysis.result_tables import TextTable
from diff_encoder_sim.base.se2 import steps_m, wrap_angles
from diff_encoder_sim.calibration.drive_causes import GROUPS, DriveCauses
from diff_encoder_sim.drives.comparison import Spread

CORRECTED, CORRECTED_COLOUR = 'corrected', '#d55e00'
GROUP_COLOURS = dict(zip(GROUPS, ('#0072b2', '#d55e00', '#e69f00', '#56b4e9', '#8a9099', '#cc79a7')))
MOST_POINTS = 500  # of a path
ERRORS = {'position': ('end_position_m', 'm', 1.0), 'heading': ('end_yaw_rad', '°', math.degrees(1.0))}
IS_SHOWN = 'indexof(series, datum.series) >= 0'
UNIT = f'{ {name: unit for name, (_, unit, _) in ERRORS.items()} }[error]'


class DrivePage(NamedTuple):
    """Content of the page."""

    name: str  # of the drive
    reference: str
    series: Dict[str, Tuple[np.ndarray, np.ndarray]]  # times [s] (n,) and aligned pairs (n, 6) by encoder
    spreads: Dict[str, Dict[str, Spread]]  # of comparison.ERROR_NAMES by encoder
    causes: DriveCauses
    tables: Sequence[TextTable]


def write_page(page: DrivePage, about: PageAbout, path: Path) -> None:
    """Write the page atomically; OSError if the file cannot be written."""
    colours, series = {**encoder_colours(list(page.spreads)), CORRECTED: CORRECTED_COLOUR}, dict(page.series)
    if page.causes.corrected is not None:
        series[CORRECTED] = page.causes.corrected
    spreads = _spread_rows(page)
    errors = {row['shown']: None for row in spreads}
    colour = alt.Color('series:N', legend=None).scale(domain=list(colours), range=list(colours.values()))
    choices = [
        Choice('series', 'Encoder', [Option(name, name, colours[name]) for name in series], [*series], 'checkbox'),
        Choice('error', 'Error of', [Option(name, name) for name in errors], 'position', 'radio'),
        Choice('along', 'Along', [Option(name, name) for name in ('time', 'distance')], 'time', 'radio'),
    ]
    with debug_mode(False):  # validation in Altair takes longer than the drawing
        rows = [row for name, of_one in series.items() for row in _rows(name, *of_one)]
        y = alt.Y('series:N', title='counts per wheel turn', sort=list(page.spreads)).axis(labelLimit=180)
        charts = [_path_chart(rows, page, colour), _error_chart(rows, colour), _spread_chart(spreads, y, colour)]
        charts += [_budget_chart(page, y)] if page.causes.budgets else []
        block = chart_page.charts_html(charts, choices)
    content = {'name': page.name, 'conclusion': page.causes.conclusion, 'tables': [*page.tables, *_budget_table(page)]}
    save_page(path, Path(__file__).with_name('drive.html'), about, charts=block, **content)


def _rows(name: str, times_s: np.ndarray, pairs: np.ndarray) -> List[Dict[str, Any]]:
    (x_m, y_m), off_m = pairs[:, :2].T, np.hypot(*(pairs[:, :2] - pairs[:, 3:5]).T)
    yaws_deg = np.degrees(np.nan_to_num(wrap_angles(pairs[:, 2] - pairs[:, 5])))  # 0 without a yaw of the reference
    columns = times_s, np.append(0.0, np.cumsum(steps_m(pairs[:, 3:]))), x_m, y_m, off_m, yaws_deg
    chosen = np.column_stack(columns)[:: len(pairs) // MOST_POINTS + 1].round(4).tolist()
    return [{'series': name, **dict(zip(('time', 'distance', 'x', 'y', *ERRORS), row))} for row in chosen]


def _axis(channel: Any, unit: str) -> Any:
    return channel.axis(labelExpr=f"format(datum.value, '{PLAIN}') + ' ' + {unit}", tickCount=6)


def _path_chart(rows: List[Dict[str, Any]], page: DrivePage, colour: Any) -> Chart:
    _, pairs = next(iter(page.series.values()))
    true = pairs[:: len(pairs) // MOST_POINTS + 1, 3:5].round(4)
    ends = np.vstack([true, [[row['x'], row['y']] for row in rows]])
    axes = equal_axes(floor_of(ends))
    base = chart_of([{'time': order, 'x': x, 'y': y} for order, (x, y) in enumerate(true.tolist())])
    base = base.mark_line(clip=True, strokeWidth=5, color=GREY, opacity=0.6).encode(order='time:Q', **axes)
    named = [*tips({'series': 'encoder'}), *tips({'x': 'x [m]', 'y': 'y [m]', 'time': 'time [s]'}, '.2f')]
    lines = chart_of(rows, IS_SHOWN).mark_line(clip=True, strokeWidth=1.6)
    lines = lines.encode(order='time:Q', color=colour, tooltip=named, **axes)
    corrected = '' if page.causes.corrected is None else '; corrected: by the conclusion, with exact angles'
    text = f'Grey: {page.reference}; in colour: odometry{corrected}.'
    return Chart('path', 'Paths', text, alt.layer(base, zoomed(lines)))


def _error_chart(rows: List[Dict[str, Any]], colour: Any) -> Chart:
    x = _axis(alt.X('at:Q', title=None), "(along === 'time' ? 's' : 'm')").scale(nice=False, zero=False)
    titles = {
        'time': 'time [s]',
        'distance': 'distance [m]',
        'position': 'position error [m]',
        'heading': 'heading [°]',
    }
    lines = chart_of(rows, IS_SHOWN).transform_calculate(at='datum[along]', off='datum[error]')
    lines = lines.mark_line(clip=True, strokeWidth=1.6).encode(x=x, y=_axis(alt.Y('off:Q', title=None), UNIT))
    lines = lines.encode(order='time:Q', color=colour, tooltip=[*tips({'series': 'encoder'}), *tips(titles, '.3f')])
    return Chart('error', 'Error along the drive', 'Odometry minus reference.', alt.layer(zoomed(lines)), 'tables')


def _spread_rows(page: DrivePage) -> List[Dict[str, Any]]:
    return [
        {'series': series, 'shown': shown, **{key: scale * value for key, value in spreads[name]._asdict().items()}}
        for series, spreads in page.spreads.items()
        for shown, (name, _, scale) in ERRORS.items()
        if math.isfinite(spreads[name].median)  # no heading without a yaw of the reference
    ]


def _spread_chart(rows: List[Dict[str, Any]], y: alt.Y, colour: Any) -> Chart:
    named = [*tips({'series': 'encoder'}), *tips({'median': 'median', 'p5': '5 %', 'p95': '95 %'}, '.3~g')]
    chart = chart_of(rows, 'datum.shown === error').encode(y=y, color=colour, tooltip=named)
    bars = chart.mark_bar(height=12, opacity=0.35).encode(x=_axis(alt.X('p5:Q', title=None), UNIT), x2='p95:Q')
    dots = chart.mark_point(filled=True, size=70, opacity=1.0).encode(x=alt.X('median:Q', title=None))
    text = 'Error at the end: median and, over sampled start angles of the wheels, 5 to 95 %.'
    return Chart('spread', 'Spread over start angles', text, alt.layer(bars, dots), 'tables')


def _budget_chart(page: DrivePage, y: alt.Y) -> Chart:
    rows = [
        {'series': name, 'cause': group, 'order': order, 'square': square, 'rms': math.sqrt(square)}
        for name, budget in zip(page.spreads, page.causes.budgets)
        for order, (group, square) in enumerate(budget.items())
    ]
    x = alt.X('square:Q', title='fraction of the mean square error').stack('normalize').axis(format='%', tickCount=5)
    named = [*tips({'series': 'encoder', 'cause': 'cause'}), *tips({'rms': 'root mean square [m]'}, '.3~g')]
    bars = chart_of(rows).mark_bar().encode(x=x, y=y, order='order:Q', tooltip=named)
    bars = bars.encode(color=with_legend(alt.Color, 'cause:N', GROUP_COLOURS, columns=3))
    return Chart('budget', 'Budget', 'Causes of the error of position over the drive.', alt.layer(bars), 'tables')


def _budget_table(page: DrivePage) -> List[TextTable]:
    rows = [
        [name, *(f'{math.sqrt(part):.4f}' for part in (sum(budget.values()), *budget.values()))]
        for name, budget in zip(page.spreads, page.causes.budgets)
    ]
    title = 'Budget: root mean square error of position over the drive'
    heads = ['counts', 'all [m]', *(f'{group} [m]' for group in GROUPS)]
    return [TextTable(title, heads, rows, texts=0)] if rows else []
