"""The report's charts as Vega-Lite specifications; `encoders`, `sources`, ... are what its reader has chosen."""

from __future__ import annotations

from typing import Any, Dict, Iterable, List, Sequence

from diff_encoder_sim.analysis.charts.chart import ZOOM
from diff_encoder_sim.analysis.figures.error_series import SERIES
from diff_encoder_sim.analysis.quantities import QUANTITIES, X
from diff_encoder_sim.analysis.report.chart_paths import MM_PER_M, PATHS, Floor

Spec = Dict[str, Any]

# Vega's names of matplotlib's markers.
SHAPES = {'o': 'circle', 's': 'square', 'D': 'diamond', '^': 'triangle-up', 'v': 'triangle-down'}

WITHIN = {'type': 'rect', 'color': '#000', 'opacity': 0.08}
CLOSED_FORM_GREY, TRUE_GREY = '#737373', '#737373'

# Widths beside each other, as fractions of that of a source.
JITTER = 0.5
GOLDEN_RATIO = 0.618034
ROTATED_FROM = 40  # characters in all names of encoders
APART = 1.07  # as in the figure: series beside each other, by this factor of the PPR

# Of numbers on axes: no trailing zeros, no powers of ten. Without its precision Vega would choose another.
PLAIN = '.6~g'

_AXIS = {'format': PLAIN, 'tickCount': 6}
_SHOWN = {
    'filter': 'datum.setup === setup && indexof(encoders, datum.encoder) >= 0 && indexof(sources, datum.source) >= 0'
}
_OF_TRIAL = {
    'lookup': 'trial',
    'from': {'data': {'name': 'trials'}, 'key': 'trial', 'fields': ['number', 'seed', 'bag', 'outcome']},
}
_SOURCE_NAME = {'calculate': 'source_names[datum.source]', 'as': 'source_name'}
_SOURCE_NAMES = {'name': 'source_names', 'value': [series.label for series in SERIES]}
_SHAPE = {
    'field': 'source',
    'type': 'nominal',
    'scale': {'domain': list(range(len(SERIES))), 'range': [SHAPES[series.marker] for series in SERIES]},
    'legend': None,
}
_PICKED = {'condition': {'test': 'datum.trial === trial', 'value': 150}, 'value': 45}
_RING = {'condition': {'test': 'datum.trial === trial', 'value': '#000'}, 'value': None}
_TRIAL_TIP = [
    {'field': 'encoder', 'title': 'encoder'},
    {'field': 'number', 'title': 'trial'},
    {'field': 'seed', 'title': 'seed'},
    {'field': 'bag', 'title': 'bag'},
    {'field': 'outcome', 'title': 'end'},
    {'field': 'source_name', 'title': 'pose'},
    {'field': 'x', 'title': 'x [m]', 'format': '.4f'},
    {'field': 'y', 'title': 'y [m]', 'format': '.4f'},
    {'field': 'yaw', 'title': 'yaw [deg]', 'format': '.3f'},
]
_UNITS = {'name': 'units', 'value': {quantity.axis: quantity.unit for quantity in QUANTITIES}}
_WITH_UNIT = f"format(datum.value, '{PLAIN}') + ' ' + units[quantity]"


def encoder_colour(colours: Dict[str, str]) -> Spec:
    """Return the colour of an encoder, by the field of that name."""
    scale = {'domain': list(colours), 'range': list(colours.values())}
    return {'field': 'encoder', 'type': 'nominal', 'scale': scale, 'legend': None}


def scatter_spec(colours: Dict[str, str]) -> Spec:
    """Return the chart of final x and y errors; both axes have one range."""
    limit = [
        {'calculate': f'1.1 * max(abs(datum.x), abs(datum.y), {1.2 * X.tolerance})', 'as': 'reach'},
        {'aggregate': [{'op': 'max', 'field': 'reach', 'as': 'limit'}]},
        {'calculate': '-datum.limit', 'as': 'low'},
    ]
    points = {
        'params': [ZOOM],
        'transform': [_OF_TRIAL, _SOURCE_NAME],
        'mark': {'type': 'point', 'filled': True, 'opacity': 0.75, 'clip': True, 'cursor': 'pointer'},
        'encoding': {
            'x': _axis('x', 'x error [m]'),
            'y': _axis('y', 'y error [m]'),
            'color': encoder_colour(colours),
            'shape': _SHAPE,
            'size': _PICKED,
            'stroke': _RING,
            'tooltip': _TRIAL_TIP,
        },
    }
    return {
        'height': 340,
        'params': [_SOURCE_NAMES],
        'data': {'name': 'errors'},
        'transform': [_SHOWN, {'filter': 'isValid(datum.x) && isValid(datum.y)'}],
        'layer': [
            {
                'transform': limit,
                'mark': {'type': 'rect', 'opacity': 0, 'aria': False},
                'encoding': _box('low', 'limit'),
            },
            {
                'data': {'values': [{'low': -X.tolerance, 'high': X.tolerance}]},
                'mark': {**WITHIN, 'clip': True},
                'encoding': _box('low', 'high'),
            },
            points,
        ],
    }


