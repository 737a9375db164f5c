"""Grid SLAM by a Rao-Blackwellised particle filter: each particle is a path of the robot with the map along it.

Grisetti, Stachniss and Burgard, "Improved Techniques for Grid Mapping with Rao-Blackwellized Particle Filters", IEEE
Transactions on Robotics 23 (2007), algorithm 1; parameters and output are slam_gmapping's.
"""

from __future__ import annotations

import logging
import math
from bisect import bisect_left
from typing import Iterable, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from numpy.random import Generator

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.kernels import Array
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, interpolate, wrap_angles
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.localization.occupancy_grid import UNKNOWN, OccupancyGrid, occupancy
from diff_encoder_sim.localization.particles import check_pose, effective_count
from diff_encoder_sim.localization.patches import PatchMaps, Rays, usable_rays
from diff_encoder_sim.localization.slam_kernels import Search, propose_poses
from diff_encoder_sim.localization.slam_params import SIDE, GridSlamParams

log = logging.getLogger(__name__)

MATCH_MARGIN_M = 1.0  # beyond the range of the rays, for the search of scan matching
ACROSS_FRACTION = 0.3  # of the noise ahead, across: upstream's
LEAST_SIGMAS = np.array([0.001, 0.001, 0.0005])  # of odometry [m, m, rad]


class SlamEstimate(NamedTuple):
    """The best particle's pose after a scan was added to the maps, and the filter's state."""

    stamp_ns: int  # the scan's
    base_pose_in_map: Pose2D
    odom_pose_in_map: Pose2D  # the transform map->odom that corresponds to base_pose_in_map
    entropy: float  # of the weights before resampling [nat]
    effective_count: float  # effective sample size before resampling
    has_resampled: bool


