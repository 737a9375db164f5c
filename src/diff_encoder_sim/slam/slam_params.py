"""Parameters of grid SLAM under slam_gmapping's names and with its defaults (Noetic)."""

from __future__ import annotations

from pydantic import Field, model_validator
from typing_extensions import Annotated

from diff_encoder_sim.base.typed_params import Params
from diff_encoder_sim.slam.patches import MOST_ENTRIES, Extent, table_size

Noise = Annotated[float, Field(ge=0)]
FrameId = Annotated[str, Field(min_length=1)]


class GridSlamParams(Params):
    """All of slam_gmapping's parameters, so that its files load; the node uses those at the end.

    `sigma` and `lsigma` are, as upstream's code has it, what a squared distance [m^2] is divided by
    in an exponent: twice a variance, not a standard deviation.
    """

    # The laser. 0 stands for upstream's default: the scan's own range_max less 1 cm.
    maxRange: float = Field(0.0, ge=0, description='longer ranges are ignored [m]; 0: range_max of the scan less 1 cm')
    maxUrange: float = Field(0.0, ge=0, description='rays are cut here; what they pass is free [m]; 0: maxRange')

    # Scan matching.
    sigma: float = Field(
        0.05, gt=0, description='divides a squared distance in the score of a scan match: twice a variance [m^2]'
    )
    kernelSize: int = Field(1, ge=0, le=10, description='cells in each direction in which a match is searched')
    lstep: float = Field(0.05, gt=0, description='first step of the match along x and y [m]')
    astep: float = Field(0.05, gt=0, description='first step of the match in yaw [rad]')
    iterations: int = Field(5, ge=0, le=30, description='how often the steps are halved')
    lsigma: float = Field(0.075, gt=0, description='as sigma, in the likelihood of a ray [m^2]')
    ogain: float = Field(
        3.0,
        gt=0,
        description='divides the log-likelihood of a scan; upstream divides it by the number of particles too',
    )
    lskip: int = Field(0, ge=0, description='rays left out between two that are matched')
    minimumScore: float = Field(
        0.0, ge=0, description='lowest score of a match that is used; below it odometry alone counts'
    )

    # Proposal: poses tried about the best match.
    llsamplerange: float = Field(
        0.01, ge=0, description='poses about the match that are tried: range along x and y, each way [m]'
    )
    llsamplestep: float = Field(0.01, gt=0, description='step along x and y [m]')
    lasamplerange: float = Field(0.005, ge=0, description='range in yaw, each way [rad]')
    lasamplestep: float = Field(0.005, gt=0, description='step in yaw [rad]')

    # Odometry's noise: standard deviation per metre driven or radian turned.
    srr: Noise = Field(0.1, description='odometry noise, standard deviation: position per metre driven [m/m]')
    srt: Noise = Field(0.2, description='odometry noise: yaw per metre driven [rad/m]')
    str_: Noise = Field(0.1, alias='str', description='odometry noise: position per radian turned [m/rad]')
    stt: Noise = Field(0.2, description='odometry noise: yaw per radian turned [rad/rad]')

    # When a scan counts: any of the three.
    linearUpdate: float = Field(
        1.0, ge=0, description='displacement from the last scan taken after which the next is taken [m]'
    )
    angularUpdate: float = Field(0.5, ge=0, description='turn after which the next is taken [rad]')
    temporalUpdate: float = Field(-1.0, description='time after which the next is taken [s]; below 0: never')

    particles: int = Field(30, ge=1, le=10_000, description='number of particles, each with a map')
    resampleThreshold: float = Field(
        0.5, ge=0, le=1, description='fraction of effective particles below which they are resampled'
    )

    # The map; it grows when the robot sees beyond it.
    xmin: float = Field(-100.0, description='first extent of the map, which grows [m]')
    ymin: float = Field(-100.0, description='first extent of the map [m]')
    xmax: float = Field(100.0, description='first extent of the map [m]')
    ymax: float = Field(100.0, description='first extent of the map [m]')
    delta: float = Field(0.05, gt=0, description='side of a cell [m]')
    occ_thresh: float = Field(
        0.25, ge=0, le=1, description='fraction of the rays into a cell that end there, above which it is occupied'
    )

    # What only the node uses.
    throttle_scans: int = Field(1, ge=1, description='take one scan of so many')
    map_update_interval: float = Field(5.0, ge=0, description='time between two published maps [s]')
    transform_publish_period: float = Field(0.05, ge=0, description='time between two transforms [s]; 0: no transform')
    tf_delay: float = Field(
        -1.0, description='time by which map -> odom is post-dated [s]; below 0: transform_publish_period'
    )
    base_frame: FrameId = Field('base_link', description='frame of the robot')
    map_frame: FrameId = Field('map', description='frame of the map')
    odom_frame: FrameId = Field('odom', description='frame of the odometry')

    @model_validator(mode='after')
    def _check_extent(self) -> GridSlamParams:
        if self.xmin >= self.xmax or self.ymin >= self.ymax:
            raise ValueError('xmin below xmax and ymin below ymax')
        extent = Extent(self.xmin, self.ymin, self.xmax, self.ymax)
        if table_size(extent, self.delta, self.particles) > MOST_ENTRIES:
            raise ValueError('a smaller extent (xmin, ymin, xmax, ymax), larger cells (delta) or fewer particles')
        return self
