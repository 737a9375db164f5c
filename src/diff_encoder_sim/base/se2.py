"""Poses and angles in the plane: wrapping and composition.

Yaw is counter-clockwise from the x axis, in radians (REP-103).
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import callable_by_kernels, compiled


class Pose2D(NamedTuple):
    """A rigid motion of the plane: a frame's pose in its parent frame."""

    x_m: float
    y_m: float
    yaw_rad: float

    def compose(self, child: Pose2D) -> Pose2D:
        """Return the pose of `child` (given in this frame) in this frame's parent."""
        cos_yaw, sin_yaw = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return Pose2D(
            self.x_m + cos_yaw * child.x_m - sin_yaw * child.y_m,
            self.y_m + sin_yaw * child.x_m + cos_yaw * child.y_m,
            wrap_angle(self.yaw_rad + child.yaw_rad),
        )

    def inverse(self) -> Pose2D:
        """Return the pose of the parent in this frame."""
        cos_yaw, sin_yaw = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return Pose2D(
            -cos_yaw * self.x_m - sin_yaw * self.y_m, sin_yaw * self.x_m - cos_yaw * self.y_m, wrap_angle(-self.yaw_rad)
        )

    def relative_to(self, reference: Pose2D) -> Pose2D:
        """Return this pose in the frame of `reference`, both given in the same frame."""
        return reference.inverse().compose(self)


IDENTITY = Pose2D(0.0, 0.0, 0.0)


@callable_by_kernels
def wrap_angle(angle_rad: float) -> float:
    """Return the same direction in [-pi, pi)."""
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi


def wrap_angles(angles_rad: np.ndarray) -> np.ndarray:
    """Return the same directions, an array of any shape, in [-pi, pi)."""
    wrapped_rad: np.ndarray = (angles_rad + np.pi) % (2.0 * np.pi) - np.pi
    return wrapped_rad


@callable_by_kernels
def move_along_arc(pose: Pose2D, distance_m: float, turn_rad: float) -> Pose2D:
    """Return the pose after an arc of constant curvature: exact, not the midpoint approximation.

    The chord of an arc of length s that turns by t is s sin(t/2)/(t/2), at the heading
    half-way. Yaw is not wrapped here, so that whole turns stay countable.
    """
    half_turn_rad = 0.5 * turn_rad
    sinc = 1.0 - half_turn_rad * half_turn_rad / 6.0
    if abs(half_turn_rad) > 1e-4:  # below, the next term of the series, x^4/120, is under double precision
        sinc = math.sin(half_turn_rad) / half_turn_rad
    chord_m, chord_yaw_rad = distance_m * sinc, pose.yaw_rad + half_turn_rad
    return Pose2D(
        pose.x_m + chord_m * math.cos(chord_yaw_rad),
        pose.y_m + chord_m * math.sin(chord_yaw_rad),
        pose.yaw_rad + turn_rad,
    )


@callable_by_kernels
def base_of_axle(axle: Pose2D, axle_x_m: float) -> Pose2D:
    """Return the pose of a base, yaw in [-pi, pi), whose axle is `axle_x_m` ahead; each pose relative to its start."""
    yaw_rad = wrap_angle(axle.yaw_rad)
    if axle_x_m == 0.0:
        return Pose2D(axle.x_m, axle.y_m, yaw_rad)
    return Pose2D(axle.x_m + axle_x_m * (1.0 - math.cos(yaw_rad)), axle.y_m - axle_x_m * math.sin(yaw_rad), yaw_rad)


