"""The path of the chosen trial: the true one and that of /odom, over the map."""

from __future__ import annotations

from typing import Any, Dict, List

from diff_encoder_sim.analysis.charts.chart import ZOOM
from diff_encoder_sim.analysis.report.chart_paths import MM_PER_M, PATHS, Floor
from diff_encoder_sim.analysis.report.specs import spec_parts as common
from diff_encoder_sim.analysis.report.specs.spec_parts import Spec

TRUE_GREY = '#737373'

OF_TEST = {'filter': 'datum.test === test_of[trial]'}
MARK_SHAPE: Spec = {
    'field': 'mark',
    'type': 'nominal',
    'scale': {'domain': ['start', 'goal'], 'range': ['circle', 'cross']},
    'legend': None,
}


def path_spec(colours: Dict[str, str], floors: Dict[str, Floor], test_of: List[str]) -> Spec:
    """Return the chart.

    Args:
        colours: by encoder.
        floors: by test, the part of the floor that is shown.
        test_of: by place of the trial in the dataset.
    """
    x, y = _axis('x', 'left', 'right', 'width'), _axis('y', 'bottom', 'top', 'height')
    true = {'color': TRUE_GREY, 'strokeWidth': 4, 'opacity': 0.6}
    return {
        'height': common.HEIGHT_PX,
        'params': [{'name': 'floors', 'value': floors}, {'name': 'test_of', 'value': test_of}],
        'layer': [
            _map(x, y),
            _line(PATHS[0], x, y, true),
            _line(PATHS[1], x, y, {'strokeWidth': 1.8}, color=common.encoder_colour(colours)),
            _marks(x, y),
        ],
    }


def _axis(name: str, low: str, high: str, size: str) -> Spec:
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
        'axis': {'format': common.PLAIN, 'tickCount': 6},
        'scale': {'domain': domain, 'nice': False, 'zero': False},
    }


def _map(x: Spec, y: Spec) -> Spec:
    return {
        'params': [ZOOM],
        'data': {'name': 'maps'},
        'transform': [OF_TEST],
        'mark': {'type': 'image', 'aspect': False, 'smooth': False, 'clip': True, 'aria': False},
        'encoding': {
            'url': {'field': 'url', 'type': 'nominal'},
            'x': {**x, 'field': 'left'},
            'x2': {'field': 'right'},
            'y': {**y, 'field': 'bottom'},
            'y2': {'field': 'top'},
        },
    }


def _line(path: str, x: Spec, y: Spec, look: Spec, **encoding: Any) -> Spec:
    """Return one of the two paths: its increments are added up."""
    transform = [
        {'filter': f"datum.trial === trial && datum.path === '{path}'"},
        common.OF_TRIAL,
        {'flatten': ['dx', 'dy']},
        {
            'window': [
                {'op': 'row_number', 'as': 'order'},
                *({'op': 'sum', 'field': f'd{axis}', 'as': f'{axis}_mm'} for axis in 'xy'),
            ]
        },
        *({'calculate': f'datum.{axis}_mm / {MM_PER_M}', 'as': axis} for axis in 'xy'),
    ]
    places = {
        'x': {**x, 'field': 'x'},
        'y': {**y, 'field': 'y'},
        'order': {'field': 'order', 'type': 'quantitative'},
        'tooltip': [
            *common.tip({'path': 'path', 'encoder': 'encoder', **common.WHICH_TRIAL}),
            *common.tip({'x': 'x [m]', 'y': 'y [m]'}, '.3f'),
        ],
    }
    mark = {'type': 'line', 'clip': True, 'strokeJoin': 'round', **look}
    return {'data': {'name': 'paths'}, 'transform': transform, 'mark': mark, 'encoding': {**places, **encoding}}


def _marks(x: Spec, y: Spec) -> Spec:
    return {
        'data': {'name': 'marks'},
        'transform': [OF_TEST],
        'mark': {'type': 'point', 'size': 110, 'color': '#000', 'strokeWidth': 1.6, 'clip': True},
        'encoding': {
            'x': {**x, 'field': 'x'},
            'y': {**y, 'field': 'y'},
            'shape': MARK_SHAPE,
            'tooltip': common.tip({'mark': 'mark'}),
        },
    }
