"""A calibration as text, tables and JSON."""

from __future__ import annotations

import math
from typing import Any, Dict, Iterator, List, Mapping, Sequence

import numpy as np

from diff_encoder_sim.analysis.text_tables import TextTable
from diff_encoder_sim.calibration.estimation import Calibration, Disturbance
from diff_encoder_sim.calibration.prediction import Prediction

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
OF_SCALE = np.array([0.5, 0.5, 0.0])  # of the logarithms of left diameter, right diameter and separation
NOT_DETERMINED = 0.2  # relative, half of an interval
AXES = ('along', 'across', 'heading')
UNITS = ('mm', 'mm', 'deg')
TO_SHOWN = np.array([1e3, 1e3, np.degrees(1.0)])
DECIMALS = (1, 1, 2)
PREDICTED = (
    'Error of odometry at the end of a drive, predicted by the others; of a single one: second half by the first.\n'
    'Along and across the heading at the start; before: with the nominal geometry.'
)


def calibration_tables(found: Calibration, predictions: Sequence[Prediction]) -> Iterator[TextTable]:
    """Yield values, disturbances and predictions."""
    rows = [[text, unit, *_value_texts(found, name)] for name, (text, unit) in SHOWN.items() if name in found.values]
    yield TextTable('Robot', ['', 'unit', 'value', '95 % from', 'to'], rows)
    if found.disturbances:
        rows = [[each.drive, kind_of(each), f'{each.start_s:.1f} to {each.end_s:.1f}'] for each in found.disturbances]
        yield TextTable('Disturbances', ['drive', 'disturbance', 'time [s]'], rows)
    if predictions:
        rows = [row for prediction in predictions for row in _prediction_rows(prediction)]
        heads = ['drive', 'error', 'length [m]', 'before', 'observed', '90 % from', 'to', 'inside']
        yield TextTable('Prediction', heads, rows, PREDICTED)


def _value_texts(found: Calibration, name: str) -> List[str]:
    """Return value, low and high with two digits of the interval's half."""
    value, unit = found.values[name], SHOWN[name][1]
    numbers = np.array([value.value, *value.interval])
    if name.startswith('slip'):
        numbers = np.sqrt(numbers)
    numbers = numbers * {'mm': 1e3, 'deg': math.degrees(1.0)}.get(unit, 1.0)
    half = 0.5 * (numbers[2] - numbers[1])
    if name in found.undetermined or (name.startswith('radius') and half > NOT_DETERMINED * numbers[0]):
        return ['', 'not', 'determined']
    decimals = min(6, max(0, 1 - math.floor(math.log10(half)))) if half > 0.0 else 6
    return [f'{number:.{decimals}f}' for number in numbers]


def _prediction_rows(prediction: Prediction) -> Iterator[List[str]]:
    nominal = np.full(3, np.nan) if prediction.nominal_error is None else prediction.nominal_error
    for axis, name in enumerate(AXES):
        if math.isfinite(prediction.error[axis]):
            numbers = [nominal[axis], prediction.error[axis], *prediction.interval[axis]]
            shown = [f'{number * TO_SHOWN[axis]:.{DECIMALS[axis]}f}'.replace('nan', '') for number in numbers]
            drive, length = ('', '') if axis else (prediction.drive, f'{prediction.length_m:.2f}')
            yield [drive, f'{name} [{UNITS[axis]}]', length, *shown, 'yes' if prediction.is_inside[axis] else 'no']


def kind_of(disturbance: Disturbance) -> str:
    """Say what may have happened."""
    return 'pushed, lifted, slipped, or reference moved' if disturbance.is_lasting else 'reference jumped'


def summary(found: Calibration, has_nominal: bool) -> List[str]:
    """Say how well the geometry is determined, and what the drives do not determine."""
    halves = {'scale': 1.96 * math.sqrt(OF_SCALE @ found.geometry_covariance @ OF_SCALE)}
    for text, name in (('ratio of radii', 'radius_ratio'), ('radius / separation', 'radius_per_separation')):
        value, (low, high) = found.values[name]
        halves[text] = 0.5 * (high - low) / value
    parts = [
        f'{text} to {100.0 * half:.1g} %' if half < NOT_DETERMINED else f'{text} not determined'
        for text, half in halves.items()
    ]
    names = [text for name, (text, _) in SHOWN.items() if name in found.undetermined]
    instead = 'the nominal geometry holds' if has_nominal else 'the robot file sets none'
    missing = f'not determined by these drives: {", ".join(names)} ({instead}); turns in both directions determine all'
    return [', '.join(parts), *([missing] if names else [])]


def pasted(controller: Mapping[str, Any], amcl: Mapping[str, Any]) -> str:
    """Return parameters of diff_drive_controller, robot_localization and AMCL as YAML, ready to paste."""
    variances = ', '.join(f'{variance:.3g}' for variance in controller['twist_covariance_diagonal'])
    velocities = ', '.join('true' if index in (6, 7, 11) else 'false' for index in range(15))
    return '\n'.join(
        [
            '# diff_drive_controller',
            *(f'{key}: {value:.6g}' for key, value in controller.items() if isinstance(value, float)),
            f'twist_covariance_diagonal: [{variances}]  # at 50 Hz and the mean speed of the drives',
            '# robot_localization: only velocities, as the error of the pose grows with the distance',
            f'odom0_config: [{velocities}]',
            '# AMCL',
            *(f'{key}: {value:.4g}' if isinstance(value, float) else f'{key}: {value}' for key, value in amcl.items()),
        ]
    )


def calibration_text(
    found: Calibration, predictions: Sequence[Prediction], has_nominal: bool, settings: Mapping[str, Mapping[str, Any]]
) -> str:
    """Return tables, summary, and the parameters of `calibrated_settings` for the terminal."""
    robot, *others = (table.text() for table in calibration_tables(found, predictions))
    parameters = settings['diff_drive_controller'], settings['amcl']
    texts = [robot, '\n'.join(summary(found, has_nominal)), *others, *([pasted(*parameters)] if parameters[0] else [])]
    return '\n\n'.join(texts)


def calibration_json(found: Calibration, predictions: Sequence[Prediction]) -> Dict[str, Any]:
    """Return all but the fits for a JSON file; vectors are along, across and heading [m, m, rad]."""
    content = {
        **{name: each._asdict() for name, each in found.values.items()},
        'undetermined': found.undetermined,
        'disturbances': [each._asdict() for each in found.disturbances],
        'predictions': [
            {**each._asdict(), 'bias': each.interval.mean(axis=1), 'is_inside': each.is_inside} for each in predictions
        ],
        # The robot file allows variances to 1; a larger one says no more.
        'geometry_covariance': found.geometry_covariance / max(1.0, found.geometry_covariance.diagonal().max()),
    }
    plain: Dict[str, Any] = _plain(content)
    return plain


def _plain(value: Any) -> Any:
    """Return a value of JSON: arrays and tuples as lists, None for what is not finite."""
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return _plain(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value
