"""The curve: standard deviations with their intervals against PPR, on logarithmic axes, beside the closed form."""

from __future__ import annotations

from typing import Any, Sequence

from diff_encoder_sim.analysis.charts.chart import ZOOM
from diff_encoder_sim.analysis.figures.error_series import SERIES
from diff_encoder_sim.analysis.figures.spread import APART
from diff_encoder_sim.analysis.report.specs import spec_parts as common
from diff_encoder_sim.analysis.report.specs.spec_parts import Spec

BEYOND = 1.5  # the axis goes on by this factor on both sides
CLOSED_FORM_GREY = '#737373'

Y: Spec = {
    'type': 'quantitative',
    'scale': {'type': 'log', 'nice': False, 'padding': 12},
    'title': 'standard deviation',
    'axis': {'labelExpr': common.WITH_UNIT, 'labelOverlap': 'greedy'},
}
COLOUR: Spec = {
    'field': 'source',
    'type': 'nominal',
    'scale': {'domain': list(range(len(SERIES))), 'range': [series.colour for series in SERIES]},
    'legend': None,
}

# As in the figure, series are beside each other.
PLACES: Spec = {'name': 'places', 'value': [APART ** (place - (len(SERIES) - 1) / 2) for place in range(len(SERIES))]}

TIP = [
    *common.tip({'label': 'encoder', 'source_name': 'pose', 'trials': 'trials'}),
    *common.tip({'std': 'std. dev.', 'low': '95 % from', 'high': '95 % to'}, '.4g'),
]


def curve_spec(pprs: Sequence[float]) -> Spec:
    """Return the chart; `pprs` ascending, of all encoders."""
    x: Spec = {
        'type': 'quantitative',
        'scale': {'type': 'log', 'nice': False, 'domain': [pprs[0] / BEYOND, pprs[-1] * BEYOND]},
        'title': 'pulses per revolution of the wheel',
        'axis': {'values': list(pprs), 'format': common.PLAIN, 'labelOverlap': 'greedy'},
    }
    line = {'type': 'line', 'strokeWidth': 1.2, 'clip': True}
    bar = {'type': 'rule', 'strokeWidth': 1.5, 'clip': True}
    point = {'type': 'point', 'size': 60, 'clip': True, 'strokeWidth': 1.5}
    std: Spec = {**Y, 'field': 'std'}
    hollow = {**COLOUR, 'condition': {'test': 'datum.real', 'value': '#fff'}}
    return {
        'height': common.HEIGHT_PX,
        'params': [common.SOURCE_NAMES, common.UNITS, PLACES],
        'layer': [
            _closed_form(x),
            _series(x, line, [{'filter': '!datum.real'}], y=std),
            _series(x, bar, [], y={**Y, 'field': 'low'}, y2={'field': 'high'}, tooltip=TIP),
            _series(x, point, [], y=std, fill=hollow, shape=common.SOURCE_SHAPE, tooltip=TIP),
        ],
    }


def _closed_form(x: Spec) -> Spec:
    told = [*common.tip({'ppr': 'PPR'}, '.0f'), *common.tip({'std': 'closed form'}, '.3g')]
    mark = {'type': 'line', 'color': CLOSED_FORM_GREY, 'strokeDash': [6, 4], 'clip': True}
    return {
        'params': [ZOOM],
        'data': {'name': 'closed_form'},
        'transform': [{'filter': 'datum.setup === setup && datum.quantity === quantity && datum.std > 0'}],
        'mark': {**mark, 'point': {'opacity': 0, 'size': 60}},  # so that the pointer need not be on the line
        'encoding': {'x': {**x, 'field': 'ppr'}, 'y': {**Y, 'field': 'std'}, 'tooltip': told},
    }


def _series(x: Spec, mark: Spec, filters: Sequence[Spec], **encoding: Any) -> Spec:
    transform = [
        common.SHOWN,
        {'filter': 'datum.quantity === quantity'},
        {'calculate': 'datum.ppr * places[datum.source]', 'as': 'place'},
        common.SOURCE_NAME,
        *filters,
    ]
    places = {'x': {**x, 'field': 'place'}, 'color': COLOUR}
    return {'data': {'name': 'spreads'}, 'transform': transform, 'mark': mark, 'encoding': {**places, **encoding}}
