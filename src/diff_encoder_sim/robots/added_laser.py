"""A scanner that the user adds to a robot whose URDF has none."""

from __future__ import annotations

import re
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from diff_encoder_sim.base.xml_values import Vector

ADDED_LINK = 'laser'
ADDED_HEIGHT_M = 0.05  # above the robot's highest point, where nothing of it is in the way


class AddedLaser(NamedTuple):
    """A level scanner on a link of the robot."""

    parent: str  # link
    xyz_m: Vector  # in the parent


def with_laser(urdf: str, laser: AddedLaser) -> str:
    """Return the URDF with one more link, that of the scanner."""
    end = max(match.start() for match in re.finditer(r'</([\w.-]+:)?robot\s*>', urdf))
    x_m, y_m, z_m = laser.xyz_m
    added = (
        f'<link name="{ADDED_LINK}"/>'
        f'<joint name="added_{ADDED_LINK}_joint" type="fixed">'
        f'<parent link={quoteattr(laser.parent)}/><child link="{ADDED_LINK}"/>'
        f'<origin xyz="{x_m} {y_m} {z_m}" rpy="0 0 0"/>'
        '</joint>'
    )
    return urdf[:end] + added + urdf[end:]
