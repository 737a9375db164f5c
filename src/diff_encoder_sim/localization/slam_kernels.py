"""Scan matching and proposal of grid SLAM, compiled; lengths are in cells, from the maps' corner.

`ends` (k, 2) of a scan's rays are in the base frame; `table`, of one particle, and `cells` are those of patches.py.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.localization.patches import HITS, MASK, MEAN_X, MEAN_Y, SHIFT, VISITS
from diff_encoder_sim.localization.slam_params import SIDE

SURFACE_FRACTION = 0.1  # of a cell's visits that must be hits, for a surface: upstream's
LEAST_SPREAD = 1e-9  # below it, as in a single cell, no direction is defined
REFINEMENTS, CLOSE_CELLS, CLOSE_RAD = 10, 5e-3, 5e-5  # the refinement ends after these steps, or with a smaller one
TREND_STEPS = 10  # of the running mean of the scans' offsets from odometry

# Squared distance, in standard deviations of a scan, above which it contradicts odometry: 95 % of chi-squared with 3
# degrees of freedom.
CONTRADICTION = 7.81


class Search(NamedTuple):
    """Scan matching parameters: GridSlamParams in cells."""

    kernel: int  # cells in each direction in which a match is searched
    score_scale: float  # of a squared distance in the exponent of a score
    likelihood_scale: float  # the same of a likelihood
    step: float  # first step of the match
    turn_rad: float
    halvings: int  # of these steps
    minimum_score: float  # of a match that is used


MOVES = np.array(
    [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]
)


@compiled
def propose_poses(
    table: Array,
    cells: Array,
    expected: Array,
    fallback: Array,
    normals: Array,
    ends: Array,
    search: Search,
    sigmas: Array,
    trend: Array,
) -> Tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return, for all particles: drawn poses (n, 3), log-weight factors (n,), scores (n,), and trends (n, 3)."""
    drawn, trends = fallback.copy(), np.zeros(fallback.shape)
    log_factors, scores = np.empty(len(drawn)), np.empty(len(drawn))
    for i in range(len(drawn)):
        match, scores[i] = climb(table[i], cells, expected[i], ends, search)
        if not scores[i] > search.minimum_score:
            log_factors[i] = fit(table[i], cells, drawn[i], ends, search)[1]
            continue
        mode, root = refine(table[i], cells, match, expected[i], ends, search, sigmas)
        correction = mode - expected[i]
        # Independent parts of variance 1.
        offset = np.array([(root[a:, a] * correction[a:]).sum() for a in range(3)])
        trends[i] = trend + (offset - trend) / TREND_STEPS
        way = correction + _divided_by_transpose(root, normals[i])
        drawn[i] = expected[i] + scan_share(offset, trends[i]) * way
        log_factors[i] = fit(table[i], cells, mode, ends, search)[1]
        # The motion model, in the frame of the expected heading: the noise is less certain than the difference.
        cos_yaw, sin_yaw = math.cos(expected[i, 2]), math.sin(expected[i, 2])
        ahead = (cos_yaw * correction[0] + sin_yaw * correction[1]) / sigmas[0]
        across = (cos_yaw * correction[1] - sin_yaw * correction[0]) / sigmas[1]
        log_motion = -0.5 * (ahead**2 + across**2 + (correction[2] / sigmas[2]) ** 2)
        log_factors[i] += log_motion - np.log(np.diag(root)).sum()
    return drawn, log_factors, scores, trends


@compiled
def climb(table: Array, cells: Array, pose: Array, ends: Array, search: Search) -> Tuple[np.ndarray, float]:
    """Return (3,) the pose with the best score near `pose`, and that score: by the best of MOVES, or smaller ones."""
    steps, halvings = np.array([search.step, search.step, search.turn_rad]), search.halvings
    best, score = pose, fit(table, cells, pose, ends, search)[0]
    while halvings >= 0:
        start, score_before = best, score
        for move in range(len(MOVES)):
            trial = start + steps * MOVES[move]
            trial_score = fit(table, cells, trial, ends, search)[0]
            if trial_score > score:
                best, score = trial, trial_score
        if score == score_before:
            steps, halvings = 0.5 * steps, halvings - 1
    return best, score


