"""The simulated robot's state at one instant."""

from __future__ import annotations

from typing import NamedTuple, Tuple

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND


class JointStates(NamedTuple):
    """Angles and speeds of the joints, as their sensors would read them."""

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
    """Velocity of base_link over the floor, in the world frame."""

    x_mps: float
    y_mps: float
    yaw_radps: float


AT_REST = PlanarVelocity(0.0, 0.0, 0.0)


# One step of simulated time: /clock and /joint_states.
TICK_NS = 10_000_000
TICK_S = TICK_NS / NANOSECONDS_PER_SECOND
JOINTS_RATE_HZ = 1.0 / TICK_S

# /gazebo/model_states, the true pose that is made from it, and the commands of the scripted drive.
STATES_PERIOD_NS = 50_000_000
STATES_PERIOD_S = STATES_PERIOD_NS / NANOSECONDS_PER_SECOND
STATES_RATE_HZ = 1.0 / STATES_PERIOD_S
