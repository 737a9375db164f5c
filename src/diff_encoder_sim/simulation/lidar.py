"""A planar laser scanner: exact rays against the world's primitives.

The scan plane cuts each solid into segments (boxes) and circles (cylinders, spheres); a ray is then a line against
those, in closed form, so there is no grid and no step length.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from pydantic import Field, model_validator
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.robots.solids import Box, Cylinder, Sphere
from diff_encoder_sim.simulation.world import World

# Below this a solid's axis counts as upright: world files are written with six decimals.
UPRIGHT_TOLERANCE = 1e-5

TURN_RAD = 2.0 * math.pi
CORNER = 1e-9  # of a segment's length


class LidarParams(Params):
    """Parameters of the LiDAR; the defaults are the paper's table 2, while navigating."""

    samples: Annotated[int, Between(1, 100_000)] = Field(1000, description='rays of a scan')
    angle_min: Annotated[float, Between(-TURN_RAD, TURN_RAD, 'rad')] = Field(
        -math.pi, description='bearing of the first ray [rad]'
    )
    angle_span: Annotated[float, Between(1e-6, TURN_RAD, 'rad')] = Field(
        2 * math.pi, description='from the first ray to where the next scan would begin [rad]'
    )
    range_min: Annotated[float, Between(0.0, 1e4, 'm')] = Field(0.15, description='shortest range [m]')
    range_max: Annotated[float, Between(1e-3, 1e4, 'm')] = Field(6.0, description='longest range [m]')
    noise: Annotated[float, Between(0.0, 1000.0, 'm')] = Field(0.03, description='standard deviation of a range [m]')
    rate: Annotated[float, Between(0.01, 100.0, 'Hz')] = Field(10.0, description='scans per second [Hz]')

    @model_validator(mode='after')
    def _check_ranges(self) -> LidarParams:
        if self.range_min >= self.range_max:
            raise ValueError('range_min below range_max')
        return self

    @property
    def period_ns(self) -> int:
        """Time from scan to scan."""
        return round(NANOSECONDS_PER_SECOND / self.rate)


class Lidar:
    """Scans a static world; all rays of a scan are taken at one instant."""

    def __init__(self, world: World, scan_height_m: float, params: LidarParams, rng: np.random.Generator) -> None:
        self.params = params
        self._rng = rng
        self._segments, self._circles = cut_world(world, scan_height_m)
        self._increment_rad = params.angle_span / params.samples
        self._bearings_rad = params.angle_min + self._increment_rad * np.arange(params.samples)

    def scan(self, stamp_ns: int, laser_pose_in_world: Pose2D) -> Scan:
        """Take a scan; +inf where nothing returns from within range_max (REP-117).

        Noise is added to the ranges that return. One below range_min is then reported as -inf: too close to measure.
        """
        ranges_m, params = self.true_ranges_m(laser_pose_in_world), self.params
        # Drawn for every ray, so that one ray's hit or miss does not shift the others' noise.
        _measure(ranges_m, self._rng.standard_normal(len(ranges_m)), params.noise, params.range_min, params.range_max)
        return Scan(stamp_ns, params.angle_min, self._increment_rad, params.range_min, params.range_max, ranges_m)

    def true_ranges_m(self, laser_pose_in_world: Pose2D) -> np.ndarray:
        """Return (samples,) distance to the nearest surface along each ray; +inf if there is none."""
        x_m, y_m, yaw_rad = laser_pose_in_world
        return np.asarray(cast_rays(x_m, y_m, yaw_rad + self._bearings_rad, self._segments, self._circles))


def cut_world(world: World, height_m: float) -> Tuple[np.ndarray, np.ndarray]:
    """Cut the world with a horizontal plane at `height_m`.

    Returns:
        (n, 4) segments x0, y0, x1, y1 [m] and (m, 3) circles x, y, radius [m].
    """
    segments, circles = [np.empty((0, 4))], [np.empty((0, 3))]
    for solid in world.solids:
        shape, pose = solid.shape, solid.pose_in_world
        above_m, (x_m, y_m) = height_m - float(pose[2, 3]), pose[:2, 3].tolist()
        if isinstance(shape, Sphere):
            if abs(above_m) < shape.radius_m:
                circles.append(np.array([[x_m, y_m, math.sqrt(shape.radius_m**2 - above_m**2)]]))
        elif isinstance(shape, (Box, Cylinder)):
            if abs(pose[2, 2]) < 1.0 - UPRIGHT_TOLERANCE:
                raise ConfigError(f'{solid.name}: leans; allowed: upright boxes and cylinders')
            if abs(above_m) >= 0.5 * (shape.length_m if isinstance(shape, Cylinder) else shape.size_xyz_m[2]):
                continue
            if isinstance(shape, Cylinder):
                circles.append(np.array([[x_m, y_m, shape.radius_m]]))
            else:
                signs = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
                corners = (0.5 * signs * shape.size_xyz_m[:2]) @ pose[:2, :2].T + pose[:2, 3]
                segments.append(np.hstack([corners, np.roll(corners, -1, axis=0)]))
    return np.concatenate(segments), np.concatenate(circles)