@compiled
def fit(table: Array, cells: Array, pose: Array, ends: Array, search: Search) -> Tuple[float, float]:
    """Return the score and the log-likelihood of a scan at a pose.

    Sums over the rays of exp(scale times squared distance), 0 if nothing is near, and of scale times squared distance;
    beyond the kernel, its radius counts. Upstream's likelihood is 90 times as much: rays into unseen cells decide.
    """
    cos_yaw, sin_yaw = math.cos(pose[2]), math.sin(pose[2])
    score = log_likelihood = 0.0
    for j in range(len(ends)):
        x = pose[0] + cos_yaw * ends[j, 0] - sin_yaw * ends[j, 1]
        y = pose[1] + sin_yaw * ends[j, 0] + cos_yaw * ends[j, 1]
        found, off_x, off_y, xx, xy, yy = _surface_near(table, cells, x, y, search.kernel)
        if found:
            squared = xx * off_x * off_x + 2.0 * xy * off_x * off_y + yy * off_y * off_y
            score += math.exp(search.score_scale * squared)
            log_likelihood += search.likelihood_scale * squared
        else:
            log_likelihood += search.likelihood_scale * (search.kernel + 0.5) ** 2
    return score, log_likelihood


@compiled
def refine(
    table: Array, cells: Array, match: Array, expected: Array, ends: Array, search: Search, sigmas: Array
) -> Tuple[np.ndarray, np.ndarray]:
    """Return (3,) the likeliest pose near `match` by scan and odometry, and (3, 3) the lower root of its information.

    By Gauss and Newton; a ray counts by its part of the score, so that one without a counterpart does not pull.
    """
    pose = match.copy()
    for _ in range(REFINEMENTS):
        information, pull = _motion_information(pose, expected, sigmas)
        _add_scan(information, pull, table, cells, pose, ends, search)
        root = _root(information)
        change = _divided_by_transpose(root, _divided(root, pull))
        pose += change
        if abs(change[0]) + abs(change[1]) < CLOSE_CELLS and abs(change[2]) < CLOSE_RAD:
            break
    return pose, root


@compiled
def scan_share(offset: Array, trend: Array) -> float:
    """Return the fraction, 0 to 1, of the offset between odometry's pose and the scan's by which a particle follows.

    The offset (3,), and its running mean (3,), which finds a small error that every step has, are in standard
    deviations of the scan. Only the excess speaks against odometry (the nonnegative garrote, Breiman 1995).
    """
    squared = max((offset * offset).sum(), (2.0 * TREND_STEPS - 1.0) * (trend * trend).sum())
    return max(0.0, 1.0 - CONTRADICTION / squared) if squared > 0.0 else 0.0


@compiled
def _add_scan(
    information: Array, pull: Array, table: Array, cells: Array, pose: Array, ends: Array, search: Search
) -> None:
    """Add a scan's information (3, 3), and its product with the change of pose that fits it best, (3,)."""
    cos_yaw, sin_yaw = math.cos(pose[2]), math.sin(pose[2])
    for j in range(len(ends)):
        arm_x, arm_y = cos_yaw * ends[j, 0] - sin_yaw * ends[j, 1], sin_yaw * ends[j, 0] + cos_yaw * ends[j, 1]
        found, x, y, xx, xy, yy = _surface_near(table, cells, pose[0] + arm_x, pose[1] + arm_y, search.kernel)
        if not found:
            continue
        force_x, force_y = xx * x + xy * y, xy * x + yy * y
        weight = -2.0 * search.likelihood_scale * math.exp(search.score_scale * (x * force_x + y * force_y))
        # By the turn, an end moves along (-arm_y, arm_x).
        turn_x, turn_y = xy * arm_x - xx * arm_y, yy * arm_x - xy * arm_y
        information[0, 0] += weight * xx
        information[1, 0] += weight * xy
        information[1, 1] += weight * yy
        information[2, 0] += weight * turn_x
        information[2, 1] += weight * turn_y
        information[2, 2] += weight * (turn_y * arm_x - turn_x * arm_y)
        pull[0] -= weight * force_x
        pull[1] -= weight * force_y
        pull[2] -= weight * (force_y * arm_x - force_x * arm_y)


