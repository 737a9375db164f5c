"""A calibration as text, tables and JSON."""

from __future__ import annotations

import json
import math
from typing import Any, Dict, Iterator, List, Sequence

import numpy as np

from diff_encoder_sim.analysis.result_tables import TextTable
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.calibration.estimation import Calibration, Disturbance
from diff_encoder_sim.calibration.prediction import LEVEL, Prediction

special = deferred('scipy.special')

SHOWN = {  # value: text, unit
    'left_wheel_diameter_m': ('left wheel diameter', 'm'),
    'right_wheel_diameter_m': ('right wheel diameter', 'm'),
    'wheel_separation_m': ('wheel separation', 'm'),
    'radius_ratio': ('right / left wheel radius', ''),
    'radius_per_separation': ('left wheel radius / separation', ''),
    'reference_x_m': ('reference ahead of the base frame', 'm'),
    'reference_y_m': ('reference to the left of it', 'm'),
    'reference_yaw_rad': ('reference turned to the left', 'deg'),
    'reference_delay_s': ('reference is late by', 's'),
    'slip_m2_per_m': ('slip of a wheel, std after 1 m', 'mm'),
    'slip_rad2_per_rad': ('slip of turns, std after 1 rad', 'deg'),
}
BY_MOTION = {
    'slip_by_acceleration': 'slip per acceleration',
    'slip_by_lateral_acceleration': 'slip per lateral acceleration',
}
SUPPORTED = 'AIC: minus that without this slip; supported: by the ratio of likelihoods, at 5 %.'
OF_SCALE = np.array([0.5, 0.5, 0.0])  # of the logarithms of left diameter, right diameter and separation
NOT_DETERMINED = 0.2  # relative, half of an interval
AXES = {'along': 'mm', 'across': 'mm', 'heading': 'deg'}
TO_SHOWN = {'mm': 1e3, 'deg': math.degrees(1.0)}
DECIMALS = {'mm': 1, 'deg': 2}
PREDICTED = (
    'Error of odometry at the end of a drive, predicted by the others; of a single one: second half by the first.\n'
    'Along and across the heading at the start; before: with the nominal geometry.'
)
BY_CHANCE = 0.01  # probability below which so many errors outside of their intervals have another reason
DIFFERING = (
    'The drives differ by more than slip explains (floor, load, tyres, casters): count on the observed errors, and '
    'calibrate on drives with turns in both directions.'
)


def calibration_tables(found: Calibration, predictions: Sequence[Prediction]) -> Iterator[TextTable]:
    """Yield values, disturbances and predictions."""
    rows = [[text, unit, *_value_texts(found, name)] for name, (text, unit) in SHOWN.items() if name in found.values]
    yield TextTable('Robot', ['', 'unit', 'value', '95 % from', 'to'], rows)
    if found.support:
        rows = [[text, *_by_motion_texts(found, name)] for name, text in BY_MOTION.items()]
        heads = ['[1/(m/s^2)]', 'value', '95 % from', 'to', 'AIC', 'supported']
        yield TextTable('Slip by motion', heads, rows, SUPPORTED)
    if found.disturbances:
        rows = [[each.drive, kind_of(each), f'{each.start_s:.1f} to {each.end_s:.1f}'] for each in found.disturbances]
        yield TextTable('Disturbances', ['drive', 'disturbance', 'time [s]'], rows)
    if predictions:
        rows = [row for prediction in predictions for row in _prediction_rows(prediction)]
        note = prediction_note(found.disturbances, predictions)
        heads = ['drive', 'error', 'length [m]', 'before', 'observed', '90 % from', 'to', 'inside']
        yield TextTable('Prediction', heads, rows, '\n'.join(filter(None, [PREDICTED, note])))


def _by_motion_texts(found: Calibration, name: str) -> List[str]:
    value, (low, high) = found.values[name]
    numbers = [f'{number:.4f}' for number in (value, low, high)]
    return [*numbers, f'{2.0 - 2.0 * found.support[name]:+.1f}', 'no' if name in found.unsupported else 'yes']


def _value_texts(found: Calibration, name: str) -> List[str]:
    """Return value, low and high with two digits of the interval's half."""
    value, (low, high) = found.values[name]
    numbers = np.array([value, low, high]) ** (0.5 if name.startswith('slip') else 1.0)
    numbers *= TO_SHOWN.get(SHOWN[name][1], 1.0)
    half = 0.5 * (numbers[2] - numbers[1])
    if name in found.undetermined or (name.startswith('radius') and half > NOT_DETERMINED * numbers[0]):
        return ['', 'not', 'determined']
    decimals = min(6, max(0, 1 - math.floor(math.log10(half)))) if half > 0.0 else 6
    return [f'{number:.{decimals}f}' for number in numbers]


