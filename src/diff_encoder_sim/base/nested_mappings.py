"""Mappings within mappings, as YAML files and ROS parameters have them, and their values by dotted keys."""

from __future__ import annotations

from typing import Any, Dict, Iterator, Mapping, Tuple


def flat(mapping: Mapping[str, Any], prefix: str = '') -> Iterator[Tuple[str, Any]]:
    """Yield dotted keys and values; an empty mapping within has none."""
    for key, value in mapping.items():
        if isinstance(value, Mapping):
            yield from flat(value, f'{prefix}{key}.')
        else:
            yield f'{prefix}{key}', value


def nested(values: Mapping[str, Any]) -> Dict[str, Any]:
    """Return mappings within mappings, of values by dotted keys; a later key replaces an earlier one."""
    result: Dict[str, Any] = {}
    for key, value in values.items():
        first, *below = key.split('.')
        result = merged(result, {first: nested({'.'.join(below): value}) if below else value})
    return result


def merged(below: Mapping[str, Any], above: Mapping[str, Any]) -> Dict[str, Any]:
    """Return both in one; where both have a value, that of `above`."""
    result = dict(below)
    for key, value in above.items():
        old = result.get(key)
        result[key] = merged(old, value) if isinstance(old, Mapping) and isinstance(value, Mapping) else value
    return result
