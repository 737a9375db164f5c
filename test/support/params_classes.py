"""All classes of parameters, found by walking the package, each with a mapping that it accepts."""

import importlib
import pkgutil
import typing

import diff_encoder_sim
from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.params import Params

ESTIMATE = {'value': 1.0, 'interval': [0.5, 2.0]}
# Where more is needed than a value for each field that has no default.
ROUTE = {'name': 't', 'world': 'hallway', 'route': [{'goal': {'x': 1.0}}]}
EXAMPLES = {
    'EncoderFileParams': {
        **dict.fromkeys(('manufacturer', 'part', 'type', 'price'), 'a'),
        'source': ['a'],
        'encoder': {'lines': 1},
    },
    'Segment': {'straight': 1.0},
    'Leg': {'turns': 1.0},
    'TestDefinition': ROUTE,
    'BehaviourParams': {'name': 'b', 'type': 'rotate_recovery/RotateRecovery'},
    **dict.fromkeys(('Estimate', 'Magnitude'), ESTIMATE),
    'CalibratedDrive': {'file': 'a', 'sha256': 64 * 'a'},
    'CalibrationParams': {
        **dict.fromkeys(('left_wheel_diameter_m', 'right_wheel_diameter_m', 'wheel_separation_m'), ESTIMATE),
        **dict.fromkeys(('reference_x_m', 'reference_y_m', 'reference_delay_s', 'slip_rad2_per_rad'), ESTIMATE),
        'slip_m2_per_m': {'value': 0.0, 'interval': [0.0, 1.0]},
        'geometry_covariance': [[0.0] * 3] * 3,
        'drives': [{'file': 'a', 'sha256': 64 * 'a'}],
    },
    'NodeMapping': {'input': {'/ticks.data[0]': 'left_count', '/ticks.data[1]': 'right_count'}},
    'RasteriseParams': {'free': [0.0, 0.0], 'height': 1.0, 'resolution': 0.05},
}


def params_classes():
    """Every class but PerWheel's base; those of ros/ where ROS is installed."""
    for module in pkgutil.walk_packages(diff_encoder_sim.__path__, 'diff_encoder_sim.', onerror=lambda _: None):
        try:
            importlib.import_module(module.name)
        except ImportError:
            assert module.name.startswith(('diff_encoder_sim.ros.', 'diff_encoder_sim.msg'))
    found, fresh = set(), {Params}
    while fresh:
        found |= fresh
        fresh = {below for each in fresh for below in each.__subclasses__()} - found
    package = {each for each in found if each.__module__.startswith('diff_encoder_sim.')}
    return sorted(package - {Params}, key=lambda each: (each.__module__, each.__name__))


def example(params_class):
    """A mapping, as users write it, that the class accepts."""
    if params_class.__name__ in EXAMPLES:
        return EXAMPLES[params_class.__name__]
    fields = params_class.model_fields.items()
    return {field.alias or name: _value(field.annotation) for name, field in fields if field.is_required()}


def _value(annotation):
    origin, parts = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is list:
        return [_value(parts[0])] * 3
    if hasattr(annotation, '__metadata__'):
        return _value(parts[0])
    if origin is typing.Literal:
        return parts[0]
    if isinstance(annotation, type) and issubclass(annotation, Params):
        return example(annotation)
    return {str: 'a', float: 1.0, int: 1}[annotation]


def numbers_of(params_class):
    """(key, its bounds or None) of each field that is a number, or a list of numbers."""
    for name, field in params_class.model_fields.items():
        kinds, metadata = [field.annotation], list(field.metadata)
        while kinds:
            kind = kinds.pop()
            metadata += getattr(kind, '__metadata__', ())
            kinds += [part for part in typing.get_args(kind) if isinstance(part, type) or typing.get_args(part)]
            if kind in (int, float):
                yield field.alias or name, next((part for part in metadata if isinstance(part, Between)), None)
                break
