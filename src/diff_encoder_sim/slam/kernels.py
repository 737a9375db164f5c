"""Scan matching and proposal, compiled: in one module, or numba's cache might be half out of date.

Lengths are in cells, from the maps' corner. `ends` are the ends (k, 2) of a scan's rays in the base
frame, `table` is one particle's and `cells` all patches, as in patches.py.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np

from diff_encoder_sim.base.compiled import compiled
from diff_encoder_sim.slam.patches import HITS, MASK, MEAN_X, MEAN_Y, SHIFT, SIDE, VISITS

# A cell counts as surface if more than this fraction of its visits are hits: upstream's.
SURFACE_FRACTION = 0.1

# Below this spread no direction is defined: one cell alone.
LEAST_SPREAD = 1e-9

MOVES = np.array(
    [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]
)


@compiled
def propose_poses(
    table: np.ndarray,
    cells: np.ndarray,
    expected: np.ndarray,
    fallback: np.ndarray,
    normals: np.ndarray,
    ends: np.ndarray,
    kernel: int,
    score_scale: float,
    likelihood_scale: float,
    step: float,
    turn_rad: float,
    halvings: int,
    minimum_score: float,
    lattice: np.ndarray,
    sigmas: np.ndarray,
) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return, for all particles: drawn poses (n, 3), log-weight factors (n,), scores (n,)."""
    drawn = fallback.copy()
    log_factors, scores = np.empty(len(drawn)), np.empty(len(drawn))
    tried = np.empty_like(lattice)
    log_weights = np.empty(len(lattice))
    for i in range(len(drawn)):
        best, scores[i] = climb(table[i], cells, expected[i], ends, kernel, score_scale, step, turn_rad, halvings)
        if not scores[i] > minimum_score:
            log_factors[i] = log_likelihood(table[i], cells, drawn[i], ends, kernel, likelihood_scale)
            continue
        for k in range(len(lattice)):
            tried[k] = best + lattice[k]
            log_weights[k] = log_likelihood(table[i], cells, tried[k], ends, kernel, likelihood_scale)
            log_weights[k] += _log_motion(tried[k], expected[i], sigmas)
        highest = log_weights.max()
        weights = np.exp(log_weights - highest)
        total = weights.sum()
        drawn[i] = gaussian_draw(tried, weights / total, normals[i])
        log_factors[i] = highest + math.log(total)
    return drawn, log_factors, scores


@compiled
def climb(
    table: np.ndarray,
    cells: np.ndarray,
    pose: np.ndarray,
    ends: np.ndarray,
    kernel: int,
    score_scale: float,
    step: float,
    turn_rad: float,
    halvings: int,
) -> Tuple[np.ndarray, float]:
    """Return (3,) the pose with the best score near `pose`, and that score.

    Six moves, along x, along y and turned, are tried; the best one is taken if it improves the
    score, else the steps are halved.
    """
    best = pose.copy()
    score = _score(table, cells, best, ends, kernel, score_scale)
    trial = np.empty(3)
    while halvings >= 0:
        taken = -1
        for move in range(len(MOVES)):
            trial[0] = best[0] + step * MOVES[move, 0]
            trial[1] = best[1] + step * MOVES[move, 1]
            trial[2] = best[2] + turn_rad * MOVES[move, 2]
            trial_score = _score(table, cells, trial, ends, kernel, score_scale)
            if trial_score > score:
                score, taken = trial_score, move
        if taken >= 0:
            best[0] += step * MOVES[taken, 0]
            best[1] += step * MOVES[taken, 1]
            best[2] += turn_rad * MOVES[taken, 2]
        else:
            step, turn_rad, halvings = 0.5 * step, 0.5 * turn_rad, halvings - 1
    return best, score


@compiled
def _score(
    table: np.ndarray, cells: np.ndarray, pose: np.ndarray, ends: np.ndarray, kernel: int, scale: float
) -> float:
    """Sum exp(scale times squared distance) over the rays; 0 where nothing is near."""
    cos_yaw, sin_yaw = math.cos(pose[2]), math.sin(pose[2])
    total = 0.0
    for j in range(len(ends)):
        squared = _squared_distance(
            table,
            cells,
            pose[0] + cos_yaw * ends[j, 0] - sin_yaw * ends[j, 1],
            pose[1] + sin_yaw * ends[j, 0] + cos_yaw * ends[j, 1],
            kernel,
        )
        if squared < math.inf:
            total += math.exp(scale * squared)
    return total


@compiled
def log_likelihood(
    table: np.ndarray, cells: np.ndarray, pose: np.ndarray, ends: np.ndarray, kernel: int, scale: float
) -> float:
    """Sum scale times squared distance over the rays; beyond the kernel, its radius counts."""
    cos_yaw, sin_yaw = math.cos(pose[2]), math.sin(pose[2])
    # Upstream's is 90 times as much: rays into what was never seen before would decide.
    no_match = scale * (kernel + 0.5) ** 2
    total = 0.0
    for j in range(len(ends)):
        squared = _squared_distance(
            table,
            cells,
            pose[0] + cos_yaw * ends[j, 0] - sin_yaw * ends[j, 1],
            pose[1] + sin_yaw * ends[j, 0] + cos_yaw * ends[j, 1],
            kernel,
        )
        total += scale * squared if squared < math.inf else no_match
    return total


