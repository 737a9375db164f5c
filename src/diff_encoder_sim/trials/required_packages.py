"""Other ROS packages that a launch argument asks for: which they are, and how to get them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple, Tuple

from diff_encoder_sim.base.errors import ConfigError

# roslaunch's options that start nothing.
LISTING_OPTIONS = (b'--nodes', b'--files', b'--find-node', b'--args', b'--dump-params')


class OtherPackages(NamedTuple):
    """What one launch argument needs."""

    argument: str  # name and value, as users know them
    value: str
    packages: Tuple[str, ...]
    install_hint: str


UPSTREAM_NAVIGATION = OtherPackages(
    'nav',
    'upstream',
    ('map_server', 'amcl', 'move_base', 'dwa_local_planner'),
    "apt install ros-noetic-navigation (not in Debian's ROS), or nav:=embedded",
)
UPSTREAM_SLAM = OtherPackages(
    'slam', 'upstream', ('gmapping',), "apt install ros-noetic-gmapping (not in Debian's ROS), or slam:=embedded"
)
GAZEBO = OtherPackages('sim', 'gazebo', ('gazebo_ros',), 'apt install ros-noetic-gazebo-ros-pkgs, or sim:=pybullet')


def require(needed: OtherPackages) -> None:
    """Check that the packages are installed, before anything starts.

    Raises:
        ConfigError: one is not; the line names all that are missing and how to get them.
    """
    missing = [package for package in needed.packages if not _is_installed(package)]
    if missing:
        raise ConfigError(
            f'{needed.argument}: given {needed.value}, but {", ".join(missing)} '
            f'{"is" if len(missing) == 1 else "are"} not installed: {needed.install_hint}'
        )


def roslaunch_only_lists() -> bool:
    """Whether this is a command of a roslaunch that lists nodes or files and starts nothing."""
    try:
        words = Path(f'/proc/{os.getppid()}/cmdline').read_bytes().split(b'\0')
    except OSError:
        return False
    return any(b'roslaunch' in word for word in words) and any(word.startswith(LISTING_OPTIONS) for word in words)


def _is_installed(package: str) -> bool:
    import rospkg  # not where the core runs without ROS

    try:
        rospkg.RosPack().get_path(package)
    except rospkg.ResourceNotFound:
        return False
    return True
