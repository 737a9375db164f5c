"""Parameters of a costmap, under costmap_2d's names (its flat form, without plugins)."""
from __future__ import annotations

from pydantic import Field, model_validator

from diff_encoder_sim.config import Params
from diff_encoder_sim.navigation.footprint import ALTO_FOOTPRINT, FootprintPolygon


class ScanSource(Params):
    """One entry of `observation_sources`: a laser that marks and clears."""

    topic: str = 'scan'
    data_type: str = 'LaserScan'
    sensor_frame: str = ''
    marking: bool = True
    clearing: bool = Field(True, description="upstream's default is false: nothing is ever cleared")
    inf_is_valid: bool = Field(
        True, description='+inf, no return (REP 117), clears; upstream\'s default is false')
    expected_update_rate: float = Field(0.0, ge=0, description='[s]')
    observation_persistence: float = Field(0.0, ge=0, description='accepted: one scan at a time')
    min_obstacle_height: float = 0.0
    max_obstacle_height: float = 2.0


class CostmapParams(Params):
    """Parameters of the global or the local costmap."""

    global_frame: str = Field('map', min_length=1)
    robot_base_frame: str = Field('base_link', min_length=1)
    map_type: str = 'costmap'
    static_map: bool = Field(True, description='the size and the walls are the map\'s')
    rolling_window: bool = Field(False, description='a window that moves with the robot')
    width: float = Field(3.0, gt=0, le=200, description='of a rolling window [m]')
    height: float = Field(3.0, gt=0, le=200, description='of a rolling window [m]')
    resolution: float = Field(0.05, gt=0, le=1, description='of a rolling window: a cell [m]')
    update_frequency: float = Field(5.0, gt=0, description='[Hz]')
    publish_frequency: float = Field(0.0, ge=0, description='[Hz]; 0: not published')
    transform_tolerance: float = Field(0.3, ge=0, description='[s]')
    track_unknown_space: bool = Field(
        True, description='what the map does not know stays unknown; false: it counts as free')
    lethal_cost_threshold: int = Field(100, ge=1, le=100, description='occupancy of a wall')
    trinary_costmap: bool = Field(True, description='occupancy below the threshold is free')
    observation_sources: str = 'scan'
    scan: ScanSource = ScanSource()
    obstacle_range: float = Field(2.5, gt=0, description='farthest hit that is marked [m]')
    raytrace_range: float = Field(3.0, gt=0, description='how far rays clear [m]')
    footprint_clearing_enabled: bool = Field(True, description='free where the robot stands')
    inflation_radius: float = Field(0.55, ge=0, le=10, description='[m]')
    cost_scaling_factor: float = Field(10.0, ge=0, description='decay of the cost [1/m]')
    footprint: FootprintPolygon = ALTO_FOOTPRINT
    footprint_padding: float = Field(0.01, ge=0, description='added on all sides [m]')

    @model_validator(mode='after')
    def _check_kind(self) -> CostmapParams:
        if self.static_map == self.rolling_window:
            raise ValueError('either static_map or rolling_window')
        if self.observation_sources not in ('', 'scan'):
            raise ValueError("observation_sources: 'scan', or empty")
        return self


def local_defaults(**changes: object) -> CostmapParams:
    """The usual local costmap: 3 x 3 m, rolling, in the odom frame."""
    return CostmapParams.from_mapping(
        {'static_map': False, 'rolling_window': True, 'global_frame': 'odom', **changes}, '')

