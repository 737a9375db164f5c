"""Values in the XML of SDF and URDF files: numbers, lengths, origins and rotations."""

from __future__ import annotations

import math
from typing import List, Optional, Tuple
from xml.etree import ElementTree

import numpy as np

from diff_encoder_sim.base.errors import ConfigError

# Maximum value in SI units.
MOST = 1e6


Vector = Tuple[float, float, float]


def finite_numbers(text: Optional[str]) -> List[float]:
    """Return the numbers in a file's text; none if one of them is no finite number."""
    try:
        numbers = [float(word) for word in (text or '').split()]
    except ValueError:
        return []
    return numbers if all(map(math.isfinite, numbers)) else []


def parse_numbers(text: Optional[str], count: int, where: str) -> List[float]:
    """Read `count` finite numbers from a file's text; ConfigError, which names `where`, if it is something else."""
    numbers = finite_numbers(text)
    if len(numbers) != count:
        raise ConfigError(f'{where}: given {text!r}; allowed: {count} finite number(s)')
    return numbers


def bounded_numbers(text: Optional[str], count: int, where: str) -> List[float]:
    """Read numbers as `parse_numbers`, of a plausible size for robots and rooms."""
    numbers = parse_numbers(text, count, where)
    if max(map(abs, numbers)) > MOST:
        raise ConfigError(f'{where}: given {text!r}; allowed: from {-MOST:g} to {MOST:g}')
    return numbers


def parse_lengths(text: Optional[str], count: int, where: str) -> List[float]:
    """Read numbers as `bounded_numbers`, all greater than 0 [m]."""
    lengths_m = bounded_numbers(text, count, where)
    if min(lengths_m) <= 0:
        raise ConfigError(f'{where}: given {text!r}; allowed: lengths greater than 0 [m]')
    return lengths_m


def joint_link(joint: ElementTree.Element, end: str) -> str:
    """Return the name of a URDF joint's `parent` or `child` link; '' if missing."""
    element = joint.find(end)
    return '' if element is None else element.get('link', '')


def rotation_from_rpy(roll_rad: float, pitch_rad: float, yaw_rad: float) -> np.ndarray:
    """Return the 3x3 rotation about the fixed axes x, then y, then z (URDF's and SDF's convention)."""
    cr, sr = math.cos(roll_rad), math.sin(roll_rad)
    cp, sp = math.cos(pitch_rad), math.sin(pitch_rad)
    cy, sy = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def rpy_from_rotation(rotation: np.ndarray) -> Vector:
    """Return the (roll, pitch, yaw) [rad] of a 3x3 rotation; roll only if x points up or down."""
    cosine = math.hypot(rotation[0, 0], rotation[1, 0])
    pitch_rad = math.atan2(-rotation[2, 0], cosine)
    if cosine < 1e-9:
        return math.copysign(1.0, pitch_rad) * math.atan2(rotation[0, 1], rotation[1, 1]), pitch_rad, 0.0
    return math.atan2(rotation[2, 1], rotation[2, 2]), pitch_rad, math.atan2(rotation[1, 0], rotation[0, 0])
