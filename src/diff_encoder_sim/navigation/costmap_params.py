"""Costs and parameters of a costmap, under costmap_2d's names, with a list of plugins or flat; the robot's outline."""

from __future__ import annotations

import json
import math
from typing import Any, Dict, List, Mapping, NamedTuple, Sequence

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, model_validator
from typing_extensions import Annotated, Literal

from diff_encoder_sim.base import bounds
from diff_encoder_sim.base.bounds import Between, Place_m
from diff_encoder_sim.base.params import Params, param

# Costs of cells, as costmap_2d's.
FREE = 0
INSCRIBED = 253  # the robot touches an obstacle whatever its heading
LETHAL = 254  # an obstacle
NO_INFORMATION = 255  # unknown space

# Costs of a footprint that cannot stand there, as in upstream's CostmapModel.
IN_OBSTACLE, IN_UNKNOWN, OFF_MAP = -1.0, -2.0, -3.0


class Footprint(NamedTuple):
    """Polygon around base_link, with the radii of the circles about base_link inside and around it."""

    vertices_m: np.ndarray  # (n, 2) x, y in base_link, padding included
    inscribed_radius_m: float
    circumscribed_radius_m: float


def make_footprint(points: Sequence[Sequence[float]], padding_m: float = 0.0) -> Footprint:
    """Make a footprint of corners [x, y] [m], each moved outwards by `padding_m` along both axes."""
    vertices_m = np.array(points, dtype=float)
    vertices_m = vertices_m + np.sign(vertices_m) * padding_m
    edges = np.roll(vertices_m, -1, axis=0) - vertices_m
    length_squared = np.maximum(np.einsum('ij,ij->i', edges, edges), 1e-12)
    along = np.clip(-np.einsum('ij,ij->i', vertices_m, edges) / length_squared, 0.0, 1.0)
    nearest = vertices_m + along[:, None] * edges
    return Footprint(vertices_m, float(np.hypot(*nearest.T).min()), float(np.hypot(*vertices_m.T).max()))


def _from_text(value: Any) -> Any:
    try:  # upstream's form: "[[0.25, 0.3], ...]"
        return json.loads(value) if isinstance(value, str) else value
    except (ValueError, RecursionError):
        return value


def _is_polygon(points: List[List[float]]) -> List[List[float]]:
    if len(points) < 3 or any(len(point) != 2 for point in points):
        raise ValueError('at least three corners [x, y] [m]')
    angles = [math.atan2(y, x) for x, y in points]
    turns = (np.diff([*angles, angles[0]]) + math.pi) % (2.0 * math.pi) - math.pi
    if make_footprint(points).inscribed_radius_m <= 0.0 or abs(turns.sum()) < math.pi:
        raise ValueError('a polygon around base_link')
    return points


FootprintPolygon = Annotated[
    List[List[bounds.Offset_m]],
    AfterValidator(_is_polygon),
    BeforeValidator(_from_text),
    Field(max_length=1000, description='corners [x, y] of the robot in base_link, in order around it [m]'),
]

# ALTO: 0.5 m long, 0.6 m wide, base_link in the middle.
ALTO_FOOTPRINT = [[0.25, -0.3], [0.25, 0.3], [-0.25, 0.3], [-0.25, -0.3]]

# The layers, in this order, and the names that they have if no plugins are listed.
LAYERS = {f'costmap_2d::{kind}Layer': f'{kind.lower()}_layer' for kind in ('Static', 'Obstacle', 'Inflation')}
STATIC, OBSTACLE, INFLATION = LAYERS

# Parameters of a layer that mean something else, or nothing, for the whole costmap.
NOT_MOVED = {STATIC: {'enabled'}, INFLATION: {'enabled'}}
NOT_MOVED[OBSTACLE] = {'enabled', 'track_unknown_space', 'transform_tolerance'}
RANGES = ('obstacle_range', 'raytrace_range')  # of a scan source; with one source they become the costmap's
CIRCLE_CORNERS = 16


