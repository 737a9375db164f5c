"""The paths that the report's chart of one trial draws, with as few points as show them, and the floor below them."""

from __future__ import annotations

import base64
import io
import math
from typing import Any, Dict, List, Optional

import numpy as np
from PIL import Image

from diff_encoder_sim.analysis.dataset import Dataset, TrialData
from diff_encoder_sim.analysis.figures.map_backdrop import map_of
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.localization.occupancy_grid import OCCUPIED, OccupancyGrid

# The borders of what is shown [m]: left, right, bottom, top.
Floor = Dict[str, float]

# The true one, and odometry's.
PATHS = ('true path', '/odom')

# Of more trials, the first of each cell: the page stays below 3 MB.
MOST_TRIALS = 400

# Points nearer than this fraction of the floor's sides to the line between others are left out: less than a pixel.
STRAIGHT_WITHIN = 1.5e-3

MM_PER_M = 1000.0
DECIMALS = 3  # of metres

MARGIN = 0.05
LEAST_SIDE_M = 0.1

OCCUPIED_GREY = 153


def path_indices(dataset: Dataset) -> List[int]:
    """Return the places in the dataset of the trials whose paths are shown: with a bag, at most `MOST_TRIALS`."""
    most = max(1, MOST_TRIALS // max(1, len(dataset.cells())))
    counts: Dict[Any, int] = {}
    shown = []
    for index, trial in enumerate(dataset.trials):
        counts[trial.cell] = counts.get(trial.cell, 0) + (trial.tracks is not None)
        if trial.tracks is not None and counts[trial.cell] <= most:
            shown.append(index)
    return shown


def path_rows(dataset: Dataset, indices: List[int], floors: Dict[str, Floor]) -> List[Dict[str, Any]]:
    """Return two rows for each trial: the true path, and that of /odom, x and y as increments [mm], which are short."""
    rows = []
    for index in indices:
        trial = dataset.trials[index]
        floor = floors[trial.test]
        sides_m = np.array([floor['right'] - floor['left'], floor['top'] - floor['bottom']])
        for kind, track in zip(PATHS, trial.tracks or ()):
            points_mm = np.round(MM_PER_M * sides_m * simplified(track / sides_m, STRAIGHT_WITHIN)).astype(int)
            dx_mm, dy_mm = np.diff(points_mm, axis=0, prepend=0).T.tolist()
            rows.append({'trial': index, 'encoder': trial.ppr, 'path': kind, 'dx': dx_mm, 'dy': dy_mm})
    return rows


def simplified(points: np.ndarray, within: float) -> np.ndarray:
    """Return those points of a line, its ends among them, between which straight lines pass all others so near.

    By Ramer, and Douglas and Peucker: the farthest point from the line between two is kept, and divides them.

    Args:
        points: (n, 2), n > 0.
        within: greatest distance, in the points' unit.
    """
    kept = np.zeros(len(points), bool)
    kept[[0, -1]] = True
    parts = [(0, len(points) - 1)]
    while parts:
        first, last = parts.pop()
        if last - first > 1:
            distances = _distances(points[first + 1 : last], points[first], points[last])
            farthest = int(distances.argmax())
            if distances[farthest] > within:
                middle = first + 1 + farthest
                kept[middle] = True
                parts += [(first, middle), (middle, last)]
    remaining: np.ndarray = points[kept]
    return remaining


def _distances(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """(n,) distances of points from the line between two others."""
    along, offsets = end - start, points - start
    length2 = float(along @ along)
    nearest = np.clip(offsets @ along / length2, 0.0, 1.0) if length2 else np.zeros(len(points))
    away = offsets - nearest[:, np.newaxis] * along
    distances: np.ndarray = np.hypot(away[:, 0], away[:, 1])
    return distances


def floors_of(dataset: Dataset, indices: List[int]) -> Dict[str, Floor]:
    """Return by test the part of the floor that its paths take, with start, and goal [m]."""
    trials: Dict[str, List[TrialData]] = {}
    for index in indices:
        trials.setdefault(dataset.trials[index].test, []).append(dataset.trials[index])
    return {test: _floor(of_test, dataset.requested.get(test)) for test, of_test in trials.items()}


def _floor(trials: List[TrialData], requested: Optional[Trial]) -> Floor:
    ends = [] if requested is None else [requested.test.start.pose(), requested.goal()]
    points = np.vstack([*(track for trial in trials for track in trial.tracks or ()), *(pose[:2] for pose in ends)])
    low, high = points.min(axis=0), points.max(axis=0)
    half = np.maximum(high - low, LEAST_SIDE_M) * (0.5 + MARGIN)
    (left, bottom), (right, top) = 0.5 * (low + high) - half, 0.5 * (low + high) + half
    return {'left': float(left), 'right': float(right), 'bottom': float(bottom), 'top': float(top)}


def mark_rows(dataset: Dataset, tests: List[str]) -> List[Dict[str, Any]]:
    """Return where each test starts and where its goal is [m]."""
    rows = []
    for test in tests:
        if test in dataset.requested:
            requested = dataset.requested[test]
            for kind, pose in (('start', requested.test.start.pose()), ('goal', requested.goal())):
                rows.append(
                    {'test': test, 'mark': kind, 'x': round(pose.x_m, DECIMALS), 'y': round(pose.y_m, DECIMALS)}
                )
    return rows


def map_rows(dataset: Dataset, tests: List[str]) -> List[Dict[str, Any]]:
    """Return the map of each test's world as an image with its borders [m]; without those that lie askew."""
    rows = []
    for test in tests:
        grid = map_of(dataset.requested[test]) if test in dataset.requested else None
        if grid is not None and math.isclose(grid.origin.yaw_rad, 0.0):
            left, bottom = grid.origin.x_m, grid.origin.y_m
            right, top = left + grid.width * grid.resolution_m, bottom + grid.height * grid.resolution_m
            rows.append({'test': test, 'url': _image(grid), 'left': left, 'right': right, 'bottom': bottom, 'top': top})
    return rows


def _image(grid: OccupancyGrid) -> str:
    """Return the occupied cells in grey on nothing, as a data URI of a PNG."""
    pixels = np.zeros((*grid.cells.shape, 2), np.uint8)
    pixels[grid.cells[::-1] == OCCUPIED] = (OCCUPIED_GREY, 255)
    file = io.BytesIO()
    Image.fromarray(pixels, 'LA').save(file, 'PNG', optimize=True)
    return 'data:image/png;base64,' + base64.b64encode(file.getvalue()).decode('ascii')
