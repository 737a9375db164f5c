"""How the robot of the file would stand on its contacts, in words: the simulated one stands level."""

from __future__ import annotations

import math
from typing import Iterator, List, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.robots.findings import Findings
from diff_encoder_sim.robots.ground_contacts import WheelBase, lowest_edges_m
from diff_encoder_sim.robots.robot_description import GroundContact
from diff_encoder_sim.robots.robot_tree import Shape

BALANCED_M = 1e-3  # centre of mass this near the axle
LIFTED_M = 5e-4
TIPPED_DEG = 1.0

NamedShapes = Sequence[Tuple[str, Shape]]


def judge_stance(
    contacts: Sequence[GroundContact], wheels: WheelBase, com_x_m: float, hull: NamedShapes, seen: Findings
) -> None:
    """Warn of a robot that would tip, or whose casters carry it.

    Args:
        contacts: from ground_contacts.
        wheels: of the drive.
        com_x_m: the centre of mass in the root.
        hull: all shapes but the wheels', in the root, with their links.
        seen: takes the warnings.
    """
    for contact in contacts:
        below_m = contact.point_m[2] - wheels.floor_z_m
        seen.add('touches the floor', contact.name, f'at x = {contact.point_m[0]:.4g} m, {1e3 * below_m:+.1f} mm')
    if not contacts:
        seen.warn(
            'nothing but the drive wheels touches the floor (a balancing robot?): '
            'it is simulated with supports at both ends of its footprint'
        )
        return
    lifted_m, carriers = _carriers(contacts, wheels)
    if lifted_m > LIFTED_M:
        seen.warn(
            f'{" and ".join(carriers)} would lift the drive wheels by {1e3 * lifted_m:.1f} mm: '
            'simulated level, with the wheels on the floor'
        )
    ahead_m = com_x_m - wheels.axle_x_m
    side = 1 if ahead_m > 0 else -1
    if abs(ahead_m) > BALANCED_M and lifted_m <= LIFTED_M:
        _judge_side(contacts, wheels, side, hull, seen)


def tip_deg(point_m: np.ndarray, wheels: WheelBase) -> Optional[float]:
    """Return by how much the robot turns about its axle until a (3,) point touches the floor; None: never.

    On its way down the point keeps its distance from the axle; negative where it is below the floor.
    """
    axle_z_m = wheels.floor_z_m + wheels.radius_m
    along_m, below_m = abs(float(point_m[0]) - wheels.axle_x_m), axle_z_m - float(point_m[2])
    arm_m = math.hypot(along_m, below_m)
    if arm_m < wheels.radius_m:
        return None
    return math.degrees(math.asin(wheels.radius_m / arm_m) - math.atan2(below_m, along_m))


def _judge_side(
    contacts: Sequence[GroundContact], wheels: WheelBase, side: int, hull: NamedShapes, seen: Findings
) -> None:
    """Warn where the side on which the robot leans has no contact, or one off the floor."""
    points = [(contact.name, np.array(contact.point_m)) for contact in contacts]
    on_contact = list(_tips(points, wheels, side))
    edges = [(name, point) for name, shape in hull for point in lowest_edges_m(shape)]
    tips = on_contact or list(_tips(edges, wheels, side))
    where = f'its centre of mass is {"ahead of" if side > 0 else "behind"} the axle'
    if not tips:
        seen.warn(f'{where}, where nothing holds it: it would tip over; simulated level')
        return
    angle_deg, name = min(tips)
    if not on_contact:
        seen.warn(
            f'{where}, where nothing touches the floor: it would tip by {angle_deg:.0f} degrees onto {name}; '
            'simulated level'
        )
    elif abs(angle_deg) > TIPPED_DEG:
        seen.warn(f'{where}: it would tip by {angle_deg:.1f} degrees until {name} carries it; simulated level')


def _tips(points: Sequence[Tuple[str, np.ndarray]], wheels: WheelBase, side: int) -> Iterator[Tuple[float, str]]:
    """Yield the angle to the floor of each point on a side of the axle, with its name."""
    for name, point_m in points:
        angle_deg = tip_deg(point_m, wheels)
        if side * (point_m[0] - wheels.axle_x_m) > BALANCED_M and angle_deg is not None:
            yield angle_deg, name


def _carriers(contacts: Sequence[GroundContact], wheels: WheelBase) -> Tuple[float, List[str]]:
    """Return how far two contacts, one before and one behind the axle, lift the wheels, and their names."""
    front = [contact for contact in contacts if contact.point_m[0] > wheels.axle_x_m + BALANCED_M]
    rear = [contact for contact in contacts if contact.point_m[0] < wheels.axle_x_m - BALANCED_M]
    lifts = [(_lift_m(a, b, wheels), [a.name, b.name]) for a in front for b in rear]
    return max(lifts, default=(0.0, []))


def _lift_m(front: GroundContact, rear: GroundContact, wheels: WheelBase) -> float:
    """Return how far below the wheels the line from contact to contact passes the axle."""
    (front_x, _, front_z), (rear_x, _, rear_z) = front.point_m, rear.point_m
    at_axle_m = rear_z + (front_z - rear_z) * (wheels.axle_x_m - rear_x) / (front_x - rear_x)
    return wheels.floor_z_m - at_axle_m
