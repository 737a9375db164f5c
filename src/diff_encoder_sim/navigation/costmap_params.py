"""Parameters of a costmap, under costmap_2d's names: with a list of plugins, or flat, without."""

from __future__ import annotations

from typing import Any

from pydantic import AfterValidator, Field, model_validator
from typing_extensions import Annotated, Literal

from diff_encoder_sim.base.typed_params import Params
from diff_encoder_sim.navigation.costmap_layer_params import flattened
from diff_encoder_sim.navigation.footprint import ALTO_FOOTPRINT, FootprintPolygon

# Of a rolling window: 200 m x 200 m in cells of 4 cm.
MOST_CELLS = 25_000_000


def _is_scan(topic: str) -> str:
    if topic.lstrip('/') != 'scan':
        raise ValueError("'scan' (remap the node's scan for another)")
    return topic


class ScanSource(Params):
    """The one entry of `observation_sources`: a laser that marks and clears."""

    topic: Annotated[str, AfterValidator(_is_scan)] = 'scan'
    data_type: Literal['LaserScan'] = 'LaserScan'
    sensor_frame: str = Field('', description="accepted: the scan's own counts")
    marking: bool = True
    clearing: bool = Field(True, description="upstream's default is false: nothing is ever cleared")
    inf_is_valid: bool = Field(True, description="+inf, no return (REP 117), clears; upstream's default is false")
    expected_update_rate: float = Field(0.0, ge=0, description='accepted: input_timeout stops the robot instead [s]')
    observation_persistence: float = Field(0.0, ge=0, description='accepted: one scan at a time')
    min_obstacle_height: float = Field(0.0, description='accepted: a scan has one height [m]')
    max_obstacle_height: float = Field(2.0, description='as min_obstacle_height')


class CostmapParams(Params):
    """Parameters of the global or the local costmap.

    Upstream's forms are all read: layers with namespaces of their own, a source of any name,
    robot_radius. Where upstream can do what this costmap cannot, only what it does is allowed.
    """

    global_frame: str = Field('map', min_length=1)
    robot_base_frame: str = Field('base_link', min_length=1)
    map_type: Literal['costmap'] = 'costmap'
    map_topic: Literal['map', '/map'] = 'map'
    static_map: bool = Field(True, description="the size and the walls are the map's")
    rolling_window: bool = Field(False, description='a window that moves with the robot')
    width: float = Field(3.0, gt=0, le=200, description='of a rolling window [m]')
    height: float = Field(3.0, gt=0, le=200, description='of a rolling window [m]')
    resolution: float = Field(0.05, gt=0, le=1, description='of a rolling window: a cell [m]')
    update_frequency: float = Field(5.0, gt=0, description='[Hz]')
    publish_frequency: float = Field(0.0, ge=0, description='[Hz]; 0: not published')
    always_send_full_costmap: bool = Field(False, description='accepted: it always is')
    origin_x: float = Field(0.0, description='accepted: the map, or the robot, has the say')
    origin_y: float = Field(0.0, description='as origin_x')
    transform_tolerance: float = Field(0.3, ge=0, description='accepted: input_timeout stops the robot instead [s]')
    track_unknown_space: bool = Field(
        True,
        description='what neither map nor scan knows is unknown; false: free, which is '
        'the default of a rolling window and of upstream',
    )
    lethal_cost_threshold: int = Field(100, ge=1, le=100, description='occupancy of a wall')
    trinary_costmap: bool = Field(True, description='occupancy below the threshold is free')
    unknown_cost_value: Literal[-1] = -1
    use_maximum: Literal[False] = False
    first_map_only: bool = Field(False, description='accepted: only the first map is used')
    subscribe_to_updates: Literal[False] = False
    combination_method: Literal[1] = Field(1, description='the higher of map and obstacle counts')
    max_obstacle_height: float = Field(2.0, description='accepted: a scan has one height [m]')
    observation_sources: str = Field('scan', description="upstream's default is none")
    scan: ScanSource = ScanSource()
    obstacle_range: float = Field(2.5, gt=0, description='farthest hit that is marked [m]')
    raytrace_range: float = Field(3.0, gt=0, description='how far rays clear [m]')
    footprint_clearing_enabled: bool = Field(True, description='free where the robot stands')
    inflation_radius: float = Field(0.55, ge=0, le=10, description='[m]')
    cost_scaling_factor: float = Field(10.0, ge=0, description='decay of the cost [1/m]')
    inflate_unknown: Literal[False] = False
    footprint: FootprintPolygon = ALTO_FOOTPRINT
    footprint_padding: float = Field(0.01, ge=0, description='added on all sides [m]')

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
    """The usual local costmap: 3 x 3 m, rolling, in the odom frame."""
    return CostmapParams.from_mapping(
        {'static_map': False, 'rolling_window': True, 'global_frame': 'odom', **changes}, ''
    )
