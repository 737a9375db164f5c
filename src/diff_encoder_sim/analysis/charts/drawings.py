"""Altair charts of trials, shared by the report and the figure files.

Properties that are choices on a page and fixed in a file are arguments: Vega expressions, such as `units[quantity]` or
`'m'`, and `rows`, an `alt.Chart` of a DataFrame of frames.py with filter transforms only. `trials` are `trial_rows` for
tooltips, or None for a file; `colours` are by encoder.
"""

from __future__ import annotations

from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Union

import altair as alt
import numpy as np

from diff_encoder_sim.analysis.quantities import X
from diff_encoder_sim.base.deferred import pandas as pd

Domain = Sequence[Union[float, Dict[str, str]]]  # of an axis: numbers or expressions
DrawPoints = Callable[[alt.Chart], alt.Chart]  # `error_points` with a look

PLAIN = '.6~g'  # number format of axes: no trailing zeros, no powers of ten
GREY, FAILED = '#737373', '#d55e00'
WITHIN: Dict[str, Any] = {'color': '#000', 'opacity': 0.08, 'clip': True, 'aria': False}

VIRIDIS = ('#440154', '#414487', '#2a788e', '#22a884', '#7ad151')  # fine to coarse; its yellow is too pale on white

# Series of errors: label, colour (Okabe and Ito's palette for colour-blind readers), shape and its symbol.
SERIES = (
    ('/odom minus /world_pose', '#0072b2', 'circle', '●'),
    ('/odom minus goal', '#56b4e9', 'square', '■'),
    ('/world_pose minus goal', '#000000', 'diamond', '◆'),
    ('/global_pose minus goal', '#d55e00', 'triangle-up', '▲'),
    ('/amcl_pose minus goal', '#e69f00', 'triangle-down', '▼'),
)
LABELS, COLOURS, SHAPES, _ = zip(*SERIES)
BEYOND = 'beyond the axes'  # series of points drawn at the border of the axes

JITTER, GOLDEN_RATIO = 0.5, 0.618034  # points are jittered evenly and reproducibly over half of a series' width
ROTATED_FROM = 40  # total characters of encoder names
AXIS_BEYOND = 1.5  # the axis of counts extends by this factor on both sides
LEAST_SIDE_M = 0.1  # of a floor


def encoder_colours(encoders: Sequence[str]) -> Dict[str, str]:
    """Return a colour per encoder, from light to dark in the given order."""
    anchors = np.array([[int(colour[first : first + 2], 16) for first in (1, 3, 5)] for colour in VIRIDIS])
    places = np.linspace(1.0, 0.0, len(encoders)) if len(encoders) > 1 else np.zeros(len(encoders))
    levels = [np.interp(places, np.linspace(0.0, 1.0, len(VIRIDIS)), channel) for channel in anchors.T]
    return {one: '#' + ''.join(f'{round(level):02x}' for level in rgb) for one, rgb in zip(encoders, zip(*levels))}


def tips(titles: Dict[str, str], formats: str = '') -> List[alt.Tooltip]:
    """Return the tooltip fields of a mark from titles by field; `formats` is a D3 number format."""
    more: Dict[str, Any] = {'format': formats} if formats else {}
    kind = 'Q' if formats else 'N'
    return [alt.Tooltip(f'{field}:{kind}', title=title, **more) for field, title in titles.items()]


_OF_TRIAL = {'number': 'trial', 'seed': 'seed', 'bag': 'bag', 'outcome': 'end'}
_XY = {'x': alt.X, 'y': alt.Y}


def _encoder_colour(colours: Dict[str, str], channel: Any = alt.Color) -> Any:
    return channel('encoder:N', legend=None).scale(domain=list(colours), range=list(colours.values()))


def _series(channel: Any, looks: Sequence[str], beyond: str) -> Any:
    return channel('series:N', legend=None).scale(domain=[*LABELS, BEYOND], range=[*looks, beyond])


def _with_trial(chart: alt.Chart, trials: Optional[pd.DataFrame], shown: List[alt.Tooltip]) -> alt.Chart:
    if trials is None:
        return chart
    return chart.transform_lookup('trial', alt.LookupData(trials, 'trial', list(_OF_TRIAL))).encode(tooltip=shown)


def _with_unit(unit: str) -> str:
    return f"format(datum.value, '{PLAIN}') + ' ' + {unit}"


