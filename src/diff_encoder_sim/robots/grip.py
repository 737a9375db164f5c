"""How much the driven wheels can pass on to the floor."""

from __future__ import annotations

from typing import Sequence

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
    ahead_m = float(mass.com_m[0]) - wheels.axle_x_m
    side = 1.0 if ahead_m > 0 else -1.0
    arms_m = [side * (contact.point_m[0] - wheels.axle_x_m) for contact in contacts]
    arm_m = min((arm for arm in arms_m if arm > abs(ahead_m)), default=None)
    if arm_m is None:
        return MARGIN * G_MPS2
    height_m = max(0.0, float(mass.com_m[2]) - wheels.floor_z_m)
    share = max(LEAST_SHARE, 1.0 - abs(ahead_m) / arm_m)
    return MARGIN * G_MPS2 * share / (1.0 + height_m / arm_m)