@compiled
def _measure(ranges_m: np.ndarray, normals: np.ndarray, noise_m: float, range_min_m: float, range_max_m: float) -> None:
    """Turn true ranges (n,) into measured ones, in place."""
    for ray in range(len(ranges_m)):
        if ranges_m[ray] > range_max_m:
            ranges_m[ray] = np.inf
            continue
        ranges_m[ray] += noise_m * normals[ray]
        if ranges_m[ray] < range_min_m:
            ranges_m[ray] = -np.inf
        elif ranges_m[ray] > range_max_m:
            ranges_m[ray] = np.inf


@compiled
def cast_rays(x_m: float, y_m: float, bearings_rad: Array, segments: Array, circles: Array) -> np.ndarray:
    """Return (n,) distance [m] from a point along each bearing to the nearest segment or circle.

    Bearings (n,) ascend by a constant step over not more than a full circle. Segments (k, 4) are x0, y0, x1, y1 [m],
    circles (m, 3) x, y, radius [m]. Each surface is intersected only with the rays within the angle under which it is
    seen, not each ray with each surface.
    """
    ranges_m = np.full(len(bearings_rad), np.inf)
    step_rad = bearings_rad[1] - bearings_rad[0] if len(bearings_rad) > 1 else TURN_RAD
    cosines, sines = np.empty_like(bearings_rad), np.empty_like(bearings_rad)
    for ray in range(len(bearings_rad)):  # in one loop the compiler computes both at once, in two thirds of the time
        cosines[ray], sines[ray] = math.cos(bearings_rad[ray]), math.sin(bearings_rad[ray])
    for k in range(len(segments)):
        ax, ay = segments[k, 0] - x_m, segments[k, 1] - y_m
        bx, by = segments[k, 2] - x_m, segments[k, 3] - y_m
        seen_rad = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
        left_rad = math.atan2(ay, ax) + min(seen_rad, 0.0) - bearings_rad[0]
        for lap in range(2):
            first, last = _rays_within(left_rad, abs(seen_rad), lap, step_rad, len(ranges_m))
            for ray in range(first, last + 1):
                across = cosines[ray] * (by - ay) - sines[ray] * (bx - ax)
                if across == 0.0:
                    continue  # along the wall, whose ends belong to its neighbours too
                distance_m = (ax * (by - ay) - ay * (bx - ax)) / across
                fraction = (ax * sines[ray] - ay * cosines[ray]) / across
                # Corners where two walls meet must not let a ray through.
                if -CORNER <= fraction <= 1.0 + CORNER and 0.0 <= distance_m < ranges_m[ray]:
                    ranges_m[ray] = distance_m
    for k in range(len(circles)):
        cx, cy, radius_m = circles[k, 0] - x_m, circles[k, 1] - y_m, circles[k, 2]
        away_m, outside = math.hypot(cx, cy), cx * cx + cy * cy - radius_m * radius_m
        half_rad = math.asin(radius_m / away_m) if away_m > radius_m else math.pi
        left_rad = math.atan2(cy, cx) - half_rad - bearings_rad[0]
        for lap in range(2):
            first, last = _rays_within(left_rad, 2.0 * half_rad, lap, step_rad, len(ranges_m))
            for ray in range(first, last + 1):
                along = cx * cosines[ray] + cy * sines[ray]
                root = along * along - outside
                if root >= 0.0:
                    distance_m = along - math.sqrt(root) if outside > 0.0 else along + math.sqrt(root)
                    if 0.0 <= distance_m < ranges_m[ray]:
                        ranges_m[ray] = distance_m
    return ranges_m


@compiled
def _rays_within(left_rad: float, width_rad: float, lap: int, step_rad: float, count: int) -> Tuple[int, int]:
    """Return the first and last ray in an angle that begins `left_rad` after the first bearing.

    An angle that runs past the full circle comes in two laps. One ray more on either side makes up for rounding; the
    caller checks whether a ray meets the surface.
    """
    begin_rad = left_rad % TURN_RAD - lap * TURN_RAD
    first = max(0, int(math.floor(begin_rad / step_rad)))
    last = min(count - 1, int(math.ceil((begin_rad + width_rad) / step_rad)))
    return first, last
