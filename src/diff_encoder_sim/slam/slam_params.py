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
    maxRange: float = Field(0.0, ge=0, description='rays from here on say nothing [m]')
    maxUrange: float = Field(0.0, ge=0, description='rays are cut here, and up to it free [m]; 0: maxRange')

    # Scan matching.
    sigma: float = Field(0.05, gt=0, description='of the score that is climbed [m^2]')
    kernelSize: int = Field(1, ge=0, le=10, description='cells to look for a match in, each way')
    lstep: float = Field(0.05, gt=0, description='first step along x and y [m]')
    astep: float = Field(0.05, gt=0, description='first turn [rad]')
    iterations: int = Field(5, ge=0, le=30, description='times that the steps are halved')
    lsigma: float = Field(0.075, gt=0, description="of a ray's likelihood [m^2]")
    ogain: float = Field(
        3.0,
        gt=0,
        description='divides the log-likelihood of a scan; upstream divides it by the number of particles too',
    )
    lskip: int = Field(0, ge=0, description='rays left out between two that are matched')
    minimumScore: float = Field(0.0, ge=0, description='with less, odometry alone counts')

    # Proposal: poses tried about the best match.
    llsamplerange: float = Field(0.01, ge=0, description='along x and y, each way [m]')
    llsamplestep: float = Field(0.01, gt=0, description='[m]')
    lasamplerange: float = Field(0.005, ge=0, description='turned, each way [rad]')
    lasamplestep: float = Field(0.005, gt=0, description='[rad]')

    # Odometry's noise: standard deviation per metre driven or radian turned.
    srr: Noise = Field(0.1, description='of the place, per metre [m/m]')
    srt: Noise = Field(0.2, description='of the heading, per metre [rad/m]')
    str_: Noise = Field(0.1, alias='str', description='of the place, per radian [m/rad]')
    stt: Noise = Field(0.2, description='of the heading, per radian [rad/rad]')

    # When a scan counts: any of the three.
    linearUpdate: float = Field(1.0, ge=0, description='away from the last one [m]')
    angularUpdate: float = Field(0.5, ge=0, description='turned from the last one [rad]')
    temporalUpdate: float = Field(-1.0, description='after the last one [s]; below 0: never')

    particles: int = Field(30, ge=1, le=10_000)
    resampleThreshold: float = Field(
        0.5, ge=0, le=1, description='share of particles that count, below which they are redrawn'
    )

    # The map; it grows when the robot sees beyond it.
    xmin: float = -100.0  # [m]
    ymin: float = -100.0  # [m]
    xmax: float = 100.0  # [m]
    ymax: float = 100.0  # [m]
    delta: float = Field(0.05, gt=0, description='side of a cell [m]')
    occ_thresh: float = Field(
        0.25, ge=0, le=1, description='share of the rays into a cell that end there, above which it is occupied'
    )

    # What only the node uses.
    throttle_scans: int = Field(1, ge=1, description='every how manieth scan is taken')
    map_update_interval: float = Field(5.0, ge=0, description='between two maps [s]')
    transform_publish_period: float = Field(0.05, ge=0, description='[s]; 0: no transform')
    tf_delay: float = Field(-1.0, description='post-dates map->odom [s]; below 0: as long as transform_publish_period')
    base_frame: FrameId = 'base_link'
    map_frame: FrameId = 'map'
    odom_frame: FrameId = 'odom'

    @model_validator(mode='after')
    def _check_extent(self) -> GridSlamParams:
        if self.xmin >= self.xmax or self.ymin >= self.ymax:
            raise ValueError('xmin below xmax and ymin below ymax')
        extent = Extent(self.xmin, self.ymin, self.xmax, self.ymax)
        if table_size(extent, self.delta, self.particles) > MOST_ENTRIES:
            raise ValueError('a smaller extent (xmin, ymin, xmax, ymax), larger cells (delta) or fewer particles')
        return self
