"""The robot's outline on the floor: convex, with few corners, and never smaller than the robot."""

from __future__ import annotations

import math
from typing import List, Optional, Sequence

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.robot_description import OutlineXy
from diff_encoder_sim.robots.robot_tree import Shape
from diff_encoder_sim.robots.solids import reach_m, support_point_m

_MOST_CORNERS = 16
_BEARINGS = 64  # in which corners are looked for; a round robot's sides, halved twice, are 16
_CLOSE_M = 2e-3  # a side goes where its neighbours' corner is no farther out
_GRID_DECIMALS = 3
# How far rounding to the grid moves a corner at most.
_ROUNDING_M = 10**-_GRID_DECIMALS * math.sqrt(0.5)
_SLACK_M = 1e-4  # of an rpy of 1.57 for pi / 2
_SAME = 1e-6  # m of a point, rad of a bearing
_UP = np.array([0.0, 0.0, 1.0])


def footprint_outline(shapes: Sequence[Shape], floor_z_m: float, where: str) -> OutlineXy:
    """Return the outline of all shapes that rise above the floor.

    Args:
        shapes: collision shapes without meshes, wheels and casters included, in the root.
        floor_z_m: the floor in the root.
        where: begins the error: the robot's file.

    Returns:
        Up to 16 corners (x, y) [m] in the root, counter-clockwise, in whole mm: convex, around everything.

    Raises:
        ConfigError: there is no such shape.
    """
    above = [shape for shape in shapes if support_point_m(shape, _UP)[2] > floor_z_m]
    if not above:
        raise ConfigError(f'{where}: given no collision shape above the floor; allowed: a <collision> in a link')
    bearings_rad = _side_bearings_rad(above)
    reaches_m = _reaches_m(above, bearings_rad)
    while True:
        side = _needless_side(bearings_rad, reaches_m)
        if side is None:
            break
        bearings_rad, reaches_m = np.delete(bearings_rad, side), np.delete(reaches_m, side)
    outline_m = _convex(np.round(_corners_m(bearings_rad, reaches_m), _GRID_DECIMALS))
    if not _holds(outline_m, above):
        outline_m = _convex(np.round(_corners_m(bearings_rad, reaches_m + _ROUNDING_M), _GRID_DECIMALS))
    return tuple((float(x_m), float(y_m)) for x_m, y_m in outline_m + 0.0)  # no -0


def _side_bearings_rad(shapes: Sequence[Shape]) -> np.ndarray:
    """Return the (n,) bearings, rising, of the normals of the outline's sides; those of the axes are among them."""
    step_rad = 2 * math.pi / _BEARINGS
    tips_m = np.array([_tip_m(shapes, (index + 0.5) * step_rad) for index in range(_BEARINGS)])
    sides_m = np.roll(tips_m, -1, axis=0) - tips_m
    sides_m = sides_m[np.hypot(sides_m[:, 0], sides_m[:, 1]) > _SAME]
    normals_rad = np.append(np.arctan2(-sides_m[:, 0], sides_m[:, 1]), [0.0, math.pi / 2, math.pi, -math.pi / 2])
    bearings_rad = np.sort(normals_rad % (2 * math.pi))
    steps_rad = np.diff(bearings_rad, append=bearings_rad[0] + 2 * math.pi)
    return np.asarray(bearings_rad[steps_rad > _SAME])


def _tip_m(shapes: Sequence[Shape], bearing_rad: float) -> np.ndarray:
    """Return the (2,) point of all shapes that is farthest out in a bearing."""
    direction = _direction(bearing_rad)
    return max((support_point_m(shape, direction) for shape in shapes), key=direction.dot)[:2]


def _reaches_m(shapes: Sequence[Shape], bearings_rad: np.ndarray) -> np.ndarray:
    """Return how far the shapes reach in each of (n,) bearings."""
    return np.array([reach_m(shapes, _direction(bearing_rad)) for bearing_rad in bearings_rad])


def _needless_side(bearings_rad: np.ndarray, reaches_m: np.ndarray) -> Optional[int]:
    """Return the side whose neighbours' corner is closest to it, if it is close or corners are too many."""
    before_rad, after_rad = np.roll(bearings_rad, 1), np.roll(bearings_rad, -1)
    corners_m = _crossings_m(before_rad, np.roll(reaches_m, 1), after_rad, np.roll(reaches_m, -1))
    growths_m = np.cos(bearings_rad) * corners_m[:, 0] + np.sin(bearings_rad) * corners_m[:, 1] - reaches_m
    meets = (after_rad - before_rad) % (2 * math.pi) < math.pi - _SAME
    growths_m = np.where(meets, np.round(growths_m, 9), np.inf)
    side = int(np.flatnonzero(growths_m == growths_m.min())[-1])  # a round robot keeps the sides along its axes
    return side if growths_m[side] <= _CLOSE_M or len(bearings_rad) > _MOST_CORNERS else None


def _corners_m(bearings_rad: np.ndarray, reaches_m: np.ndarray) -> np.ndarray:
    """Return the (n, 2) corners in which each side meets the next."""
    return _crossings_m(bearings_rad, reaches_m, np.roll(bearings_rad, -1), np.roll(reaches_m, -1))


def _crossings_m(
    bearings_rad: np.ndarray, reaches_m: np.ndarray, others_rad: np.ndarray, other_reaches_m: np.ndarray
) -> np.ndarray:
    """Return the (n, 2) points on two lines each, a line given by its normal's bearing and its distance."""
    x_m = reaches_m * np.sin(others_rad) - other_reaches_m * np.sin(bearings_rad)
    y_m = other_reaches_m * np.cos(bearings_rad) - reaches_m * np.cos(others_rad)
    sines = np.sin(others_rad - bearings_rad)
    with np.errstate(divide='ignore', invalid='ignore'):  # parallel lines: not asked for
        return np.asarray(np.stack([x_m, y_m], axis=1) / sines[:, None])


def _convex(corners_m: np.ndarray) -> np.ndarray:
    """Return (n, 2) corners without those at which the outline does not turn left, which only makes it larger."""
    kept: List[np.ndarray] = list(corners_m)
    index = 0
    while index < len(kept):
        before_m, here_m, after_m = kept[index - 1], kept[index], kept[(index + 1) % len(kept)]
        (in_x, in_y), (out_x, out_y) = here_m - before_m, after_m - here_m
        if in_x * out_y - in_y * out_x > _SAME**2:
            index += 1
        else:
            del kept[index]
            index = max(index - 1, 0)
    return np.array(kept)


def _holds(outline_m: np.ndarray, shapes: Sequence[Shape]) -> bool:
    """Say whether all shapes are inside an outline of (n, 2) corners."""
    sides_m = np.roll(outline_m, -1, axis=0) - outline_m
    bearings_rad = np.arctan2(-sides_m[:, 0], sides_m[:, 1])
    outs_m = np.cos(bearings_rad) * outline_m[:, 0] + np.sin(bearings_rad) * outline_m[:, 1]
    return bool((_reaches_m(shapes, bearings_rad) <= outs_m + _SLACK_M).all())


def _direction(bearing_rad: float) -> np.ndarray:
    """Return the level (3,) unit vector in a bearing."""
    return np.array([math.cos(bearing_rad), math.sin(bearing_rad), 0.0])