@compiled
def _squared_distance(table: np.ndarray, cells: np.ndarray, x: float, y: float, kernel: int) -> float:
    """Return the squared distance from a point to the surface near it, infinite if there is none.

    The surface is the line through the hits near the point, weighted by their nearness; where
    they form no line, as in a corner, it is their mean, with a smooth transition.
    """
    column, row = int(math.floor(x)), int(math.floor(y))
    if (
        row < kernel
        or column < kernel
        or row >= table.shape[0] * SIDE - kernel
        or column >= table.shape[1] * SIDE - kernel
    ):
        return math.inf
    total = mean_x = mean_y = xx = xy = yy = 0.0
    radius_squared = (kernel + 0.5) ** 2
    for r in range(row - kernel, row + kernel + 1):
        for c in range(column - kernel, column + kernel + 1):
            patch = table[r >> SHIFT, c >> SHIFT]
            hits = cells[patch, r & MASK, c & MASK, HITS]
            if hits == 0.0 or hits <= SURFACE_FRACTION * cells[patch, r & MASK, c & MASK, VISITS]:
                continue
            off_x = x - c - cells[patch, r & MASK, c & MASK, MEAN_X]
            off_y = y - r - cells[patch, r & MASK, c & MASK, MEAN_Y]
            squared = off_x * off_x + off_y * off_y
            if squared < radius_squared:
                nearness = 1.0 - squared / radius_squared
                weight = hits * nearness * nearness
                total += weight
                mean_x += weight * off_x
                mean_y += weight * off_y
                xx += weight * off_x * off_x
                xy += weight * off_x * off_y
                yy += weight * off_y * off_y
    if total == 0.0:
        return math.inf
    mean_x, mean_y = mean_x / total, mean_y / total
    xx, xy, yy = xx / total - mean_x * mean_x, xy / total - mean_x * mean_y, yy / total - mean_y * mean_y
    return float(_squared_across(mean_x, mean_y, xx, xy, yy))


@compiled
def _squared_across(x: float, y: float, xx: float, xy: float, yy: float) -> float:
    """Return the squared length of (x, y) across the longer axis of a covariance.

    The rounder the covariance is, the more of the length along that axis counts too.
    """
    half = math.sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy)
    longer, shorter = 0.5 * (xx + yy) + half, 0.5 * (xx + yy) - half
    # The better conditioned one of the eigenvector's two forms.
    axis_x, axis_y = (xy, longer - xx) if xx < yy else (longer - yy, xy)
    norm = axis_x * axis_x + axis_y * axis_y
    if longer < LEAST_SPREAD or norm == 0.0:
        return x * x + y * y
    along = x * axis_x + y * axis_y
    return x * x + y * y - (1.0 - max(shorter, 0.0) / longer) * along * along / norm


@compiled
def _log_motion(pose: np.ndarray, expected: np.ndarray, sigmas: np.ndarray) -> float:
    """Return the log of the motion model at a pose, up to a constant; sigmas ahead, across, turned."""
    # In the frame of the expected heading, not of the one before the move: the difference is
    # smaller than the uncertainty of the noise.
    cos_yaw, sin_yaw = math.cos(expected[2]), math.sin(expected[2])
    x, y = pose[0] - expected[0], pose[1] - expected[1]
    ahead, across = cos_yaw * x + sin_yaw * y, cos_yaw * y - sin_yaw * x
    turned_rad = pose[2] - expected[2]
    return float(-0.5 * ((ahead / sigmas[0]) ** 2 + (across / sigmas[1]) ** 2 + (turned_rad / sigmas[2]) ** 2))


@compiled
def gaussian_draw(poses: np.ndarray, weights: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Draw (3,) from the Gaussian with mean and covariance of poses (k, 3) with weights (k,), sum 1.

    `normals` (3,) are standard normal draws.
    """
    drawn = np.zeros(3)
    for k in range(len(poses)):
        drawn += weights[k] * poses[k]
    covariance = np.zeros((3, 3))
    for k in range(len(poses)):
        offset = poses[k] - drawn
        for a in range(3):
            for b in range(a + 1):
                covariance[a, b] += weights[k] * offset[a] * offset[b]
    # Its Cholesky root; zero along a direction without spread.
    root = np.zeros((3, 3))
    for a in range(3):
        for b in range(a + 1):
            rest = covariance[a, b]
            for c in range(b):
                rest -= root[a, c] * root[b, c]
            if a == b:
                root[a, a] = math.sqrt(max(rest, 0.0))
            elif root[b, b] > 0.0:
                root[a, b] = rest / root[b, b]
            drawn[a] += root[a, b] * normals[b]
    return drawn
