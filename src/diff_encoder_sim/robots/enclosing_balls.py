"""The smallest circle or ball around points."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple, Tuple

import numpy as np

# A point that is this much farther out than the radius still counts as inside: rounding of the circumcentres.
_SLACK = 1e-9


class Ball(NamedTuple):
    """A ball, in two dimensions a circle."""

    centre_m: np.ndarray  # (d,)
    radius_m: float


def smallest_ball(points_m: np.ndarray) -> Ball:
    """Return the smallest ball around (n, d) points, d 2 or 3.

    A few points on its rim decide it: they are found by adding the point that is farthest out, each time to those
    that decided so far, until none is out. The radius grows with each, so this ends.
    """
    rim_m = points_m[:1]
    ball = Ball(points_m[0], 0.0)
    slack_m = _SLACK * float(np.ptp(points_m, axis=0).max())
    while True:
        distances_m = np.linalg.norm(points_m - ball.centre_m, axis=1)
        farthest = int(distances_m.argmax())
        if distances_m[farthest] <= ball.radius_m + slack_m:
            return ball
        larger, rim_m = _ball_of_few(np.vstack([rim_m, points_m[farthest]]), slack_m)
        if larger.radius_m <= ball.radius_m:  # all that rounding leaves to gain
            return Ball(ball.centre_m, float(distances_m[farthest]))
        ball = larger


def _ball_of_few(points_m: np.ndarray, slack_m: float) -> Tuple[Ball, np.ndarray]:
    """Return the smallest ball around up to d + 2 points, and those of them that are on its rim."""
    best, best_rim_m = Ball(points_m[0], np.inf), points_m
    for count in range(2, points_m.shape[1] + 2):
        for chosen in combinations(points_m, count):
            rim_m = np.array(chosen)
            ball = _ball_through(rim_m)
            reach_m = np.linalg.norm(points_m - ball.centre_m, axis=1).max()
            if reach_m <= ball.radius_m + slack_m and ball.radius_m < best.radius_m:
                best, best_rim_m = ball, rim_m
    return best, best_rim_m


def _ball_through(points_m: np.ndarray) -> Ball:
    """Return the smallest ball that has all points on its rim: its centre is in their affine span."""
    sides_m = points_m[1:] - points_m[0]
    centre_from_first_m = np.linalg.lstsq(2 * sides_m, np.sum(sides_m**2, axis=1), rcond=None)[0]
    return Ball(points_m[0] + centre_from_first_m, float(np.linalg.norm(centre_from_first_m)))