class GridSlam:
    """The mapper; pass every scan with the odometry pose at its stamp.

    The map frame is odom's at the first scan, unless a start is given. Equal seeds and inputs give equal bits.
    """

    def __init__(
        self, params: GridSlamParams, rng: np.random.Generator, start_pose_in_map: Optional[Pose2D] = None
    ) -> None:
        """Start with empty maps; `start_pose_in_map` is the base's pose at the first scan, if known."""
        self.params, self._start_pose, self._rng = params, start_pose_in_map, rng
        corners = (params.xmin, params.ymin), (params.xmax, params.ymax)
        self.maps = PatchMaps(*corners, params.delta, params.particles)
        self.particles = np.empty((0, 3))  # base poses in the map, x [m], y [m], yaw [rad]; empty before the first scan
        self._log_weights = np.zeros(params.particles)
        self._log_path_weights = np.zeros(params.particles)  # over the whole path; not reset by resampling
        self._trend = np.zeros(3)  # of the scans' offsets from odometry
        self.last_estimate: Optional[SlamEstimate] = None  # the newest; None before the first scan
        self._odom_pose: Optional[Pose2D] = None  # at the last added scan
        self._entered_ns = 0  # stamp of that scan
        self._newest_ns: Optional[int] = None  # stamp of the newest scan, added or not

    @property
    def odom_pose_in_map(self) -> Optional[Pose2D]:
        """The transform map->odom to broadcast, None before the first scan."""
        return self.last_estimate.odom_pose_in_map if self.last_estimate else None

    def map(self) -> OccupancyGrid:
        """Return the best particle's map, 0, 100 or -1, of xmin to xmax, ymin to ymax and observed patches beyond."""
        rows, columns = self.maps.table.shape[1:]
        cells = np.full((rows * SIDE, columns * SIDE), UNKNOWN, np.int8)
        hits, visits, row, column = self.maps.counts(int(np.argmax(self._log_path_weights)))
        seen = occupancy(hits, visits, self.params.occ_thresh)
        cells[row : row + hits.shape[0], column : column + hits.shape[1]] = seen
        x_m, y_m = self.maps.corner_m.tolist()
        return OccupancyGrid(cells, self.params.delta, Pose2D(x_m, y_m, 0.0))

    def update(self, odom_pose: Pose2D, scan: Scan, laser_pose_in_base: Pose2D) -> Optional[SlamEstimate]:
        """Process a scan; return an estimate if it was added to the map, else None.

        The first scan is added, and each after a motion or time (linearUpdate, angularUpdate, temporalUpdate); upstream
        sums odometry's increments, which grow with its jitter. `odom_pose` is the base in odom at the scan's stamp.
        Raises InputFault, without effect, if the scan, pose or mount cannot be used, or time went back; the laser may
        not be upside-down.
        """
        check_pose(odom_pose, 'odometry pose')
        check_pose(laser_pose_in_base, 'laser pose')
        rays = usable_rays(scan, laser_pose_in_base, self.params)
        if self._newest_ns is not None and scan.stamp_ns < self._newest_ns:
            now_s, newest_s = scan.stamp_ns / NANOSECONDS_PER_SECOND, self._newest_ns / NANOSECONDS_PER_SECOND
            raise InputFault(
                f'stamp of {now_s:.3f} s after one of {newest_s:.3f} s: time went back; the map so far is kept'
            )
        self._newest_ns = scan.stamp_ns
        if self._odom_pose is None:
            return self._begin(odom_pose, scan.stamp_ns, rays)
        params, move = self.params, odom_pose.relative_to(self._odom_pose)
        waited_s = (scan.stamp_ns - self._entered_ns) / NANOSECONDS_PER_SECOND
        is_near = math.hypot(move.x_m, move.y_m) < params.linearUpdate and abs(move.yaw_rad) < params.angularUpdate
        if is_near and not 0.0 <= params.temporalUpdate < waited_s:
            return None
        # Algorithm 1 up to the resampling, with its line numbers.
        self._cover(apply_moves(self.particles, np.array(move)), rays)
        proposed = propose(self.maps, self.particles, move, rays, params, self._rng, self._trend)
        self.particles, log_factors, _, self._trend = proposed  # 4 to 23
        self._log_weights = self._log_weights + log_factors  # 24
        self._log_path_weights = self._log_path_weights + log_factors
        self._update_maps(rays)  # 26
        return self._finish(odom_pose, scan.stamp_ns, may_resample=True)

    def _begin(self, odom_pose: Pose2D, stamp_ns: int, rays: Rays) -> SlamEstimate:
        start_pose = odom_pose if self._start_pose is None else self._start_pose
        self.particles = np.tile(np.array(start_pose), (self.params.particles, 1))
        self._update_maps(rays)
        self.maps.resample(np.zeros(self.params.particles, int))  # the maps are equal: they share patches
        return self._finish(odom_pose, stamp_ns, may_resample=False)

    def _finish(self, odom_pose: Pose2D, stamp_ns: int, may_resample: bool) -> SlamEstimate:
        """Record the step, and resample when few particles count (lines 29 to 32)."""
        self._odom_pose, self._entered_ns = odom_pose, stamp_ns
        weights = normalised(self._log_weights)
        count = effective_count(weights)
        is_due = may_resample and count < self.params.resampleThreshold * len(weights)
        kept = systematic_indices(weights, self._rng) if is_due else np.arange(len(weights))
        # Of the resampled particles: the previous best path may have become unlikely.
        best = kept[np.argmax(self._log_path_weights[kept])]
        base_pose = Pose2D(*self.particles[best].tolist())
        odom_pose_in_map = base_pose.compose(odom_pose.inverse())
        self.last_estimate = SlamEstimate(stamp_ns, base_pose, odom_pose_in_map, entropy_of(weights), count, is_due)
        if is_due:
            self.particles, self._log_weights = self.particles[kept], np.zeros(len(kept))
            self._log_path_weights = self._log_path_weights[kept]
            self.maps.resample(kept)
        return self.last_estimate

    def _update_maps(self, rays: Rays) -> None:
        self._cover(self.particles, rays)
        self.maps.update(self.particles, rays)

    def _cover(self, particles: np.ndarray, rays: Rays) -> None:
        """Enlarge the maps to the reach of all rays from the particles."""
        reach_m = rays.reach_m() + MATCH_MARGIN_M
        self.maps.cover(particles[:, :2].min(axis=0) - reach_m, particles[:, :2].max(axis=0) + reach_m)