@compiled(nogil=True)
def poses_of_wheels(
    totals: np.ndarray, left_m: float, right_m: float, wheel_separation_m: float, axle_x_m: float, only_last: bool
) -> np.ndarray:
    """Return (draws, m, 3) poses x [m], y [m] and yaw [rad] in [-pi, pi) of a base from its wheel rotations.

    Args:
        totals: (draws, m, 2) left and right, since some start; the first pose is zero.
        left_m: distance of the left wheel per unit of its total.
        right_m: of the right wheel.
        wheel_separation_m: between the contact points.
        axle_x_m: place of the axle ahead of the base.
        only_last: return (draws, 1, 3), the last pose of each draw.
    """
    draws, reports, _ = totals.shape
    poses = np.zeros((draws, 1 if only_last else reports, 3))
    for draw in range(draws):
        pose = Pose2D(0.0, 0.0, 0.0)
        for report in range(reports):
            left = totals[draw, report, 0] - totals[draw, 0, 0]
            right = totals[draw, report, 1] - totals[draw, 0, 1]
            if report:
                left_step_m = (totals[draw, report, 0] - totals[draw, report - 1, 0]) * left_m
                right_step_m = (totals[draw, report, 1] - totals[draw, report - 1, 1]) * right_m
                if left_step_m or right_step_m:
                    turn_rad = (right_step_m - left_step_m) / wheel_separation_m
                    moved = move_along_arc(pose, 0.5 * (left_step_m + right_step_m), turn_rad)
                    # The heading is computed from the totals: summed rounded increments would drift.
                    pose = Pose2D(moved.x_m, moved.y_m, (right * right_m - left * left_m) / wheel_separation_m)
            if only_last and report < reports - 1:
                continue
            base, row = base_of_axle(pose, axle_x_m), 0 if only_last else report
            poses[draw, row, 0], poses[draw, row, 1], poses[draw, row, 2] = base.x_m, base.y_m, base.yaw_rad
    return poses


def interpolate(start: Pose2D, end: Pose2D, fraction: float) -> Pose2D:
    """Return the pose at a fraction between two, by the shorter turn; yaw in [-pi, pi)."""
    return Pose2D(
        start.x_m + fraction * (end.x_m - start.x_m),
        start.y_m + fraction * (end.y_m - start.y_m),
        wrap_angle(start.yaw_rad + fraction * wrap_angle(end.yaw_rad - start.yaw_rad)),
    )


def transform_points(frame: Pose2D, points_m: np.ndarray) -> np.ndarray:
    """Transform points (n, 2) from `frame` to its parent frame."""
    cos_yaw, sin_yaw = math.cos(frame.yaw_rad), math.sin(frame.yaw_rad)
    turned_m = points_m @ np.array([[cos_yaw, sin_yaw], [-sin_yaw, cos_yaw]])
    moved_m: np.ndarray = turned_m + np.array([frame.x_m, frame.y_m])
    return moved_m


def quat_xyzw_from_yaw(yaw_rad: float) -> Tuple[float, float, float, float]:
    """Return the unit quaternion of a rotation about z."""
    return 0.0, 0.0, math.sin(0.5 * yaw_rad), math.cos(0.5 * yaw_rad)


def yaw_from_quat_xyzw(x: float, y: float, z: float, w: float) -> float:
    """Return the yaw [rad] of a quaternion of any length, without roll and pitch; ValueError if zero or not finite."""
    norm_squared = x * x + y * y + z * z + w * w
    if not (math.isfinite(norm_squared) and norm_squared > 0.0):
        raise ValueError(f'orientation ({x}, {y}, {z}, {w}) is no rotation; expected finite numbers, not all 0')
    return math.atan2(2.0 * (w * z + x * y), norm_squared - 2.0 * (y * y + z * z))


class PoseSeries(NamedTuple):
    """Poses of one source in one frame, with their stamps; at least one."""

    stamps_ns: np.ndarray  # (n,) int64, as recorded
    x_y_yaw: np.ndarray  # (n, 3) [m, m, rad], finite, yaw in [-pi, pi)

    def by_time(self) -> PoseSeries:
        """Sort by stamp; of poses with the same stamp the first is kept."""
        if (np.diff(self.stamps_ns) > 0).all():
            return self
        stamps_ns, rows = np.unique(self.stamps_ns, return_index=True)
        return PoseSeries(stamps_ns, self.x_y_yaw[rows])

    def path_length_m(self) -> float:
        """Sum the distances from pose to pose in the order of the stamps."""
        return float(steps_m(self.by_time().x_y_yaw).sum())


def steps_m(x_y_yaw: np.ndarray) -> np.ndarray:
    """Return the (n - 1,) distances between neighbouring poses of (n, 3)."""
    x_y_m = np.diff(x_y_yaw[:, :2], axis=0)
    # Not hypot, which differs from evo's norm in the last digit: both must find the same segments.
    return np.asarray(np.sqrt(np.square(x_y_m).sum(axis=1)))
