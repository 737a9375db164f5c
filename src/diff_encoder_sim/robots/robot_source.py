"""Where a robot's description comes from: its file, xacro arguments, and folders of packages."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple, Tuple


class RobotSource(NamedTuple):
    """A robot's description as users name it: hashable, so that what is made of it can be cached."""

    file: Path  # xacro or URDF
    arguments: Tuple[Tuple[str, str], ...] = ()  # (name, value) of xacro:arg, in any order
    package_folders: Tuple[Path, ...] = ()  # packages, or folders that hold some
