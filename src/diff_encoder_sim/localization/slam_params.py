"""Parameters of grid SLAM under slam_gmapping's names and with its defaults (Noetic)."""

from __future__ import annotations

import math

from pydantic import Field, model_validator
from typing_extensions import Annotated

from diff_encoder_sim.base import bounds
from diff_encoder_sim.base.bounds import Between, Distance_m, Fraction, Place_m
from diff_encoder_sim.base.params import Params, param

SIDE = 32  # cells along a patch of a map; a power of two

MOST_ENTRIES = 25_000_000  # patches of all particles' maps: tables of 100 MB, and 1.4 km either way for 30 particles
FrameId = Annotated[str, Field(min_length=1)]


class GridSlamParams(Params):
    """All of slam_gmapping's parameters, so that its files load; the node uses those at the end."""

    # The laser. 0 stands for upstream's default: the scan's own range_max less 1 cm.
    maxRange: Distance_m = param(0.0, 'longer ranges are ignored [m]; 0: range_max of the scan less 1 cm')
    maxUrange: Distance_m = param(0.0, 'longer rays are cut at this range; cells up to it are free [m]; 0: maxRange')
    # Scan matching.
    sigma: Annotated[float, Between(1e-6, 1e6, 'm^2')] = param(0.05, 'twice a variance, of a match [m^2]')
    kernelSize: Annotated[int, Between(0, 10)] = param(1, 'cells in each direction in which a match is searched')
    lstep: Annotated[float, Between(1e-6, 100.0, 'm')] = param(0.05, 'first step of the match along x and y [m]')
    astep: Annotated[float, Between(1e-6, 100.0, 'rad')] = param(0.05, 'first step of the match in yaw [rad]')
    iterations: Annotated[int, Between(0, 30)] = param(5, 'how often the steps are halved')
    lsigma: Annotated[float, Between(1e-6, 1e6, 'm^2')] = param(0.075, 'as sigma, in the likelihood of a ray [m^2]')
    ogain: bounds.PositiveWeight = param(3.0, 'divides the log-likelihood of a scan')
    lskip: Annotated[int, Between(0, 1_000_000)] = param(0, 'rays left out between two that are matched')
    minimumScore: bounds.Weight = param(0.0, 'lowest score of a match that is used; below it only odometry counts')
    # Of slam_gmapping's files, and without effect: the proposal's Gaussian is in closed form here.
    llsamplerange: Annotated[float, Between(0.0, 100.0, 'm')] = param(0.01, 'no effect; slam_gmapping reads it [m]')
    llsamplestep: Annotated[float, Between(1e-6, 100.0, 'm')] = param(0.01, 'no effect [m]')
    lasamplerange: Annotated[float, Between(0.0, 100.0, 'rad')] = param(0.005, 'no effect [rad]')
    lasamplestep: Annotated[float, Between(1e-6, 100.0, 'rad')] = param(0.005, 'no effect [rad]')
    # Odometry's noise: standard deviation per metre driven or radian turned.
    srr: Annotated[float, Between(0.0, 100.0, 'm/m')] = param(0.1, 'odometry noise: position per metre driven [m/m]')
    srt: Annotated[float, Between(0.0, 100.0, 'rad/m')] = param(0.2, 'odometry noise: yaw per metre driven [rad/m]')
    str_: Annotated[float, Between(0.0, 100.0, 'm/rad')] = Field(
        0.1, alias='str', description='odometry noise: position per radian turned [m/rad]'
    )
    stt: Annotated[float, Between(0.0, 100.0, 'rad/rad')] = param(0.2, 'odometry noise: yaw per turn [rad/rad]')
    # When a scan counts: any of the three.
    linearUpdate: Distance_m = param(1.0, 'displacement from the last scan taken after which the next is taken [m]')
    angularUpdate: bounds.Turn_rad = param(0.5, 'turn after which the next is taken [rad]')
    temporalUpdate: bounds.SignedDuration_s = param(-1.0, 'time after which the next is taken [s]; below 0: never')

    particles: Annotated[int, Between(1, 10_000)] = param(30, 'number of particles, each with a map')
    resampleThreshold: Fraction = param(0.5, 'fraction of effective particles below which they are resampled')
    # The map; it grows when the robot sees beyond it.
    xmin: Place_m = param(-100.0, 'first extent of the map, which grows [m]')
    ymin: Place_m = param(-100.0, 'first extent of the map [m]')
    xmax: Place_m = param(100.0, 'first extent of the map [m]')
    ymax: Place_m = param(100.0, 'first extent of the map [m]')
    delta: bounds.CellSide_m = param(0.05, 'side of a cell [m]')
    occ_thresh: Fraction = param(0.25, 'fraction of the rays into a cell that end there, above which it is occupied')
    # What only the node uses.
    throttle_scans: bounds.Count = param(1, 'process every n-th scan')
    map_update_interval: bounds.Duration_s = param(5.0, 'time between two published maps [s]')
    transform_publish_period: bounds.Duration_s = param(0.05, 'time between two transforms [s]; 0: no transform')
    tf_delay: bounds.SignedDuration_s = param(-1.0, 'post-dates map -> odom [s]; below 0: as transform_publish_period')
    base_frame: FrameId = param('base_link', 'frame of the robot')
    map_frame: FrameId = param('map', 'frame of the map')
    odom_frame: FrameId = param('odom', 'frame of the odometry')

    @model_validator(mode='after')
    def _check_extent(self) -> GridSlamParams:
        if self.xmin >= self.xmax or self.ymin >= self.ymax:
            raise ValueError('xmin below xmax and ymin below ymax')
        sides_m = self.ymax - self.ymin, self.xmax - self.xmin
        if self.particles * math.prod(patches_along(side_m, self.delta) for side_m in sides_m) > MOST_ENTRIES:
            raise ValueError('a smaller extent (xmin, ymin, xmax, ymax), larger cells (delta) or fewer particles')
        return self


def patches_along(length_m: float, cell_m: float) -> int:
    """Return the number of patches that cover a length."""
    return max(1, math.ceil(length_m / (cell_m * SIDE) - 1e-9))
