"""The 6x6 covariances of messages, over (x, y, z, roll, pitch, yaw), of planar ones."""

from __future__ import annotations

import struct

import numpy as np

from diff_encoder_sim.drives.message_types import UNKNOWN_VARIANCE
from diff_encoder_sim.wheels.odometry_covariance import PlanarCovariance
from diff_encoder_sim.wheels.wheel_twist import TwistCovariance


def _unknown_rows(first: int, last: int) -> bytes:
    """Return the rows of axes that wheels do not measure."""
    return np.diag(np.full(6, UNKNOWN_VARIANCE))[first:last].astype('<f8').tobytes()


# Rows with numbers in some columns, zeros in the others; between them the rows of the axes that are not measured.
_PLANAR = struct.Struct('<2d24xd 2d24xd 144s 2d24xd')
_TWIST = struct.Struct('<d32xd 192s d32xd')
_Z_ROLL_PITCH, _ALL_BUT_X_AND_YAW = _unknown_rows(2, 5), _unknown_rows(1, 5)
_ZEROS = bytes(len(_Z_ROLL_PITCH))


def encode_amcl_covariance(planar: np.ndarray) -> bytes:
    """Encode a 3x3 covariance over (x, y, yaw); the rest is zero, as upstream's amcl has it."""
    (x, y, yaw) = planar.tolist()
    return _PLANAR.pack(*x, *y, _ZEROS, *yaw)


def encode_odometry_covariance(planar: PlanarCovariance) -> bytes:
    """Encode a covariance over (x, y, yaw); the other variances are unknown."""
    xx, xy, x_yaw, yy, y_yaw, yaw_yaw = planar
    return _PLANAR.pack(xx, xy, x_yaw, xy, yy, y_yaw, _Z_ROLL_PITCH, x_yaw, y_yaw, yaw_yaw)


def encode_twist_covariance(planar: TwistCovariance) -> bytes:
    """Encode a covariance over (linear x, angular z); the other variances are unknown."""
    linear, together, angular = planar
    return _TWIST.pack(linear, together, _ALL_BUT_X_AND_YAW, together, angular)
