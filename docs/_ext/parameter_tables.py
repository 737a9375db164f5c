"""Rows of a parameter table, from a class of typed parameters."""

from __future__ import annotations

import typing
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Sequence, Tuple, Type

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined
from sphinx.errors import ExtensionError

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.base.per_wheel import PerWheel, WheelDiameter, WheelDiameterOrZero
from diff_encoder_sim.robots.calibration_file import CalibrationParams, Estimate
from diff_encoder_sim.wheels.encoder_params import ppr_label

_ONE_OR_BOTH = 'number, or `{left: , right: }`'
NAMES = {
    bool: 'bool',
    int: 'int',
    float: 'float',
    str: 'string',
    Any: 'any',
    dict: 'mapping',
    CalibrationParams: 'mapping',
    ImuParams: 'mapping',
    PerWheel: _ONE_OR_BOTH,
    WheelDiameter: _ONE_OR_BOTH,
    WheelDiameterOrZero: _ONE_OR_BOTH,
}


class Row(NamedTuple):
    """One parameter, as Markdown."""

    name: str
    type_text: str
    default: str
    configured: str  # in the file of config/, where it has another value than the default
    meaning: str


class Table(NamedTuple):
    """The parameters of one class; `namespaces` are all in which they stand, '' for the node's own."""

    namespaces: Tuple[str, ...]
    rows: Tuple[Row, ...]


def parameter_tables(params_class: Type[Params], config: Mapping[str, Any]) -> List[Table]:
    """Make one table of the class and one of each class nested in it; `config` is what the file in config/ says."""
    groups: Dict[Type[Params], Dict[str, Any]] = {}
    for namespace, part, default in _parts(params_class, None, ''):
        groups.setdefault(part, {})[namespace] = default
    return [Table(tuple(defaults), tuple(_rows(part, defaults, config))) for part, defaults in groups.items()]


def _parts(params_class: Type[Params], default: Any, namespace: str) -> Iterator[Tuple[str, Type[Params], Any]]:
    yield namespace, params_class, default
    for name, field in params_class.model_fields.items():
        if _is_nested(field):
            nested = _default(name, field, default)
            # One that must be given has the defaults of its class.
            nested = None if nested is PydanticUndefined else nested
            yield from _parts(field.annotation, nested, f'{namespace}{_key(name, field)}/')


def _rows(params_class: Type[Params], defaults: Mapping[str, Any], config: Mapping[str, Any]) -> Iterator[Row]:
    for name, field in params_class.model_fields.items():
        if _is_nested(field):
            continue
        if not field.description:
            raise ExtensionError(f'{params_class.__name__}.{name} has no description')
        key = _key(name, field)
        default = {space: _text(_default(name, field, part)) for space, part in defaults.items()}
        configured = {space: _configured(config, space, key) for space in defaults}
        differing = {space: '' if text == default[space] else text for space, text in configured.items()}
        yield Row(f'`{key}`', _type_text(field), _merged(default), _merged(differing), field.description)


def _is_nested(field: FieldInfo) -> bool:
    kind = field.annotation
    return isinstance(kind, type) and issubclass(kind, Params) and not issubclass(kind, (PerWheel, Estimate))


def _key(name: str, field: FieldInfo) -> str:
    return field.alias or name


def _default(name: str, field: FieldInfo, instance: Any) -> Any:
    """Take a nested class's defaults from the instance that stands for it."""
    return field.get_default(call_default_factory=True) if instance is None else getattr(instance, name)


def _configured(config: Mapping[str, Any], namespace: str, key: str) -> str:
    for part in filter(None, namespace.split('/')):
        config = config.get(part, {})
    return _text(config[key]) if key in config else ''


def _merged(texts: Mapping[str, str]) -> str:
    """One text where all namespaces have the same, else each with its namespace."""
    if len(set(texts.values())) == 1:
        return next(iter(texts.values()))
    return ', '.join(f'{text or "none"} ({namespace.rstrip("/")})' for namespace, text in texts.items())


def _text(value: Any) -> str:
    """Return a value as YAML has it, as code; '' for none."""
    if value is PydanticUndefined:
        return 'required'
    if value is None or value in ('', [], {}):
        return ''
    if isinstance(value, Params) and not isinstance(value, PerWheel):
        return '`{' + ', '.join(f'{name}: {part:g}' for name, part in value.model_dump().items()) + '}`'
    texts = {PerWheel: ppr_label, bool: lambda flag: str(flag).lower(), float: _limit, int: str}
    return f'`{texts.get(type(value), str)(value)}`'


def _type_text(field: FieldInfo) -> str:
    return _bounded(_kind(field.annotation), field.metadata)


def _bounded(kind: str, metadata: Sequence[Any]) -> str:
    """Add the bounds of a number, which pydantic keeps beside its type."""
    return ', '.join([kind, *(str(part) for part in metadata if isinstance(part, Between))])


def _limit(number: float) -> str:
    return f'{number:.4g}'.replace('e+0', 'e').replace('e-0', 'e-')


def _kind(annotation: Any) -> str:
    """Return what a user may write for an annotation."""
    origin, parts = typing.get_origin(annotation), typing.get_args(annotation)
    if hasattr(annotation, '__metadata__'):  # Annotated[...]
        return _bounded(_kind(annotation.__origin__), annotation.__metadata__)
    if origin is typing.Union:
        return _kind(next(part for part in parts if part is not type(None)))
    if origin is typing.Literal:
        return ', '.join(map(_text, dict.fromkeys(int(part) if isinstance(part, bool) else part for part in parts)))
    if origin is list:
        return f'list of {_kind(parts[0])}'
    if isinstance(annotation, type) and issubclass(annotation, Params) and annotation not in NAMES:
        return '`{' + ', '.join(annotation.model_fields) + '}`'
    return NAMES[origin or annotation]
