"""Parameters that can be changed while a node runs: upstream's names and limits, with the values in force."""

from __future__ import annotations

import math
import typing
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Tuple

from diff_encoder_sim.base.typed_params import Params

# Sets all parameters of its namespace to their values at the start.
RESTORE_DEFAULTS = 'restore_defaults'

# From least to most, which may be infinite; None where the type alone is the limit.
Limits = Optional[Tuple[float, float]]

_TYPE_NAMES = {bool: 'bool', int: 'int', float: 'double', str: 'str'}
_TYPE_LIMITS: Dict[type, Tuple[Any, Any]] = {
    bool: (False, True),
    int: (-(2**31), 2**31 - 1),
    float: (-math.inf, math.inf),
    str: ('', ''),
}


class Adjustable(NamedTuple):
    """One parameter; its type is that of its value."""

    name: str
    value: Any
    least: Any
    most: Any
    description: str
    choices: Tuple[Any, ...] = ()  # all allowed values, where these are few

    @property
    def type_name(self) -> str:
        """Return the type as dynamic_reconfigure calls it."""
        return _TYPE_NAMES[type(self.value)]


def adjustable(name: str, value: Any, limits: Limits, description: str, choices: Tuple[Any, ...] = ()) -> Adjustable:
    """Make a parameter; a value that is beyond the limits widens them."""
    kind = type(value)
    least, most = _TYPE_LIMITS[kind]
    if limits is not None:
        least, most = min(kind(limits[0]), value), max(kind(min(limits[1], most)), value)
    return Adjustable(name, value, least, most, description, choices)


def adjustables_of(params: Params, limits: Mapping[str, Limits]) -> List[Adjustable]:
    """Make parameters of the fields that `limits` names."""
    made = []
    for name, its_limits in limits.items():
        field = type(params).model_fields[name]
        choices = typing.get_args(field.annotation) if typing.get_origin(field.annotation) is not None else ()
        made.append(adjustable(name, getattr(params, name), its_limits, field.description or '', choices))
    return made
