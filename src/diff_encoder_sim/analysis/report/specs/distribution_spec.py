"""Distributions: the chosen error of every trial by encoder, poses beside each other, with medians and quartiles."""

from __future__ import annotations

from typing import Dict, Iterable

from diff_encoder_sim.analysis.charts.chart import ZOOM
from diff_encoder_sim.analysis.quantities import QUANTITIES
from diff_encoder_sim.analysis.report.specs import spec_parts as common
from diff_encoder_sim.analysis.report.specs.spec_parts import Spec

# Points are spread by the golden ratio: evenly, and the same way each time; over this fraction of a pose's room.
JITTER = 0.5
GOLDEN_RATIO = 0.618034

ROTATED_FROM = 40  # characters in all names of encoders

# In the unit of the chosen error, with room for whole points at its ends.
VALUE: Spec = {
    'type': 'quantitative',
    'title': 'error',
    'axis': {'labelExpr': common.WITH_UNIT, 'tickCount': 6},
    'scale': {'nice': False, 'padding': 8},
}

# Beside each other in the room of an encoder.
PLACE: Spec = {
    'type': 'quantitative',
    'scale': {'domain': [-0.5, {'expr': 'length(sources) - 0.5'}], 'nice': False, 'zero': False},
}

QUARTILES = [
    {
        'aggregate': [{'op': op, 'field': 'value', 'as': op} for op in ('q1', 'median', 'q3', 'count')],
        'groupby': ['encoder', 'slot', 'source'],
    },
    common.SOURCE_NAME,
]
QUARTILE_TIP = [
    *common.tip({'encoder': 'encoder', 'source_name': 'pose', 'count': 'trials'}),
    *common.tip({'q1': 'first quartile', 'median': 'median', 'q3': 'third quartile'}, '.4g'),
]


def distribution_spec(colours: Dict[str, str], names: Dict[str, str]) -> Spec:
    """Return the chart.

    Args:
        colours: by encoder.
        names: of the encoders, as the axis has them.
    """
    tolerances = {quantity.axis: quantity.tolerance for quantity in QUANTITIES}
    parameters = {'encoder_names': names, 'tolerances': tolerances}
    encoder = _encoder_axis(names)
    return {
        'height': common.HEIGHT_PX,
        'params': [common.SOURCE_NAMES, common.UNITS, *({'name': key, 'value': parameters[key]} for key in parameters)],
        'data': {'name': 'errors'},
        'transform': [
            common.SHOWN,
            {'calculate': 'datum[quantity]', 'as': 'value'},
            {'filter': 'isValid(datum.value)'},
            {'calculate': 'indexof(sources, datum.source)', 'as': 'slot'},
            {'calculate': f'datum.slot + {JITTER} * ((datum.trial * {GOLDEN_RATIO}) % 1 - 0.5)', 'as': 'place'},
        ],
        'layer': [_tolerance(), _boxes(encoder), _points(encoder, colours), _medians(encoder)],
    }


def _encoder_axis(names: Dict[str, str]) -> Spec:
    axis = {'labelExpr': 'encoder_names[datum.value]', 'labelAngle': _angle(names.values()), 'labelLimit': 200}
    scale = {'paddingOuter': 0.2}
    return {'field': 'encoder', 'type': 'ordinal', 'sort': list(names), 'title': None, 'axis': axis, 'scale': scale}


def _angle(names: Iterable[str]) -> int:
    """Return the angle at which names have room below an axis [deg]."""
    return 0 if len(''.join(names)) < ROTATED_FROM else -60


def _tolerance() -> Spec:
    borders = {
        'y': {'datum': {'expr': '-tolerances[quantity]'}, 'type': 'quantitative'},
        'y2': {'datum': {'expr': 'tolerances[quantity]'}},
    }
    return {'data': {'values': [{}]}, 'mark': common.WITHIN_TOLERANCE, 'encoding': borders}


def _boxes(encoder: Spec) -> Spec:
    mark = {'type': 'bar', 'size': 22, 'color': '#fff', 'opacity': 0.75, 'stroke': '#444', 'clip': True}
    return _of_quartiles(encoder, mark, {'y': {**VALUE, 'field': 'q1'}, 'y2': {'field': 'q3'}})


def _medians(encoder: Spec) -> Spec:
    mark = {'type': 'tick', 'size': 24, 'thickness': 2, 'color': '#000', 'clip': True}
    return _of_quartiles(encoder, mark, {'y': {**VALUE, 'field': 'median'}})


def _of_quartiles(encoder: Spec, mark: Spec, values: Spec) -> Spec:
    places = {'x': encoder, 'xOffset': {**PLACE, 'field': 'slot'}, 'tooltip': QUARTILE_TIP}
    return {'transform': QUARTILES, 'mark': mark, 'encoding': {**places, **values}}


def _points(encoder: Spec, colours: Dict[str, str]) -> Spec:
    return {
        'params': [{**ZOOM, 'select': {**ZOOM['select'], 'encodings': ['y']}}],
        'transform': [common.OF_TRIAL, common.SOURCE_NAME],
        'mark': common.POINT,
        'encoding': {
            'x': encoder,
            'xOffset': {**PLACE, 'field': 'place'},
            'y': {**VALUE, 'field': 'value'},
            'color': common.encoder_colour(colours),
            'shape': common.SOURCE_SHAPE,
            'size': common.POINT_SIZE,
            'stroke': common.POINT_STROKE,
            'tooltip': common.TRIAL_TIP,
        },
    }