def _prediction_rows(prediction: Prediction) -> Iterator[List[str]]:
    nominal = np.full(3, np.nan) if prediction.nominal_error is None else prediction.nominal_error
    numbers = np.column_stack((nominal, prediction.error, prediction.interval))
    for row, (axis, unit) in enumerate(AXES.items()):
        if math.isfinite(prediction.error[row]):
            shown = [f'{each:.{DECIMALS[unit]}f}'.replace('nan', '') for each in numbers[row] * TO_SHOWN[unit]]
            drive, length = ('', '') if row else (prediction.drive, f'{prediction.length_m:.2f}')
            yield [drive, f'{axis} [{unit}]', length, *shown, 'yes' if prediction.is_inside[row] else 'no']


def prediction_note(disturbances: Sequence[Disturbance], predictions: Sequence[Prediction]) -> str:
    """Say if more errors of several drives are outside of their intervals than chance allows; else ''."""
    disturbed = {each.drive for each in disturbances if each.is_lasting}  # where more than slip is no surprise
    is_inside = [each.is_inside[np.isfinite(each.error)] for each in predictions if each.drive not in disturbed]
    outside, count = sum(map(np.count_nonzero, map(np.invert, is_inside))), sum(map(len, is_inside))
    return DIFFERING if len(is_inside) > 1 and special.bdtrc(outside - 1, count, 1.0 - LEVEL) < BY_CHANCE else ''


def kind_of(disturbance: Disturbance) -> str:
    """Say what may have happened."""
    return 'pushed, lifted, slipped, or reference moved' if disturbance.is_lasting else 'reference jumped'


def summary(found: Calibration, has_nominal: bool) -> List[str]:
    """Say how well the geometry is determined, and what the drives do not determine."""
    is_nominal = 'radius_ratio' in found.undetermined
    halves = {'scale': math.inf if is_nominal else 1.96 * math.sqrt(OF_SCALE @ found.geometry_covariance @ OF_SCALE)}
    for text, name in (('ratio of radii', 'radius_ratio'), ('radius / separation', 'radius_per_separation')):
        value, interval = found.values[name]
        halves[text] = math.inf if name in found.undetermined else 0.5 * float(np.ptp(interval)) / value
    determined = {text: f'to {100.0 * half:.1g} %' for text, half in halves.items() if half < NOT_DETERMINED}
    parts = [f'{text} {determined.get(text, "not determined")}' for text in halves]
    names = [text for name, (text, _) in SHOWN.items() if name in found.undetermined]
    instead = 'the nominal geometry holds' if has_nominal else 'the robot file sets none'
    missing = f'not determined by these drives: {", ".join(names)} ({instead}); turns in both directions determine all'
    return [', '.join(parts), *([missing] if names else [])]


def calibration_text(found: Calibration, predictions: Sequence[Prediction], has_nominal: bool, parameters: str) -> str:
    """Return tables, summary, and the `parameters` of other packages for the terminal."""
    robot, *others = (table.text() for table in calibration_tables(found, predictions))
    return '\n\n'.join(filter(None, [robot, '\n'.join(summary(found, has_nominal)), *others, parameters]))


def calibration_json(found: Calibration, predictions: Sequence[Prediction]) -> Dict[str, Any]:
    """Return all but the fits for a JSON file; vectors are along, across and heading [m, m, rad]."""
    content = {
        **{name: each._asdict() for name, each in found.values.items()},
        **({'support': found.support} if found.support else {}),
        'undetermined': found.undetermined,
        'disturbances': [each._asdict() for each in found.disturbances],
        'predictions': [
            {**each._asdict(), 'bias': each.interval.mean(axis=1), 'is_inside': each.is_inside} for each in predictions
        ],
        'prediction_note': prediction_note(found.disturbances, predictions),
        # The robot file allows variances to 1; a larger one says no more.
        'geometry_covariance': found.geometry_covariance / max(1.0, found.geometry_covariance.diagonal().max()),
    }
    text = json.dumps(content, default=lambda array: array.tolist())
    plain: Dict[str, Any] = json.loads(
        text, parse_float=lambda x: float(f'{float(x):.8g}'), parse_constant=lambda _: None
    )
    return plain  # None for NaN; no interval has 8 digits