def _axis(field: str, title: str) -> Spec:
    return {'field': field, 'type': 'quantitative', 'title': title, 'axis': _AXIS, 'scale': {'nice': False}}


def _box(low: str, high: str) -> Spec:
    return {
        'x': {'field': low, 'type': 'quantitative'},
        'x2': {'field': high},
        'y': {'field': low, 'type': 'quantitative'},
        'y2': {'field': high},
    }


def distribution_spec(colours: Dict[str, str], names: Dict[str, str]) -> Spec:
    """Return the chart of all errors by encoder, the poses beside each other, with medians and quartiles."""
    place = {
        'type': 'quantitative',
        'scale': {'domain': [-0.5, {'expr': 'length(sources) - 0.5'}], 'nice': False, 'zero': False},
    }
    encoder: Spec = {
        'field': 'encoder',
        'type': 'ordinal',
        'sort': list(colours),
        'title': None,
        'scale': {'paddingOuter': 0.2},
    }
    encoder['axis'] = {
        'labelExpr': 'encoder_names[datum.value]',
        'labelAngle': _angle(names.values()),
        'labelLimit': 200,
    }
    y_axis = {'labelExpr': _WITH_UNIT, 'tickCount': 6}
    value = {'type': 'quantitative', 'title': 'error', 'axis': y_axis, 'scale': {'nice': False, 'padding': 8}}
    encoder_names = {'name': 'encoder_names', 'value': names}
    tolerances = {'name': 'tolerances', 'value': {quantity.axis: quantity.tolerance for quantity in QUANTITIES}}
    quartiles = [
        {
            'aggregate': [{'op': op, 'field': 'value', 'as': op} for op in ('q1', 'median', 'q3', 'count')],
            'groupby': ['encoder', 'slot', 'source'],
        },
        _SOURCE_NAME,
    ]
    tip = [
        {'field': 'encoder', 'title': 'encoder'},
        {'field': 'source_name', 'title': 'pose'},
        {'field': 'count', 'title': 'trials'},
        *(
            {'field': op, 'title': title, 'format': '.4g'}
            for op, title in (('q1', 'first quartile'), ('median', 'median'), ('q3', 'third quartile'))
        ),
    ]
    box = {'x': encoder, 'xOffset': {**place, 'field': 'slot'}, 'tooltip': tip}
    return {
        'height': 340,
        'params': [_SOURCE_NAMES, _UNITS, encoder_names, tolerances],
        'data': {'name': 'errors'},
        'transform': [
            _SHOWN,
            {'calculate': 'datum[quantity]', 'as': 'value'},
            {'filter': 'isValid(datum.value)'},
            {'calculate': 'indexof(sources, datum.source)', 'as': 'slot'},
            {'calculate': f'datum.slot + {JITTER} * ((datum.trial * {GOLDEN_RATIO}) % 1 - 0.5)', 'as': 'place'},
        ],
        'layer': [
            {
                'data': {'values': [{}]},
                'mark': {**WITHIN, 'clip': True},
                'encoding': {
                    'y': {'datum': {'expr': '-tolerances[quantity]'}, 'type': 'quantitative'},
                    'y2': {'datum': {'expr': 'tolerances[quantity]'}},
                },
            },
            {
                'transform': quartiles,
                'mark': {'type': 'bar', 'size': 22, 'color': '#fff', 'opacity': 0.75, 'stroke': '#444', 'clip': True},
                'encoding': {**box, 'y': {**value, 'field': 'q1'}, 'y2': {'field': 'q3'}},
            },
            {
                'params': [{**ZOOM, 'select': {**ZOOM['select'], 'encodings': ['y']}}],
                'transform': [_OF_TRIAL, _SOURCE_NAME],
                'mark': {'type': 'point', 'filled': True, 'opacity': 0.75, 'clip': True, 'cursor': 'pointer'},
                'encoding': {
                    'x': encoder,
                    'xOffset': {**place, 'field': 'place'},
                    'y': {**value, 'field': 'value'},
                    'color': encoder_colour(colours),
                    'shape': _SHAPE,
                    'size': _PICKED,
                    'stroke': _RING,
                    'tooltip': _TRIAL_TIP,
                },
            },
            {
                'transform': quartiles,
                'mark': {'type': 'tick', 'size': 24, 'thickness': 2, 'color': '#000', 'clip': True},
                'encoding': {**box, 'y': {**value, 'field': 'median'}},
            },
        ],
    }


