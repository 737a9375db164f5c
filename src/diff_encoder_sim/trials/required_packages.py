"""ROS packages required by certain launch arguments, with installation hints."""

from __future__ import annotations

from typing import NamedTuple, Tuple

from diff_encoder_sim.base.errors import ConfigError


class RequiredPackages(NamedTuple):
    """The packages that one value of a launch argument needs."""

    given: str  # argument and value, as in errors
    packages: Tuple[str, ...]
    install_hint: str


UPSTREAM_NAVIGATION = RequiredPackages(
    'nav: given upstream',
    ('map_server', 'amcl', 'move_base', 'dwa_local_planner'),
    "apt install ros-noetic-navigation (not in Debian's ROS), or nav:=embedded",
)
UPSTREAM_SLAM = RequiredPackages(
    'slam: given upstream', ('gmapping',), "apt install ros-noetic-gmapping (not in Debian's ROS), or slam:=embedded"
)
UPSTREAM_FUSION = RequiredPackages(
    'fusion: given upstream',
    ('robot_localization',),
    "apt install ros-noetic-robot-localization (not in Debian's ROS), or fusion:=embedded",
)
UPSTREAM = {'nav': UPSTREAM_NAVIGATION, 'slam': UPSTREAM_SLAM, 'fusion': UPSTREAM_FUSION}  # by launch argument
GAZEBO = RequiredPackages(
    'sim: given gazebo', ('gazebo_ros',), 'apt install ros-noetic-gazebo-ros-pkgs, or sim:=pybullet'
)


def require(needed: RequiredPackages) -> None:
    """Check that the packages are installed; otherwise ConfigError with their names and how to install them."""
    import rospkg  # noqa: PLC0415  # missing if the core runs without ROS

    installed = rospkg.RosPack().list()
    missing = [package for package in needed.packages if package not in installed]
    if missing:
        are = 'is' if len(missing) == 1 else 'are'
        raise ConfigError(f'{needed.given}, but {", ".join(missing)} {are} not installed: {needed.install_hint}')
