"""Typed parameters: defaults in code, values from YAML or ROS, validated once, each with unit and bounds."""

from __future__ import annotations

import difflib
import re
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, Iterator, List, Mapping, Optional, Tuple, Type, TypeVar, Union

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import PydanticCustomError
from typing_extensions import Annotated, get_args

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.yaml_files import load_yaml


def _is_printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError('printable characters')
    return text


Line = Annotated[str, AfterValidator(_is_printable)]


def flat(mapping: Mapping[str, Any], prefix: str = '') -> Iterator[Tuple[str, Any]]:
    """Yield dotted keys and values; an empty mapping within has none."""
    for key, value in mapping.items():
        if isinstance(value, Mapping):
            yield from flat(value, f'{prefix}{key}.')
        else:
            yield f'{prefix}{key}', value


def nested(values: Mapping[str, Any]) -> Dict[str, Any]:
    """Return nested mappings of values by dotted keys; later keys replace earlier ones."""
    result: Dict[str, Any] = {}
    for key, value in values.items():
        first, _, below = key.partition('.')
        result = merged(result, {first: nested({below: value}) if below else value})
    return result


def merged(below: Mapping[str, Any], above: Mapping[str, Any]) -> Dict[str, Any]:
    """Merge both; values of `above` take precedence."""
    result = dict(below)
    for key, value in above.items():
        old = result.get(key)
        result[key] = merged(old, value) if isinstance(old, Mapping) and isinstance(value, Mapping) else value
    return result


def param(default: Any, description: str) -> Any:
    """Declare a parameter of a struct by default and description with unit."""
    return Field(default, description=description)


P = TypeVar('P', bound='Params')


class Params(BaseModel):
    """Base of all parameter structs: frozen, strict (no text as numbers), no unknown keys."""

    model_config = ConfigDict(frozen=True, strict=True, extra='forbid', allow_inf_nan=False, validate_default=True)

    @classmethod
    def from_mapping(cls: Type[P], mapping: Any, source: str) -> P:
        """Validate `mapping`; `source` names the file or node in the error, '' for none.

        ConfigError: one line with the key, the given value and the allowed values.
        """
        prefix = f'{source}: ' if source else ''
        if not isinstance(mapping, Mapping):
            raise ConfigError(
                f'{prefix}given {_shown(mapping)}; allowed: a mapping with the keys {", ".join(keys_of(cls))}'
            )
        try:
            return cls.model_validate(dict(mapping))
        except ValidationError as error:
            raise ConfigError(prefix + _first_problem(cls, error)) from None

    def values_in_use(self) -> Dict[str, Any]:
        """Return the values as in YAML, by key; subclasses replace overridden values."""
        return self.model_dump(mode='json', by_alias=True, exclude_none=True)


def not_allowed(key: str, given: Any, allowed: str) -> PydanticCustomError:
    """Return the error of a validator of several keys, with the (dotted) key at fault."""
    return PydanticCustomError('not_allowed', '{allowed}', {'key': key, 'given': given, 'allowed': allowed})


def missing(key: str) -> PydanticCustomError:
    """Return the error of a validator for a key that other keys require."""
    return PydanticCustomError('missing', 'missing', {'key': key})


def with_changes(params: P, changes: Mapping[str, Any], source: str) -> P:
    """Return a struct with changes, validated as a whole; nested structs are merged. ConfigError if not allowed."""
    given = params.model_dump(exclude_unset=True)
    for key in changes:
        nested = getattr(params, key, None)
        if isinstance(nested, Params):  # which may be a default with changes of its own
            given[key] = nested.model_dump(exclude_unset=True)
    return type(params).from_mapping(merged(given, changes), source)


def load_params(params_class: Type[P], path: Union[str, Path]) -> P:
    """Read a YAML file into `params_class`; ConfigError if it cannot be read, is not YAML, or holds a bad value."""
    return params_class.from_mapping(load_yaml(path), str(path))