@compiled
def _surface_near(
    table: Array, cells: Array, x: float, y: float, kernel: int
) -> Tuple[bool, float, float, float, float, float]:
    """Return whether a surface is near a point, the point's offset (x, y) from it, and a matrix (xx, xy, yy).

    The surface is the line through the hits near the point, weighted by their nearness: of the distance to their
    mean, only the part across counts; all of it, with a smooth transition, if they form no line, as in a corner. The
    squared distance is the product of the matrix with the offset from both sides.
    """
    column, row = int(math.floor(x)), int(math.floor(y))
    rows, columns = table.shape[0] * SIDE, table.shape[1] * SIDE
    if not (kernel <= row < rows - kernel and kernel <= column < columns - kernel):
        return False, 0.0, 0.0, 0.0, 0.0, 0.0
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
        return False, 0.0, 0.0, 0.0, 0.0, 0.0
    mean_x, mean_y = mean_x / total, mean_y / total
    xx, xy, yy = xx / total - mean_x * mean_x, xy / total - mean_x * mean_y, yy / total - mean_y * mean_y
    xx, xy, yy = _across(xx, xy, yy)
    return True, mean_x, mean_y, xx, xy, yy


@compiled
def _across(xx: float, xy: float, yy: float) -> Tuple[float, float, float]:
    """Return the projection across the longer axis of a covariance, along it in proportion to the roundness."""
    half = math.sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy)
    longer, shorter = 0.5 * (xx + yy) + half, 0.5 * (xx + yy) - half
    # The better conditioned one of the eigenvector's two forms.
    axis_x, axis_y = (xy, longer - xx) if xx < yy else (longer - yy, xy)
    norm = axis_x * axis_x + axis_y * axis_y
    if longer < LEAST_SPREAD or norm == 0.0:
        return 1.0, 0.0, 1.0
    removed = (1.0 - max(shorter, 0.0) / longer) / norm
    return 1.0 - removed * axis_x * axis_x, -removed * axis_x * axis_y, 1.0 - removed * axis_y * axis_y


@compiled
def _motion_information(pose: Array, expected: Array, sigmas: Array) -> Tuple[np.ndarray, np.ndarray]:
    """Return odometry's information (3, 3), lower triangle, and its product with expected minus pose, (3,)."""
    cos_yaw, sin_yaw = math.cos(expected[2]), math.sin(expected[2])
    ahead, across = sigmas[0] ** -2, sigmas[1] ** -2
    information = np.zeros((3, 3))
    information[0, 0] = ahead * cos_yaw * cos_yaw + across * sin_yaw * sin_yaw
    information[1, 0] = (ahead - across) * cos_yaw * sin_yaw
    information[1, 1] = ahead * sin_yaw * sin_yaw + across * cos_yaw * cos_yaw
    information[2, 2] = sigmas[2] ** -2
    x, y = expected[0] - pose[0], expected[1] - pose[1]
    pull_x = information[0, 0] * x + information[1, 0] * y
    pull_y = information[1, 0] * x + information[1, 1] * y
    return information, np.array([pull_x, pull_y, information[2, 2] * (expected[2] - pose[2])])


@compiled
def _root(matrix: Array) -> np.ndarray:
    """Return Cholesky's lower root of a positive definite matrix (3, 3), of which the lower triangle is read."""
    root = np.zeros((3, 3))
    for a in range(3):
        for b in range(a + 1):
            rest = matrix[a, b]
            for c in range(b):
                rest -= root[a, c] * root[b, c]
            root[a, b] = math.sqrt(rest) if a == b else rest / root[b, b]
    return root


@compiled
def _divided(root: Array, vector: Array) -> np.ndarray:
    """Solve root times x = vector for x (3,), with a lower root."""
    x = vector.copy()
    for a in range(3):
        for b in range(a):
            x[a] -= root[a, b] * x[b]
        x[a] /= root[a, a]
    return x


@compiled
def _divided_by_transpose(root: Array, vector: Array) -> np.ndarray:
    """Solve the transpose of root times x = vector for x (3,), with a lower root."""
    x = vector.copy()
    for a in range(2, -1, -1):
        for b in range(a + 1, 3):
            x[a] -= root[b, a] * x[b]
        x[a] /= root[a, a]
    return x
