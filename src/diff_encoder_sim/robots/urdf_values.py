"""Names, numbers and poses in a URDF, checked."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.xml_values import bounded_numbers, rotation_from_rpy

LONGEST_NAME = 255


def named(element: ElementTree.Element, where: str) -> str:
    """Return an element's name.

    Raises:
        ConfigError: it has none, or one that PyBullet has no room for.
    """
    name = element.get('name', '')
    if not name.strip():
        raise ConfigError(f'{where}: <{element.tag}>: name: missing')
    if len(name.encode('utf-8')) > LONGEST_NAME:
        raise ConfigError(f'{where}: <{element.tag}>: name: given {name!r}; allowed: at most {LONGEST_NAME} bytes')
    return name


def parse_pose(parent: ElementTree.Element, where: str) -> np.ndarray:
    """Return the (4, 4) pose of an element's <origin>, [m] and [rad]; that of the parent frame where it has none.

    Raises:
        ConfigError: xyz or rpy are not three numbers.
    """
    origin = parent.find('origin')
    pose = np.eye(4)
    if origin is not None:
        pose[:3, 3] = bounded_numbers(origin.get('xyz', '0 0 0'), 3, f'{where}: origin xyz')
        pose[:3, :3] = rotation_from_rpy(*bounded_numbers(origin.get('rpy', '0 0 0'), 3, f'{where}: origin rpy'))
    return pose
