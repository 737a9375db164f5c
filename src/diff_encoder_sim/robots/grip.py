"""Accelerations that the grip of the driven wheels and the torque of the motors allow."""

from __future__ import annotations

from typing import NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.robots.ground_contacts import WheelBase
from diff_encoder_sim.robots.robot_description import GroundContact, MassProperties

G_MPS2 = 9.81
LEAST_SHARE = 0.1
MARGIN = 0.5  # of the grip: braking and bumps need the rest


def most_torque_nm(mass_kg: float, wheel_radius_m: float) -> float:
    """Return the torque at which one wheel would slip if it carried the whole robot on a floor of friction 1."""
    return mass_kg * G_MPS2 * wheel_radius_m


def sensible_acceleration_mps2(mass: MassProperties, contacts: Sequence[GroundContact], wheels: WheelBase) -> float:
    """Return half of the acceleration at which the wheels slip on a floor of friction 1.

    The robot leans on the contact on its centre of mass's side, at c from the axle; the centre of mass is d from the
    axle on that side, and h above the floor. The wheels carry 1 - d / c of the weight, less m a h / c when accelerating
    away from that contact: so a = g (1 - d / c) / (1 + h / c).
    """
    load = _load(mass, contacts, wheels)
    if load.arm_m is None:
        return MARGIN * G_MPS2
    height_m = max(0.0, float(mass.com_m[2]) - wheels.floor_z_m)
    return MARGIN * G_MPS2 * load.share / (1.0 + height_m / load.arm_m)


def sensible_turn_acceleration_radps2(
    mass: MassProperties, contacts: Sequence[GroundContact], wheels: WheelBase, separation_m: float
) -> float:
    """Return half of the angular acceleration in place at which the wheels slip on a floor of friction 1.

    Both wheels push with half of their load m g (1 - d / c), at L / 2 from the axle's middle.
    """
    force_n = MARGIN * G_MPS2 * mass.mass_kg * _load(mass, contacts, wheels).share
    return force_n * 0.5 * separation_m / turning_inertia_kgm2(mass, wheels)


def torque_accelerations(
    torque_nm: float, mass: MassProperties, wheels: WheelBase, separation_m: float
) -> Tuple[float, float]:
    """Return half of the acceleration [m/s^2] and angular acceleration [rad/s^2] that two motors can give the body."""
    force_n = MARGIN * 2.0 * torque_nm / wheels.radius_m
    return force_n / mass.mass_kg, force_n * 0.5 * separation_m / turning_inertia_kgm2(mass, wheels)


def turning_inertia_kgm2(mass: MassProperties, wheels: WheelBase) -> float:
    """Return the moment of inertia about the upright axis through the axle's middle, which lies on y = 0."""
    x_m, y_m = float(mass.com_m[0]) - wheels.axle_x_m, float(mass.com_m[1])
    return float(mass.inertia_kgm2[2, 2]) + mass.mass_kg * (x_m**2 + y_m**2)


class _Load(NamedTuple):
    """How the robot leans on a contact."""

    share: float  # of the weight, on the driven wheels at rest
    arm_m: Optional[float]  # of that contact from the axle; None without one


def _load(mass: MassProperties, contacts: Sequence[GroundContact], wheels: WheelBase) -> _Load:
    ahead_m = float(mass.com_m[0]) - wheels.axle_x_m
    side = 1.0 if ahead_m > 0 else -1.0
    arms_m = [side * (contact.point_m[0] - wheels.axle_x_m) for contact in contacts]
    arm_m = min((arm for arm in arms_m if arm > abs(ahead_m)), default=None)
    return _Load(1.0 if arm_m is None else max(LEAST_SHARE, 1.0 - abs(ahead_m) / arm_m), arm_m)
