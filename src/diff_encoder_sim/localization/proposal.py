"""The improved proposal: each particle's new pose is drawn by odometry and scan together.

Grisetti, Stachniss and Burgard, "Improved Techniques for Grid Mapping with Rao-Blackwellized
Particle Filters", IEEE T-RO 2007, section III-B and algorithm 1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D, wrap_angles
from diff_encoder_sim.localization.map_update import Rays
from diff_encoder_sim.localization.patches import PatchMaps
from diff_encoder_sim.localization.slam_kernels import Search, propose_poses
from diff_encoder_sim.localization.slam_params import GridSlamParams, apply_moves, move_sigmas


class Proposal(NamedTuple):
    """One step of all particles."""

    particles: np.ndarray  # (n, 3) base poses in the map, drawn
    log_factors: np.ndarray  # (n,) added to each particle's log-weight
    scores: np.ndarray  # (n,) of the best match, 0 to the number of matched rays
    trend: np.ndarray  # (3,) running mean of how far the scans are from odometry, in standard deviations


def propose(
    maps: PatchMaps,
    particles: np.ndarray,
    move: Pose2D,
    rays: Rays,
    params: GridSlamParams,
    rng: np.random.Generator,
    trend: np.ndarray,
) -> Proposal:
    """Move the particles by odometry's `move` (in the base frame) and a scan.

    Each particle starts at its odometry pose and climbs to the best match (algorithm 1, line 7), then moves to the
    maximum of likelihood times motion model. The Gaussian about it (lines 12 to 21), in closed form instead of sampled
    poses, is sampled from, and the weight is its integral (lines 22 to 24). Other than in the paper, the
    particle takes of the way from odometry's pose to the one drawn only the share by which the scan contradicts
    odometry: see `scan_share`. Where the best match scores not more than minimumScore, it draws from the
    motion model and is weighted by the likelihood there (lines 8 to 10).

    Args:
        maps: the particles' maps; they cover all that the rays reach.
        particles: (n, 3) base poses in the map, before the move.
        move: the base's pose after the move, in its frame before it.
        rays: the scan after the move.
        params: the noise of odometry and scan, and the search.
        rng: drawn from 3 n times, whatever the move, so that equal seeds stay in step.
        trend: (3,) of the proposal before; zeros for the first.
    """
    sigmas = move_sigmas(move, params)
    normals = rng.standard_normal(particles.shape)
    # Into cells from the maps' corner, and back again.
    scale = np.array([1.0 / maps.cell_m, 1.0 / maps.cell_m, 1.0])
    corner = np.array([maps.origin_x_m, maps.origin_y_m, 0.0])
    expected = (apply_moves(particles, np.array(move)) - corner) * scale
    fallback = (apply_moves(particles, np.array(move) + sigmas * normals) - corner) * scale
    drawn, log_factors, scores, trends = propose_poses(
        maps.table,
        maps.cells,
        expected,
        fallback,
        normals,
        rays.matched_ends_m() / maps.cell_m,
        search_of(params, maps.cell_m),
        sigmas * scale,
        trend,
    )
    drawn = drawn / scale + corner
    drawn[:, 2] = wrap_angles(drawn[:, 2])
    return Proposal(drawn, log_factors, scores, trends.mean(axis=0))


def search_of(params: GridSlamParams, cell_m: float) -> Search:
    """Return how scans are matched on maps with cells of this side."""
    return Search(
        params.kernelSize,
        -(cell_m**2) / params.sigma,
        -(cell_m**2) / params.lsigma / params.ogain,
        params.lstep / cell_m,
        params.astep,
        params.iterations,
        params.minimumScore,
    )
