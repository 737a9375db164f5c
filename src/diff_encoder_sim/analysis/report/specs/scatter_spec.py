"""Final position errors: x and y of every trial; both axes have one range."""

from __future__ import annotations

from typing import Dict

from diff_encoder_sim.analysis.charts.chart import ZOOM
from diff_encoder_sim.analysis.quantities import X
from diff_encoder_sim.analysis.report.specs import spec_parts as common
from diff_encoder_sim.analysis.report.specs.spec_parts import Spec


def scatter_spec(colours: Dict[str, str]) -> Spec:
    """Return the chart; `colours` by encoder."""
    return {
        'height': common.HEIGHT_PX,
        'params': [common.SOURCE_NAMES],
        'data': {'name': 'errors'},
        'transform': [common.SHOWN, {'filter': 'isValid(datum.x) && isValid(datum.y)'}],
        'layer': [_range(), _tolerance(), _points(colours)],
    }


def _range() -> Spec:
    """Return a square that cannot be seen, which both axes show all of."""
    limit = [
        {'calculate': f'1.1 * max(abs(datum.x), abs(datum.y), {1.2 * X.tolerance})', 'as': 'reach'},
        {'aggregate': [{'op': 'max', 'field': 'reach', 'as': 'high'}]},
        {'calculate': '-datum.high', 'as': 'low'},
    ]
    return {'transform': limit, 'mark': {'type': 'rect', 'opacity': 0, 'aria': False}, 'encoding': _square()}


def _tolerance() -> Spec:
    values = [{'low': -X.tolerance, 'high': X.tolerance}]
    return {'data': {'values': values}, 'mark': common.WITHIN_TOLERANCE, 'encoding': _square()}


def _square() -> Spec:
    return {
        'x': {'field': 'low', 'type': 'quantitative'},
        'x2': {'field': 'high'},
        'y': {'field': 'low', 'type': 'quantitative'},
        'y2': {'field': 'high'},
    }


def _points(colours: Dict[str, str]) -> Spec:
    return {
        'params': [ZOOM],
        'transform': [common.OF_TRIAL, common.SOURCE_NAME],
        'mark': common.POINT,
        'encoding': {
            'x': _axis('x'),
            'y': _axis('y'),
            'color': common.encoder_colour(colours),
            'shape': common.SOURCE_SHAPE,
            'size': common.POINT_SIZE,
            'stroke': common.POINT_STROKE,
            'tooltip': common.TRIAL_TIP,
        },
    }


def _axis(name: str) -> Spec:
    return {
        'field': name,
        'type': 'quantitative',
        'title': f'{name} error [m]',
        'axis': {'format': common.PLAIN, 'tickCount': 6},
        'scale': {'nice': False},
    }