def error_points(
    rows: alt.Chart,
    colours: Dict[str, str],
    trials: Optional[pd.DataFrame] = None,
    chosen: str = 'false',
    size_px2: float = 45,
) -> alt.Chart:
    """Draw a point per error of `error_rows`, without axes; a ring marks the trial for which `chosen` is true."""
    points = rows.mark_point(filled=True, opacity=0.75, clip=True, cursor='pointer').encode(
        color=_encoder_colour(colours),
        shape=_series(alt.Shape, SHAPES, 'cross'),
        size=alt.condition(chosen, alt.value(150), alt.value(size_px2)),
        stroke=alt.condition(chosen, alt.value('#000'), alt.value(None)),
    )
    shown = tips({'encoder': 'encoder', **_OF_TRIAL, 'series': 'pose'})
    shown += tips({'x': 'x [m]', 'y': 'y [m]'}, '.4f') + tips({'yaw': 'yaw [deg]'}, '.3f')
    return _with_trial(points, trials, shown)


def xy_errors(rows: alt.Chart, points: DrawPoints, domain: Optional[Domain] = None) -> alt.LayerChart:
    """Draw points of rows about the goal; without a domain both axes fit all points."""
    square: Dict[str, Any] = {'x': 'low:Q', 'x2': 'high:Q', 'y': 'low:Q', 'y2': 'high:Q'}
    reach = rows.mark_rect(opacity=0, aria=False)
    reach = reach.transform_calculate(reach=f'1.1 * max(abs(datum.x), abs(datum.y), {1.2 * X.tolerance})')
    reach = reach.transform_aggregate(high='max(reach)').transform_calculate(low='-datum.high').encode(**square)
    within = alt.Chart(pd.DataFrame({'low': [-X.tolerance], 'high': [X.tolerance]})).mark_rect(**WITHIN)
    axes = {
        name: channel(f'{name}:Q', title=f'{name} error [m]')
        .axis(format=PLAIN, tickCount=6 if domain is None else 4)
        .scale(nice=False, **({} if domain is None else {'domain': domain}))
        for name, channel in _XY.items()
    }
    drawn = points(rows).transform_filter('isValid(datum.x) && isValid(datum.y)').encode(**axes)
    return alt.layer(*([reach] if domain is None else []), within.encode(**square), drawn)


def distributions(
    rows: alt.Chart,
    points: DrawPoints,
    names: Dict[str, str],
    unit: str,
    tolerance: str,
    series: str = '1',
    domain: Optional[Domain] = None,
) -> alt.LayerChart:
    """Draw an error of every trial by encoder, series next to each other, with medians and quartiles.

    The rows also have `value` and `slot`, the index of the displayed series; `series` is the number of series, `names`
    are the names of encoders on the axis. Without a domain the axis fits all values.
    """
    angle = 0 if len(''.join(names.values())) < ROTATED_FROM else -60
    x = alt.X('encoder:O', sort=list(names), title=None).scale(paddingOuter=0.2)
    x = x.axis(labelExpr='encoder_names[datum.value]', labelAngle=angle, labelLimit=200)
    place = alt.Scale(domain=[-0.5, {'expr': f'{series} - 0.5'}], nice=False, zero=False)
    y_axis: Dict[str, Any] = {
        'title': 'error',
        'axis': alt.Axis(labelExpr=_with_unit(unit), tickCount=6),
        'scale': alt.Scale(nice=False, **({'padding': 8} if domain is None else {'domain': domain})),
    }
    border = alt.YDatum({'expr': f'-{tolerance}'}, type='quantitative', **y_axis)
    within = alt.Chart(pd.DataFrame({'all': [0]})).mark_rect(**WITHIN)
    jittered = f'datum.slot + {JITTER} * ((datum.trial * {GOLDEN_RATIO}) % 1 - 0.5)'
    quartiles = rows.transform_aggregate(
        q1='q1(value)', median='median(value)', q3='q3(value)', count='count()', groupby=['encoder', 'slot', 'series']
    )
    shown = tips({'encoder': 'encoder', 'series': 'pose', 'count': 'trials'})
    shown += tips({'q1': 'first quartile', 'median': 'median', 'q3': 'third quartile'}, '.4g')
    quartiles = quartiles.encode(x=x, xOffset=alt.XOffset('slot:Q', scale=place), tooltip=shown)
    boxes = quartiles.mark_bar(size=22, color='#fff', opacity=0.75, stroke='#444', clip=True)
    medians = quartiles.mark_tick(size=24, thickness=2, color='#000', clip=True)
    placed = points(rows).transform_calculate(place=jittered)
    return alt.layer(
        within.encode(y=border, y2=alt.Y2Datum({'expr': tolerance})),
        boxes.encode(y=alt.Y('q1:Q', **y_axis), y2='q3:Q'),
        placed.encode(x=x, xOffset=alt.XOffset('place:Q', scale=place), y=alt.Y('value:Q', **y_axis)),
        medians.encode(y=alt.Y('median:Q', **y_axis)),
    ).add_params(alt.param(name='encoder_names', value=names))