def flattened(given: Mapping[str, Any]) -> Dict[str, Any]:
    """Return a costmap's parameters, as users write them, as the flat ones of CostmapParams; ValueError for others.

    A layer's parameters move up; if the costmap has them too, its own take precedence, as upstream. The one scan source
    is renamed to `scan`, its ranges move up; robot_radius becomes a polygon unless there is a footprint.
    """
    flat = dict(given)
    layers = {name: kind for kind, name in LAYERS.items()}
    if 'plugins' in flat:
        try:
            layers = {str(plugin['name']): plugin['type'] for plugin in flat.pop('plugins')}
        except (TypeError, KeyError):
            raise ValueError('plugins: a list of {name: ..., type: ...}') from None
        if list(layers.values()) != [kind for kind in LAYERS if kind in layers.values()]:
            raise ValueError(f'plugins of the types {", ".join(LAYERS)}, in this order, each once at most')
        flat.pop('map_type', None)
        flat['static_map'] = STATIC in layers.values()
    enabled = set()
    for name, kind in layers.items():
        layer = flat.pop(name, {})
        if not isinstance(layer, dict):
            raise ValueError(f'{name}: a mapping, the parameters of this layer')
        is_enabled = layer.get('enabled', True)
        if not isinstance(is_enabled, bool) or (kind == STATIC and not is_enabled):
            raise ValueError(f'{name}.enabled: true or false; a static layer is taken out of plugins instead')
        flat = {**{key: value for key, value in layer.items() if key not in NOT_MOVED[kind]}, **flat}
        enabled |= {kind} if is_enabled else set()
    _rename_source(flat)
    if OBSTACLE not in enabled:
        flat['observation_sources'] = ''
    if INFLATION not in enabled:
        flat['inflation_radius'] = 0.0
    _replace_radius(flat)
    return {'static_map': False, 'track_unknown_space': False, **flat} if flat.get('rolling_window') is True else flat


def _rename_source(flat: Dict[str, Any]) -> None:
    sources = str(flat.get('observation_sources', 'scan')).split()
    if len(sources) > 1:
        raise ValueError(f'observation_sources: one laser, not {len(sources)}')
    name = sources[0] if sources else 'scan'
    source = flat.get(name, {})
    if sources and not isinstance(source, (dict, Params)):
        raise ValueError(f'{name}: a mapping, the parameters of this source')
    if name != 'scan':
        flat.pop(name, None)
        flat['observation_sources'], source = 'scan', {'topic': name, **source}
    if isinstance(source, dict) and (sources or 'scan' in flat):
        flat.update({key: source[key] for key in RANGES if key in source})
        flat['scan'] = {key: value for key, value in source.items() if key not in RANGES}


def _replace_radius(flat: Dict[str, Any]) -> None:
    radius_m = flat.pop('robot_radius', None)
    if flat.get('footprint') in ('', '[]', []):
        del flat['footprint']  # none, as upstream's default
    if radius_m is not None and 'footprint' not in flat:
        if not (bounds.is_number(radius_m) and bounds.LENGTH.allows(radius_m)):
            raise ValueError(f'robot_radius: {bounds.LENGTH}, not {repr(radius_m)[:50]}')
        angles = [2.0 * math.pi * index / CIRCLE_CORNERS for index in range(CIRCLE_CORNERS)]
        flat['footprint'] = [[radius_m * math.cos(angle), radius_m * math.sin(angle)] for angle in angles]


MOST_CELLS = 4_000_000  # in a rolling window: 100 m x 100 m in cells of 5 cm
WindowSide_m = Annotated[float, Between(0.01, 200.0, 'm')]


class ScanSource(Params):
    """Entry of `observation_sources`: a laser that marks and clears."""

    topic: Literal['scan', '/scan'] = param('scan', 'remap the node for another topic')
    data_type: Literal['LaserScan'] = param('LaserScan', 'type of the message')
    sensor_frame: str = param('', "accepted, without effect: the scan's own frame is used")
    marking: bool = param(True, 'hits mark obstacles')
    clearing: bool = param(True, "rays clear what they pass; upstream's default is false: nothing is ever cleared")
    inf_is_valid: bool = param(True, "+inf, no return (REP 117), clears; upstream's default is false")
    expected_update_rate: bounds.Duration_s = param(0.0, 'accepted, without effect: see input_timeout [s]')
    observation_persistence: bounds.Duration_s = param(0.0, 'accepted, without effect: one scan at a time [s]')
    min_obstacle_height: Place_m = param(0.0, 'accepted, without effect: a scan has one height [m]')
    max_obstacle_height: Place_m = param(2.0, 'accepted, without effect: a scan has one height [m]')


