"""Where a robot's description comes from: its file, xacro arguments, and folders of packages."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple, Optional, Tuple

from diff_encoder_sim.robots.added_laser import AddedLaser


class RobotSource(NamedTuple):
    """A robot's description as users name it: hashable, so that what is made of it can be cached."""

    file: Path  # xacro or URDF
    arguments: Tuple[Tuple[str, str], ...] = ()  # (name, value) of xacro:arg, in any order
    package_folders: Tuple[Path, ...] = ()  # packages, or folders that hold some
    added_laser: Optional[AddedLaser] = None  # None: the scanner is the URDF's
