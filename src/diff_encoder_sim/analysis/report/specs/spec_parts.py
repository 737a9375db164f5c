"""What the report's charts have in common: what is shown of the data, and how trials, poses and encoders look."""

from __future__ import annotations

from typing import Any, Dict, List

from diff_encoder_sim.analysis.figures.error_series import SERIES
from diff_encoder_sim.analysis.quantities import QUANTITIES

Spec = Dict[str, Any]

HEIGHT_PX = 340

# Vega's names of matplotlib's markers.
SHAPES = {'o': 'circle', 's': 'square', 'D': 'diamond', '^': 'triangle-up', 'v': 'triangle-down'}

# Of numbers on axes: no trailing zeros, no powers of ten. Without its precision Vega would choose another.
PLAIN = '.6~g'

WITHIN_TOLERANCE: Spec = {'type': 'rect', 'color': '#000', 'opacity': 0.08, 'clip': True}

# The chosen trial has a ring.
POINT: Spec = {'type': 'point', 'filled': True, 'opacity': 0.75, 'clip': True, 'cursor': 'pointer'}
POINT_SIZE: Spec = {'condition': {'test': 'datum.trial === trial', 'value': 150}, 'value': 45}
POINT_STROKE: Spec = {'condition': {'test': 'datum.trial === trial', 'value': '#000'}, 'value': None}

SHOWN: Spec = {
    'filter': ('datum.setup === setup && indexof(encoders, datum.encoder) >= 0 && indexof(sources, datum.source) >= 0')
}
OF_TRIAL: Spec = {
    'lookup': 'trial',
    'from': {'data': {'name': 'trials'}, 'key': 'trial', 'fields': ['number', 'seed', 'bag', 'outcome']},
}

SOURCE_NAMES: Spec = {'name': 'source_names', 'value': [series.label for series in SERIES]}
SOURCE_NAME: Spec = {'calculate': 'source_names[datum.source]', 'as': 'source_name'}
SOURCE_SHAPE: Spec = {
    'field': 'source',
    'type': 'nominal',
    'scale': {'domain': list(range(len(SERIES))), 'range': [SHAPES[series.marker] for series in SERIES]},
    'legend': None,
}

# Numbers on axes of the chosen quantity have its unit with them: titles cannot change.
UNITS: Spec = {'name': 'units', 'value': {quantity.axis: quantity.unit for quantity in QUANTITIES}}
WITH_UNIT = f"format(datum.value, '{PLAIN}') + ' ' + units[quantity]"

WHICH_TRIAL = {'number': 'trial', 'seed': 'seed', 'bag': 'bag', 'outcome': 'end'}


def tip(titles: Dict[str, str], formats: str = '') -> List[Spec]:
    """Return what is told of a mark under the pointer: fields with their titles, numbers in a format of D3."""
    return [
        {'field': field, 'title': title, **({'type': 'quantitative', 'format': formats} if formats else {})}
        for field, title in titles.items()
    ]


TRIAL_TIP = [
    *tip({'encoder': 'encoder', **WHICH_TRIAL, 'source_name': 'pose'}),
    *tip({'x': 'x [m]', 'y': 'y [m]'}, '.4f'),
    *tip({'yaw': 'yaw [deg]'}, '.3f'),
]


def encoder_colour(colours: Dict[str, str]) -> Spec:
    """Return the colour of an encoder, by the field of that name."""
    scale = {'domain': list(colours), 'range': list(colours.values())}
    return {'field': 'encoder', 'type': 'nominal', 'scale': scale, 'legend': None}