def _angle(names: Iterable[str]) -> int:
    """Return the angle at which names have room below an axis [deg]."""
    return 0 if len(''.join(names)) < ROTATED_FROM else -60


def curve_spec(pprs: Sequence[float]) -> Spec:
    """Return the chart of standard deviations with their intervals against PPR, on logarithmic axes."""
    places = [APART ** (place - (len(SERIES) - 1) / 2) for place in range(len(SERIES))]
    colour = {
        'field': 'source',
        'type': 'nominal',
        'scale': {'domain': list(range(len(SERIES))), 'range': [series.colour for series in SERIES]},
        'legend': None,
    }
    x: Spec = {
        'type': 'quantitative',
        'scale': {'type': 'log', 'nice': False, 'domain': [pprs[0] / 1.5, pprs[-1] * 1.5]},
        'title': 'pulses per revolution of the wheel',
    }
    x['axis'] = {'values': list(pprs), 'format': PLAIN, 'labelOverlap': 'greedy'}
    y: Spec = {
        'type': 'quantitative',
        'scale': {'type': 'log', 'nice': False, 'padding': 12},
        'title': 'standard deviation',
        'axis': {'labelExpr': _WITH_UNIT, 'labelOverlap': 'greedy'},
    }
    shown = [
        _SHOWN,
        {'filter': 'datum.quantity === quantity'},
        {'calculate': 'datum.ppr * places[datum.source]', 'as': 'place'},
        _SOURCE_NAME,
    ]
    of_series = {'x': {**x, 'field': 'place'}, 'color': colour}
    tip = [
        {'field': 'label', 'title': 'encoder'},
        {'field': 'source_name', 'title': 'pose'},
        {'field': 'std', 'title': 'std. dev.', 'format': '.4g'},
        {'field': 'low', 'title': '95 % from', 'format': '.4g'},
        {'field': 'high', 'title': '95 % to', 'format': '.4g'},
        {'field': 'trials', 'title': 'trials'},
    ]
    closed_tip = [
        {'field': 'ppr', 'title': 'PPR', 'format': '.0f'},
        {'field': 'std', 'title': 'closed form', 'format': '.3g'},
    ]
    return {
        'height': 340,
        'params': [_SOURCE_NAMES, _UNITS, {'name': 'places', 'value': places}],
        'layer': [
            {
                'params': [ZOOM],
                'data': {'name': 'closed_form'},
                'transform': [{'filter': 'datum.setup === setup && datum.quantity === quantity && datum.std > 0'}],
                'mark': {
                    'type': 'line',
                    'color': CLOSED_FORM_GREY,
                    'strokeDash': [6, 4],
                    'clip': True,
                    'point': {'opacity': 0, 'size': 60},
                },
                'encoding': {'x': {**x, 'field': 'ppr'}, 'y': {**y, 'field': 'std'}, 'tooltip': closed_tip},
            },
            {
                'data': {'name': 'spreads'},
                'transform': [*shown, {'filter': '!datum.real'}],
                'mark': {'type': 'line', 'strokeWidth': 1.2, 'clip': True},
                'encoding': {**of_series, 'y': {**y, 'field': 'std'}},
            },
            {
                'data': {'name': 'spreads'},
                'transform': shown,
                'mark': {'type': 'rule', 'strokeWidth': 1.5, 'clip': True},
                'encoding': {**of_series, 'y': {**y, 'field': 'low'}, 'y2': {'field': 'high'}, 'tooltip': tip},
            },
            {
                'data': {'name': 'spreads'},
                'transform': shown,
                'mark': {'type': 'point', 'size': 60, 'clip': True, 'strokeWidth': 1.5},
                'encoding': {
                    **of_series,
                    'y': {**y, 'field': 'std'},
                    'fill': {**colour, 'condition': {'test': 'datum.real', 'value': '#fff'}},
                    'shape': _SHAPE,
                    'tooltip': tip,
                },
            },
        ],
    }


