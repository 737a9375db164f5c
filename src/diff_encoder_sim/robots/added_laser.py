"""A scanner that the user adds to a robot, in place of those of its URDF."""

from __future__ import annotations

import itertools
import re
from typing import Any, Dict, NamedTuple
from xml.sax.saxutils import quoteattr

from diff_encoder_sim.base.xml_values import Vector

ADDED_LINK = 'laser'  # with a number, if the URDF has a link of this name


class AddedLaser(NamedTuple):
    """A level scanner on a link of the robot."""

    parent: str  # link
    xyz_m: Vector  # in the parent

    def place(self) -> Dict[str, Any]:
        """Return the entry of a robot file."""
        return {'parent': self.parent, 'xyz': list(self.xyz_m)}


def added_link(urdf: str) -> str:
    """Return the name of the scanner's link in a URDF that does not have it yet."""
    taken = {match[2] for match in re.finditer(r'\sname\s*=\s*(["\'])(.*?)\1', urdf)}
    names = itertools.chain([ADDED_LINK], (f'{ADDED_LINK}_{number}' for number in itertools.count(2)))
    return next(name for name in names if not {name, f'added_{name}_joint'} & taken)


def with_laser(urdf: str, laser: AddedLaser) -> str:
    """Return the URDF with one more link, that of the scanner."""
    link = added_link(urdf)
    end = max(match.start() for match in re.finditer(r'</([\w.-]+:)?robot\s*>', urdf))
    x_m, y_m, z_m = laser.xyz_m
    added = (
        f'<link name="{link}"/>'
        f'<joint name="added_{link}_joint" type="fixed">'
        f'<parent link={quoteattr(laser.parent)}/><child link="{link}"/>'
        f'<origin xyz="{x_m} {y_m} {z_m}" rpy="0 0 0"/>'
        '</joint>'
    )
    return urdf[:end] + added + urdf[end:]