def propose(
    maps: PatchMaps, particles: Array, move: Pose2D, rays: Rays, params: GridSlamParams, rng: Generator, trend: Array
) -> Tuple[Array, Array, Array, Array]:
    """Move the particles by odometry's `move` (in the base frame) and a scan: the improved proposal, section III-B.

    Each particle climbs from its odometry pose to the best match (algorithm 1, line 7), then moves to the maximum of
    likelihood times motion model. The Gaussian around it (lines 12 to 21), in closed form, is sampled; the weight is
    its integral (lines 22 to 24). Other than in the paper, a particle follows only as far as the scan contradicts
    odometry: see `scan_share`. If the best match does not score more than minimumScore, the motion model is sampled,
    and the weight is the likelihood there (lines 8 to 10).

    The maps must cover the reach of the rays; `trend` (3,) is the running mean of the scans' offsets from odometry, in
    standard deviations, zeros at first; `rng` is sampled 3 n times for any move, so that equal seeds stay in step.
    Returns poses (n, 3), increments of the log-weights (n,), scores of the best matches (n,) and the new trend (3,).
    """
    sigmas, cell_m, normals = move_sigmas(move, params), maps.cell_m, rng.standard_normal(particles.shape)
    # Into cells from the maps' corner, and back again.
    scale, corner = np.array([1.0 / cell_m, 1.0 / cell_m, 1.0]), np.append(maps.corner_m, 0.0)
    expected = (apply_moves(particles, np.array(move)) - corner) * scale
    fallback = (apply_moves(particles, np.array(move) + sigmas * normals) - corner) * scale
    ends, grids = rays.matched_ends_m() / cell_m, (maps.table, maps.cells)
    poses = propose_poses(*grids, expected, fallback, normals, ends, search_of(params, cell_m), sigmas * scale, trend)
    drawn, log_factors, scores, trends = poses
    drawn = drawn / scale + corner
    drawn[:, 2] = wrap_angles(drawn[:, 2])
    return drawn, log_factors, scores, trends.mean(axis=0)


def move_sigmas(move: Pose2D, params: GridSlamParams) -> np.ndarray:
    """Return (3,) standard deviations [m, m, rad] of a move, in the frame of the base before it."""
    ahead_m, across_m, turn_rad = abs(move.x_m), abs(move.y_m), abs(move.yaw_rad)
    by_turn_m, across_noise = params.str_ * turn_rad, ACROSS_FRACTION * params.srr
    sigma_x_m = params.srr * ahead_m + across_noise * across_m + by_turn_m
    sigma_y_m = params.srr * across_m + across_noise * ahead_m + by_turn_m
    sigma_rad = params.stt * turn_rad + params.srt * math.hypot(ahead_m, across_m)
    return np.asarray(np.maximum([sigma_x_m, sigma_y_m, sigma_rad], LEAST_SIGMAS))