def shared_params(mapping: Mapping[str, Any], source: str, params_class: Type[P], *also_known: Type[Params]) -> P:
    """Build one struct from a flat mapping that other classes share; ConfigError for a bad value or an unknown key."""
    own = set(keys_of(params_class))
    known = own.union(*map(keys_of, also_known))
    for key in mapping:
        if key not in known:
            raise ConfigError(f'{source}: {key}: unknown key{did_you_mean(str(key), known)}')
    return params_class.from_mapping({key: value for key, value in mapping.items() if key in own}, source)


def split_params(mapping: Mapping[str, Any], source: str, *params_classes: Type[Params]) -> List[Params]:
    """Build a struct of each class from a flat mapping that they share; ConfigError for a bad value or unknown key."""
    return [shared_params(mapping, source, each, *params_classes) for each in params_classes]


def did_you_mean(given: str, known: Iterable[str]) -> str:
    """Return '; did you mean X?' if one of `known` is close to `given`, else nothing."""
    close = difflib.get_close_matches(given, list(known), n=1)
    return f'; did you mean {close[0]!r}?' if close else ''


def keys_of(params_class: Type[Params]) -> List[str]:
    """Return the keys that users write: a field's alias if its name is a Python name (`str`)."""
    return [field.alias or name for name, field in params_class.model_fields.items()]


def _first_problem(params_class: Type[Params], error: ValidationError) -> str:
    # Report a misspelt key before the missing one.
    problem = next((each for each in error.errors() if each['type'] == 'extra_forbidden'), error.errors()[0])
    kind, by_validator = problem['type'], problem.get('ctx', {})
    path = [str(part) for part in problem['loc']] + ([by_validator['key']] if 'key' in by_validator else [])
    key, given = '.'.join(path) or 'value', by_validator.get('given', problem['input'])
    if kind == 'extra_forbidden':
        return f'{key}: unknown key{did_you_mean(path[-1], _keys_at(params_class, path[:-1]))}'
    if kind == 'missing':
        return f'{key}: missing'
    allowed = problem['msg'].replace('Input should be ', '').replace('Value error, ', '')
    if kind in ('model_type', 'dict_type'):
        allowed = 'a mapping (key: value)'
    # ROS's YAML reads a number without a point or sign as text.
    if kind in ('float_type', 'int_type') and re.fullmatch(r'[-+]?[0-9.]+[eE][-+]?[0-9]+', str(given)):
        allowed += ', which YAML writes with point and sign: 1.0e-3'
    return f'{key}: given {_shown(given)}; allowed: {allowed}'


def _keys_at(params_class: Type[Params], path: List[str]) -> List[str]:
    """Return the keys of the struct that a path of keys leads to."""
    for part in path:
        fields = params_class.model_fields.items()
        annotation = next((field.annotation for name, field in fields if part in (name, field.alias)), None)
        params_class = _struct_in(annotation) or params_class
    return keys_of(params_class)


def field_struct(annotation: Any) -> Optional[Type[Params]]:
    """Return the struct that a field of this type is, or is unless it is None; None for other types."""
    kinds = get_args(annotation) if type(None) in get_args(annotation) else [annotation]
    return next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Params)), None)


def _struct_in(annotation: Any) -> Optional[Type[Params]]:
    """Return the struct in a field's type; None if there is none."""
    if isinstance(annotation, type) and issubclass(annotation, Params):
        return annotation
    return next(filter(None, map(_struct_in, get_args(annotation))), None)


def _shown(given: Any) -> str:
    text = repr(given)
    return text if len(text) < 80 else text[:77] + '...'


# Values for XML-RPC, which has 32-bit integers.
LARGEST_INT = 2**31 - 1


def for_xml_rpc(value: Any) -> Any:
    """Return a value with large integers as text, also in mappings and lists."""
    return _mapped(lambda each: str(each) if isinstance(each, int) and abs(each) > LARGEST_INT else each, value)


def from_xml_rpc(value: Any) -> Any:
    """Reverse `for_xml_rpc`."""
    return _mapped(lambda each: int(each) if re.fullmatch('-?[1-9][0-9]{9,18}', str(each)) else each, value)


def _mapped(function: Callable[[Any], Any], value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _mapped(function, each) for key, each in value.items()}
    return [_mapped(function, each) for each in value] if isinstance(value, list) else function(value)
