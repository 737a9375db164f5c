"""Layered parameters of costmap_2d, brought to the flat names of one costmap.

costmap_2d accepts a list of plugins, each with parameters in a namespace of its own, or the older flat form. Names
are the same in both, so a layer's parameters only move up.
"""

from __future__ import annotations

import math
from typing import Any, Dict, List, Mapping, Set

from diff_encoder_sim.base.bounded_numbers import LENGTH, is_number

STATIC, OBSTACLE, INFLATION = (f'costmap_2d::{kind}Layer' for kind in ('Static', 'Obstacle', 'Inflation'))
ORDER = (STATIC, OBSTACLE, INFLATION)
# Names of the layers where no plugins are listed.
USUAL_NAMES = {'static_layer': STATIC, 'obstacle_layer': OBSTACLE, 'inflation_layer': INFLATION}

# Parameters of a layer that mean something else, or nothing, for the whole costmap.
NOT_MOVED = {
    STATIC: ('enabled',),
    INFLATION: ('enabled',),
    OBSTACLE: ('enabled', 'track_unknown_space', 'transform_tolerance'),
}
# Ranges that a scan source may have; with one source they become the costmap's.
RANGES = ('obstacle_range', 'raytrace_range')
CIRCLE_CORNERS = 16


def flattened(given: Mapping[str, Any]) -> Dict[str, Any]:
    """Return a costmap's parameters, as users write them, as the flat ones of CostmapParams.

    Raises:
        ValueError: layers or sources that this package's costmap does not have.
    """
    flat = dict(given)
    off = _merge_listed_layers(flat) if 'plugins' in flat else _merge_usual_layers(flat)
    _name_source_scan(flat)
    if OBSTACLE in off:
        flat['observation_sources'] = ''
    if INFLATION in off:
        flat['inflation_radius'] = 0.0
    _make_footprint_of_radius(flat)
    if flat.get('rolling_window') is True:
        return {'static_map': False, 'track_unknown_space': False, **flat}
    return flat


def _merge_usual_layers(flat: Dict[str, Any]) -> Set[str]:
    """Move up the layers where none are listed; return the kinds that are not enabled."""
    return {kind for name, kind in USUAL_NAMES.items() if not _merge_layer(flat, name, kind)}


def _merge_listed_layers(flat: Dict[str, Any]) -> Set[str]:
    """Move up the layers that are listed as plugins; return the kinds that are not, or not enabled."""
    plugins = _checked_plugins(flat.pop('plugins'))
    kinds = [plugin['type'] for plugin in plugins]
    flat.pop('map_type', None)
    flat['static_map'] = STATIC in kinds
    enabled = {plugin['type'] for plugin in plugins if _merge_layer(flat, plugin['name'], plugin['type'])}
    return set(ORDER) - enabled


def _checked_plugins(plugins: Any) -> List[Dict[str, str]]:
    """Return a list of plugins that this costmap has, else raise ValueError."""
    if not isinstance(plugins, list) or not all(
        isinstance(plugin, dict) and isinstance(plugin.get('name'), str) and isinstance(plugin.get('type'), str)
        for plugin in plugins
    ):
        raise ValueError('plugins: a list of {name: ..., type: ...}')
    kinds = [plugin['type'] for plugin in plugins]
    if kinds != [kind for kind in ORDER if kind in kinds]:
        raise ValueError(f'plugins of the types {", ".join(ORDER)}, in this order, each once at most')
    return plugins


def _merge_layer(flat: Dict[str, Any], name: str, kind: str) -> bool:
    """Move up one layer's parameters, and return whether it is enabled.

    Where the costmap has them too, its own count, as upstream.
    """
    layer = flat.pop(name, {})
    if not isinstance(layer, dict):
        raise ValueError(f'{name}: a mapping, the parameters of this layer')
    enabled = layer.get('enabled', True)
    if not isinstance(enabled, bool):
        raise ValueError(f'{name}.enabled: true or false')
    if kind == STATIC and not enabled:
        raise ValueError(f'{name}.enabled: true; take the layer out of plugins instead')
    for key, value in layer.items():
        if key not in NOT_MOVED[kind]:
            flat.setdefault(key, value)
    return enabled


def _name_source_scan(flat: Dict[str, Any]) -> None:
    """Rename the one scan source to `scan` and move up its ranges."""
    sources = str(flat.get('observation_sources', 'scan')).split()
    if len(sources) > 1:
        raise ValueError(f'observation_sources: one laser, not {len(sources)}')
    if sources and sources != ['scan']:
        source = flat.pop(sources[0], {})
        if not isinstance(source, dict):
            raise ValueError(f'{sources[0]}: a mapping, the parameters of this source')
        flat['observation_sources'], flat['scan'] = 'scan', {'topic': sources[0], **source}
    source = flat.get('scan')
    if isinstance(source, dict):
        flat.update({key: source[key] for key in RANGES if key in source})
        flat['scan'] = {key: value for key, value in source.items() if key not in RANGES}


def _make_footprint_of_radius(flat: Dict[str, Any]) -> None:
    """Replace robot_radius by a polygon, unless there is a footprint."""
    radius_m = flat.pop('robot_radius', None)
    if flat.get('footprint') in ('', '[]', []):
        del flat['footprint']  # none, as upstream's default
    if radius_m is None or 'footprint' in flat:
        return
    if not (is_number(radius_m) and LENGTH.allows(radius_m)):
        raise ValueError(f'robot_radius: {LENGTH}, not {repr(radius_m)[:50]}')
    angles = [2.0 * math.pi * index / CIRCLE_CORNERS for index in range(CIRCLE_CORNERS)]
    flat['footprint'] = [[radius_m * math.cos(angle), radius_m * math.sin(angle)] for angle in angles]