class CostmapParams(Params):
    """Parameters of a costmap, in all of upstream's forms (`flattened`); some accept only the supported value."""

    global_frame: str = Field('map', min_length=1, description='frame of the costmap')
    robot_base_frame: str = Field('base_link', min_length=1, description='frame of the robot')
    map_type: Literal['costmap'] = param('costmap', 'cells of one layer')
    map_topic: Literal['map', '/map'] = param('map', 'remap the node for another topic')
    static_map: bool = param(True, 'size and walls are those of the map')
    rolling_window: bool = param(False, 'a window that moves with the robot')
    width: WindowSide_m = param(3.0, 'of a rolling window [m]')
    height: WindowSide_m = param(3.0, 'of a rolling window [m]')
    resolution: Annotated[float, Between(1e-3, 1.0, 'm')] = param(0.05, 'side of a cell of a rolling window [m]')
    update_frequency: bounds.Rate_Hz = param(5.0, 'how often scans are entered [Hz]')
    publish_frequency: bounds.RateOrZero_Hz = param(0.0, 'how often it is published [Hz]; 0: to newcomers only')
    always_send_full_costmap: bool = param(False, 'publish all cells; false: the changed, on costmap_updates')
    origin_x: Place_m = param(0.0, 'accepted, without effect: the map or the robot decides [m]')
    origin_y: Place_m = param(0.0, 'accepted, without effect: the map or the robot decides [m]')
    transform_tolerance: bounds.Duration_s = param(0.3, 'accepted, without effect: see input_timeout [s]')
    track_unknown_space: bool = param(True, 'unseen cells are unknown; false: free, as rolling windows and upstream')
    lethal_cost_threshold: Annotated[int, Between(1, 100, '%')] = param(100, 'least occupancy of a wall [%]')
    trinary_costmap: bool = param(True, 'occupancy below lethal_cost_threshold is free')
    unknown_cost_value: Literal[-1] = param(-1, 'occupancy that means unknown')
    use_maximum: Literal[False] = param(False, 'accepted: the only value')
    first_map_only: bool = param(False, 'accepted, without effect: only the first map is used')
    subscribe_to_updates: Literal[False] = param(False, 'accepted: the only value')
    combination_method: Literal[1] = param(1, 'the higher cost of map and obstacles counts')
    max_obstacle_height: Place_m = param(2.0, 'accepted, without effect: a scan has one height [m]')
    observation_sources: str = param('scan', "scan, or empty for none, which is upstream's default")
    scan: ScanSource = param(ScanSource(), 'the laser')
    obstacle_range: bounds.PositiveDistance_m = param(2.5, 'farthest hit that is marked [m]')
    raytrace_range: bounds.PositiveDistance_m = param(3.0, 'how far rays clear [m]')
    footprint_clearing_enabled: bool = param(True, 'cells under the robot are free')
    inflation_radius: Annotated[float, Between(0.0, 10.0, 'm')] = param(0.55, 'reach of the cost of obstacles [m]')
    cost_scaling_factor: Annotated[float, Between(0.0, 1e4, '1/m')] = param(10.0, 'its decay [1/m]')
    inflate_unknown: Literal[False] = param(False, 'accepted: the only value')
    footprint: FootprintPolygon = ALTO_FOOTPRINT
    footprint_padding: Annotated[float, Between(0.0, 100.0, 'm')] = param(0.01, 'added on all sides [m]')

    @model_validator(mode='before')
    @classmethod
    def _flatten(cls, given: Any) -> Any:
        return flattened(given) if isinstance(given, dict) else given

    @model_validator(mode='after')
    def _check_kind(self) -> CostmapParams:
        if self.static_map == self.rolling_window:
            raise ValueError('either static_map or rolling_window')
        if self.width * self.height > MOST_CELLS * self.resolution**2:
            raise ValueError(f'width, height and resolution of no more than {MOST_CELLS} cells')
        if self.observation_sources not in ('', 'scan'):
            raise ValueError("observation_sources: 'scan', or empty")
        return self


def local_defaults(**changes: object) -> CostmapParams:
    """Return the usual local costmap, 3 x 3 m, rolling, in the odom frame, with changes."""
    window = {'static_map': False, 'rolling_window': True, 'global_frame': 'odom'}
    return CostmapParams.from_mapping({**window, **changes}, '')
