"""The 6x6 covariances of messages, over (x, y, z, roll, pitch, yaw), of planar ones."""

from __future__ import annotations

import numpy as np

from diff_encoder_sim.serialization.message_types import UNKNOWN_VARIANCE


def _cells(*axes: int) -> np.ndarray:
    """Return where a covariance over some of the axes stands in the 36 numbers, row by row."""
    return np.ravel_multi_index(np.ix_(axes, axes), (6, 6)).ravel()


_POSE_CELLS, _TWIST_CELLS = _cells(0, 1, 5), _cells(0, 5)
_UNKNOWN = np.diag(np.full(6, UNKNOWN_VARIANCE)).ravel().astype('<f8')
_ZERO = np.zeros(36, '<f8')


def encode_amcl_covariance(planar: np.ndarray) -> bytes:
    """Encode a 3x3 covariance over (x, y, yaw); the rest is zero, as upstream's amcl has it."""
    return _encode(planar, _POSE_CELLS, _ZERO)


def encode_odometry_covariance(planar: np.ndarray) -> bytes:
    """Encode a 3x3 covariance over (x, y, yaw); the other variances are unknown."""
    return _encode(planar, _POSE_CELLS, _UNKNOWN)


def encode_twist_covariance(planar: np.ndarray) -> bytes:
    """Encode a 2x2 covariance over (linear x, angular z); the other variances are unknown."""
    return _encode(planar, _TWIST_CELLS, _UNKNOWN)


def _encode(planar: np.ndarray, cells: np.ndarray, elsewhere: np.ndarray) -> bytes:
    full = elsewhere.copy()
    full[cells] = np.ravel(planar)
    return full.tobytes()
