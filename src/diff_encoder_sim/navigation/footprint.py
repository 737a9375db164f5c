"""Footprint: the robot's outline on the floor."""

from __future__ import annotations

import json
import math
from typing import Any, List, NamedTuple, Sequence

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import Offset_m

# Footprint costs below zero mean that the robot cannot stand there, as in upstream's CostmapModel.
IN_OBSTACLE, IN_UNKNOWN, OFF_MAP = -1.0, -2.0, -3.0


MOST_CORNERS = 1000


def _from_text(value: Any) -> Any:
    # Upstream also accepts the polygon as text: "[[0.25, 0.3], ...]".
    if isinstance(value, str):
        try:
            return json.loads(value)
        except (ValueError, RecursionError):
            pass
    return value


def _is_polygon(points: List[List[float]]) -> List[List[float]]:
    if len(points) < 3 or any(len(point) != 2 for point in points):
        raise ValueError('at least three corners [x, y] [m]')
    if _outline_radii(np.array(points))[0] <= 0.0 or not _encloses_origin(np.array(points)):
        raise ValueError('a polygon around base_link')
    return points


FootprintPolygon = Annotated[
    List[List[Offset_m]],
    AfterValidator(_is_polygon),
    BeforeValidator(_from_text),
    Field(max_length=MOST_CORNERS, description='corners [x, y] of the robot in base_link, in order around it [m]'),
]

# ALTO: 0.5 m long, 0.6 m wide, base_link in the middle.
ALTO_FOOTPRINT = [[0.25, -0.3], [0.25, 0.3], [-0.25, 0.3], [-0.25, -0.3]]


class Footprint(NamedTuple):
    """Polygon around base_link, with the radii of the circles about base_link inside and around it."""

    vertices_m: np.ndarray  # (n, 2) x, y in base_link, padding included
    inscribed_radius_m: float
    circumscribed_radius_m: float


def make_footprint(points: Sequence[Sequence[float]], padding_m: float = 0.0) -> Footprint:
    """Make a footprint of corners [x, y] [m], each moved outwards by `padding_m` along both axes."""
    vertices_m = np.array(points, dtype=float)
    vertices_m = vertices_m + np.sign(vertices_m) * padding_m
    return Footprint(vertices_m, *_outline_radii(vertices_m))


def _outline_radii(vertices_m: np.ndarray) -> List[float]:
    """Return the smallest and the largest distance of the outline from the origin [m]."""
    starts, edges = vertices_m, np.roll(vertices_m, -1, axis=0) - vertices_m
    length_squared = np.maximum(np.einsum('ij,ij->i', edges, edges), 1e-12)
    along = np.clip(-np.einsum('ij,ij->i', starts, edges) / length_squared, 0.0, 1.0)
    nearest = starts + along[:, None] * edges
    return [float(np.hypot(*nearest.T).min()), float(np.hypot(*vertices_m.T).max())]


def _encloses_origin(vertices_m: np.ndarray) -> bool:
    """Return whether the outline winds around the origin."""
    angles = np.arctan2(vertices_m[:, 1], vertices_m[:, 0])
    turns = (np.diff(np.append(angles, angles[0])) + math.pi) % (2.0 * math.pi) - math.pi
    return bool(abs(turns.sum()) > math.pi)