def path_spec(colours: Dict[str, str], floors: Dict[str, Floor], test_of: List[str]) -> Spec:
    """Return the chart of the chosen trial's true path and that of /odom, over the map.

    Args:
        colours: by encoder.
        floors: by test, the part of the floor that is shown whole.
        test_of: by place of the trial in the dataset.
    """
    params = [{'name': 'floors', 'value': floors}, {'name': 'test_of', 'value': test_of}]
    x, y = _floor_axis('x', 'left', 'right', 'width'), _floor_axis('y', 'bottom', 'top', 'height')
    of_test = {'filter': 'datum.test === test_of[trial]'}
    tip = [
        {'field': 'path', 'title': 'path'},
        {'field': 'number', 'title': 'trial'},
        {'field': 'seed', 'title': 'seed'},
        {'field': 'bag', 'title': 'bag'},
        {'field': 'outcome', 'title': 'end'},
        {'field': 'x', 'title': 'x [m]', 'format': '.3f'},
        {'field': 'y', 'title': 'y [m]', 'format': '.3f'},
    ]
    of_path = {
        'data': {'name': 'paths'},
        'encoding': {
            'x': {**x, 'field': 'x'},
            'y': {**y, 'field': 'y'},
            'order': {'field': 'order', 'type': 'quantitative'},
            'tooltip': tip,
        },
    }
    return {
        'height': 340,
        'params': params,
        'layer': [
            {
                'params': [ZOOM],
                'data': {'name': 'maps'},
                'transform': [of_test],
                'mark': {'type': 'image', 'aspect': False, 'smooth': False, 'clip': True, 'aria': False},
                'encoding': {
                    'url': {'field': 'url', 'type': 'nominal'},
                    'x': {**x, 'field': 'left'},
                    'x2': {'field': 'right'},
                    'y': {**y, 'field': 'bottom'},
                    'y2': {'field': 'top'},
                },
            },
            _line(PATHS[0], of_path, {'color': TRUE_GREY, 'strokeWidth': 4, 'opacity': 0.6}),
            _line(PATHS[1], of_path, {'strokeWidth': 1.8}, color=encoder_colour(colours)),
            {
                'data': {'name': 'marks'},
                'transform': [of_test],
                'mark': {'type': 'point', 'size': 110, 'color': '#000', 'strokeWidth': 1.6, 'clip': True},
                'encoding': {
                    'x': {**x, 'field': 'x'},
                    'y': {**y, 'field': 'y'},
                    'shape': {
                        'field': 'mark',
                        'type': 'nominal',
                        'scale': {'domain': ['start', 'goal'], 'range': ['circle', 'cross']},
                        'legend': None,
                    },
                    'tooltip': [{'field': 'mark', 'title': ''}],
                },
            },
        ],
    }


def _floor_axis(name: str, low: str, high: str, size: str) -> Spec:
    """Return an axis of the floor: from border to border, or more of it where both axes have one scale."""
    floor = 'floors[test_of[trial]]'
    # While the page is printed without charts, they have no width.
    scale = f'max(({floor}.right - {floor}.left) / max(width, 1), ({floor}.top - {floor}.bottom) / height)'
    span = f'({floor}.{high} - {floor}.{low})'
    half = f"0.5 * (scale === 'equal' ? {size} * {scale} : {span})"
    middle = f'0.5 * ({floor}.{high} + {floor}.{low})'
    domain = [{'expr': f'{middle} - {half}'}, {'expr': f'{middle} + {half}'}]
    return {
        'type': 'quantitative',
        'title': f'{name} [m]',
        'axis': _AXIS,
        'scale': {'domain': domain, 'nice': False, 'zero': False},
    }


def _line(path: str, common: Spec, look: Spec, **encoding: Any) -> Spec:
    transform = [
        {'filter': f"datum.trial === trial && datum.path === '{path}'"},
        _OF_TRIAL,
        {'flatten': ['dx', 'dy']},
        {
            'window': [
                {'op': 'row_number', 'as': 'order'},
                {'op': 'sum', 'field': 'dx', 'as': 'x_mm'},
                {'op': 'sum', 'field': 'dy', 'as': 'y_mm'},
            ]
        },
        *({'calculate': f'datum.{axis}_mm / {MM_PER_M}', 'as': axis} for axis in 'xy'),
    ]
    mark = {'type': 'line', 'clip': True, 'strokeJoin': 'round', **look}
    return {**common, 'transform': transform, 'mark': mark, 'encoding': {**common['encoding'], **encoding}}