def spreads(rows: alt.Chart, closed_form: alt.Chart, pprs: Sequence[float], unit: str) -> alt.LayerChart:
    """Draw `spread_rows` with intervals and `closed_form_rows` over ascending counts, on logarithmic axes."""
    x_axis: Dict[str, Any] = {
        'title': 'counts per wheel turn',
        'scale': alt.Scale(type='log', nice=False, domain=[pprs[0] / AXIS_BEYOND, pprs[-1] * AXIS_BEYOND]),
        'axis': alt.Axis(values=list(pprs), format=PLAIN, labelOverlap='greedy'),
    }
    y_axis: Dict[str, Any] = {
        'title': 'standard deviation',
        'scale': alt.Scale(type='log', nice=False, padding=12),
        'axis': alt.Axis(labelExpr=_with_unit(unit), labelOverlap='greedy'),
    }
    std = alt.Y('std:Q', **y_axis)
    point = alt.OverlayMarkDef(opacity=0, size=60)  # enlarges the hover area of the line
    line = closed_form.transform_filter('datum.std > 0')
    line = line.mark_line(color=GREY, strokeDash=[6, 4], clip=True, point=point)
    line_tips = [*tips({'ppr': 'counts'}, '.0f'), *tips({'std': 'closed form'}, '.3g')]
    shown = tips({'label': 'encoder', 'series': 'pose', 'trials': 'trials'})
    shown += tips({'std': 'std. dev.', 'low': '95 % from', 'high': '95 % to'}, '.4g')
    measured = rows.encode(x=alt.X('place:Q', **x_axis), color=_series(alt.Color, COLOURS, GREY))
    # Real encoders differ not only by counts: hollow points without a line.
    lines = measured.transform_filter('!datum.is_real').mark_line(strokeWidth=1.2, clip=True)
    bars = measured.mark_rule(strokeWidth=1.5, clip=True)
    fill = alt.condition('datum.is_real', alt.value('#fff'), _series(alt.Fill, COLOURS, GREY))
    points = measured.mark_point(size=60, clip=True, strokeWidth=1.5)
    return alt.layer(
        line.encode(x=alt.X('ppr:Q', **x_axis), y=std, tooltip=line_tips),
        lines.encode(y=std),
        bars.encode(y=alt.Y('low:Q', **y_axis), y2='high:Q', tooltip=shown),
        points.encode(y=std, fill=fill, shape=_series(alt.Shape, SHAPES, 'cross'), tooltip=shown),
    )


def path_chart(
    rows: alt.Chart,
    marks: alt.Chart,
    maps: alt.Chart,
    colours: Dict[str, str],
    domains: Sequence[Domain],
    trials: Optional[pd.DataFrame] = None,
) -> alt.LayerChart:
    """Draw `path_rows` with `mark_rows` on `map_rows`; the domains are of x and y."""
    axes, corners = floor_axes(domains), floor_axes(domains, ('left', 'bottom'))
    backdrop = maps.mark_image(aspect=False, smooth=False, clip=True, aria=False)
    points = rows.transform_flatten(['x', 'y']).transform_window(order='row_number()')
    named = tips({'path': 'path', 'encoder': 'encoder', **_OF_TRIAL})
    points = points.encode(order='order:Q', detail='trial:N', **axes)
    points = _with_trial(points, trials, [*named, *tips({'x': 'x [m]', 'y': 'y [m]'}, '.3f')])
    true = points.transform_filter("datum.path === 'true path'")
    odometry = points.transform_filter("datum.path === '/odom'").encode(color=_encoder_colour(colours))
    shape = alt.Shape('mark:N', legend=None).scale(
        domain=['start', 'goal', 'end of a failed trial'], range=['circle', 'cross', 'M-.7,-.7L.7,.7M-.7,.7L.7,-.7']
    )
    stroke = alt.condition("datum.mark === 'end of a failed trial'", alt.value(FAILED), alt.value('#000'))
    line: Dict[str, Any] = {'clip': True, 'strokeJoin': 'round'}
    return alt.layer(
        backdrop.encode(url='url:N', x2='right:Q', y2='top:Q', **corners),
        true.mark_line(color=GREY, strokeWidth=4, opacity=0.6, **line),
        odometry.mark_line(strokeWidth=1.8, **line),
        marks.mark_point(size=110, strokeWidth=1.6, clip=True).encode(
            shape=shape, color=stroke, tooltip=tips({'mark': 'mark'}), **axes
        ),
    )