def apply_moves(particles: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Return (n, 3) poses after each particle's own move, (n, 3) or (3,) in its base frame."""
    (x, y, yaw), (ahead, left, turn) = particles.T, np.broadcast_to(moves, particles.shape).T
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.column_stack([x + cos * ahead - sin * left, y + sin * ahead + cos * left, wrap_angles(yaw + turn)])


def normalised(log_weights: np.ndarray) -> np.ndarray:
    """Return (n,) weights of sum 1 from their logarithms up to a constant."""
    weights = np.exp(log_weights - log_weights.max())
    return np.asarray(weights / weights.sum())


def entropy_of(weights: np.ndarray) -> float:
    """Return the weights' entropy [nat]: 0 if one particle has all weight, at most log n."""
    positive = weights[weights > 0.0]
    return float(-(positive * np.log(positive)).sum())


def systematic_indices(weights: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Draw (n,) particles to keep, ascending, each n times its weight times, plus or minus one."""
    count = len(weights)
    marks = (rng.random() + np.arange(count)) / count
    return np.minimum(np.searchsorted(np.cumsum(weights), marks, side='right'), count - 1)


def search_of(params: GridSlamParams, cell_m: float) -> Search:
    """Return how scans are matched on maps with cells of this side."""
    scales = -(cell_m**2) / params.sigma, -(cell_m**2) / params.lsigma / params.ogain
    steps = params.lstep / cell_m, params.astep
    return Search(params.kernelSize, *scales, *steps, params.iterations, params.minimumScore)


def map_recording(slam: GridSlam, odometry: OdometryTrack, scans: Iterable[Scan], laser_pose_in_base: Pose2D) -> int:
    """Process each throttle_scans-th scan of a recording; return the number of scans that were added to the map.

    Scans outside of odometry's time span, older than the previous one, or invalid are dropped with a warning; raises
    ConfigError without odometry or a usable scan.
    """
    if not odometry.stamps_ns:
        raise ConfigError('no odometry for the scans; allowed: a recording of both')
    given = entered = 0
    for given, scan in enumerate(scans, 1):
        if (given - 1) % slam.params.throttle_scans:
            continue
        try:
            entered += slam.update(odometry.at(scan.stamp_ns), scan, laser_pose_in_base) is not None
        except InputFault as fault:
            log.warning('scan at %.3f s dropped: %s', scan.stamp_ns / NANOSECONDS_PER_SECOND, fault)
    if not given:
        raise ConfigError('no scans for the odometry; allowed: a recording of both')
    if slam.last_estimate is None:
        raise ConfigError(f'none of {given} scans could be used: see the warnings')
    return entered


class OdometryTrack:
    """Odometry poses by time."""

    def __init__(self, stamps_ns: Sequence[int], base_poses_in_odom: Sequence[Pose2D]) -> None:
        """Store poses in recorded order, up to a jump back in time, which logs a warning."""
        backward = (index for index in range(1, len(stamps_ns)) if stamps_ns[index] < stamps_ns[index - 1])
        end = next(backward, len(stamps_ns))
        if end < len(stamps_ns):
            back_s = stamps_ns[end] / NANOSECONDS_PER_SECOND
            log.warning('odometry stamps go back to %.3f s: only the drive before that is mapped', back_s)
        self.stamps_ns, self._poses = list(stamps_ns[:end]), list(base_poses_in_odom[:end])

    def at(self, stamp_ns: int) -> Pose2D:
        """Return the interpolated pose at a time; raise InputFault before the first pose and after the last."""
        after = bisect_left(self.stamps_ns, stamp_ns)
        if after < len(self.stamps_ns) and self.stamps_ns[after] == stamp_ns:
            return self._poses[after]
        if not 0 < after < len(self.stamps_ns):
            raise InputFault('no odometry at its stamp')
        start_ns, end_ns = self.stamps_ns[after - 1], self.stamps_ns[after]
        return interpolate(self._poses[after - 1], self._poses[after], (stamp_ns - start_ns) / (end_ns - start_ns))


def warm_up(params: GridSlamParams) -> None:
    """Map a small room: takes tenths of a second with numba's cache, else seconds."""
    few = params.model_copy(update={'particles': 2, 'linearUpdate': 0.0})
    slam, scan = GridSlam(few, np.random.default_rng(0)), Scan(0, -math.pi, math.pi / 30.0, 0.1, 10.0, np.full(60, 2.0))
    for stamp_ns in range(2):
        slam.update(IDENTITY, scan._replace(stamp_ns=stamp_ns), IDENTITY)
