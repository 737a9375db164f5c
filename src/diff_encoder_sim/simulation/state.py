"""What the simulated robot reports of itself at one instant."""

from __future__ import annotations

from typing import NamedTuple, Tuple


class JointStates(NamedTuple):
    """What the joints' sensors would read."""

    stamp_ns: int
    names: Tuple[str, ...]
    angles_rad: Tuple[float, ...]
    speeds_radps: Tuple[float, ...]


class BodyState(NamedTuple):
    """Pose and twist of base_link in the world frame."""

    position_xyz_m: Tuple[float, float, float]
    quat_xyzw: Tuple[float, float, float, float]
    linear_xyz_mps: Tuple[float, float, float]
    angular_xyz_radps: Tuple[float, float, float]


class PlanarVelocity(NamedTuple):
    """How base_link moves over the floor, in the world frame."""

    x_mps: float
    y_mps: float
    yaw_radps: float


AT_REST = PlanarVelocity(0.0, 0.0, 0.0)