def variant_errors_chart(
    errors: pd.DataFrame, names: Sequence[str], colours: Dict[str, str], title: str
) -> alt.LayerChart:
    """Draw `variant`, `median`, `low`, `high` and `has_failed` by encoder; the first variant's median is dotted."""
    y = alt.Y('variant:O', sort=list(names), title=None).axis(labelLimit=220, grid=False)
    rows: Dict[str, Any] = {'y': y, 'yOffset': alt.YOffset('encoder:N', sort=list(colours))}
    low, median = (
        alt.X(f'{field}:Q', title=title).scale(type='log', nice=False, padding=10).axis(format=PLAIN)
        for field in ('low', 'median')
    )
    base = alt.Chart(errors).transform_filter('datum.median > 0')
    base = base.encode(color=_encoder_colour(colours).legend(title='encoder', orient='bottom'))
    fill = alt.condition('datum.has_failed', alt.value('#fff'), _encoder_colour(colours, alt.Fill))
    first = base.transform_filter(alt.FieldEqualPredicate(field='variant', equal=names[0]))
    return alt.layer(
        first.mark_rule(strokeDash=[2, 2]).encode(x=median),
        base.mark_rule(strokeWidth=1.2).encode(x=low, x2='high:Q', **rows),
        base.mark_point(size=30, opacity=1.0).encode(x=median, fill=fill, **rows),
    )


def floor_of(points_m: np.ndarray) -> Dict[str, float]:
    """Return the middle x, y and the sides width, height of a floor around points (n, 2), with a margin [m]."""
    low_m, high_m = points_m.min(axis=0), points_m.max(axis=0)
    sides_m = 1.1 * np.maximum(high_m - low_m, LEAST_SIDE_M)
    return dict(zip(('x', 'y', 'width', 'height'), [*0.5 * (low_m + high_m), *sides_m]))


def floor_axes(domains: Sequence[Domain], fields: Sequence[str] = ('x', 'y'), **look: Any) -> Dict[str, Any]:
    """Return the axes x and y of a floor [m] with these domains; `look` has more properties of the axes."""
    return {
        name: channel(f'{field}:Q', title=f'{name} [m]')
        .axis(format=PLAIN, tickCount=6, **look)
        .scale(domain=domain, nice=False, zero=False)
        for (name, channel), field, domain in zip(_XY.items(), fields, domains)
    }


def floor_domains(floor: Mapping[str, Any], is_equal: str = 'true') -> List[Domain]:
    """Return the domains of x and y around a `floor_of`: numbers, or expressions by its keys.

    Both axes have equal scales if the expression `is_equal` holds, else each is stretched to fit.
    """
    # Charts have no width while the page is printed without them.
    m_per_px = f'max({floor["width"]} / max(width, 1), {floor["height"]} / height)'
    sides = ('x', 'width', 'max(width, 1)'), ('y', 'height', 'height')
    return [
        [{'expr': f'{floor[name]} {sign} 0.5 * ({is_equal} ? {pixels} * {m_per_px} : {floor[side]})'} for sign in '-+']
        for name, side, pixels in sides
    ]


def equal_axes(floor: Mapping[str, Any]) -> Dict[str, Any]:
    """Return the axes x and y with equal scales around a `floor_of`, as of `floor_domains`."""
    return floor_axes(floor_domains(floor), labelBound=True)
