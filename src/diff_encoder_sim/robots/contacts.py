"""What touches the floor besides the driven wheels, and the robot's outline on it."""

from __future__ import annotations

import math
import re
from typing import Callable, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.description import (
    Findings,
    GroundContact,
    OutlineXy,
    RobotDescription,
    RobotTree,
    Shape,
    Sphere,
)
from diff_encoder_sim.robots.rolling_wheels import is_upright, joints_above
from diff_encoder_sim.robots.solids import farthest_m, placed, reach_m, support_point_m

# How far above the floor a contact may end: a caster's clearance, rounded numbers. More where its name says caster.
NEAR_M = 0.005
NEAR_RADII = 0.1  # of the drive wheels
NAMED_RADII = 0.5
CASTER_NAMES = re.compile('caster|castor|ball|skid|wheel|support|roller|slider', re.IGNORECASE)

TILT = 1e-3  # rad, by which the front and the rear edge of a flat face are distinguished
SAME_HEIGHT_M = 1e-3
LONG_RADII = 1.0  # of the drive wheels: what is longer stands on its outer edge
SMALLEST_M = 2e-3  # a marker, not a body
BESIDE_AXLE_M = 1e-3  # what is nearer to the axle carries nothing

# Returns the (n, 3) points of a link's collision mesh in its link, by the link's name and the shape's number.
MeshPoints = Callable[[str, int], Optional[np.ndarray]]


class WheelBase(NamedTuple):
    """Where the drive wheels stand, in the root."""

    axle_x_m: float
    floor_z_m: float
    radius_m: float
    links: Tuple[str, ...]  # of the drive wheels, with all that hangs on them


def ground_contacts(tree: RobotTree, wheels: WheelBase, mesh_points: MeshPoints) -> Tuple[GroundContact, ...]:
    """Return what is near the floor, front to back: of each link at most one before and one behind the axle.

    Args:
        tree: the robot, meshes replaced.
        wheels: of the drive.
        mesh_points: what was replaced, for shapes that come near the floor.
    """
    contacts: List[GroundContact] = []
    for name, pose in tree.link_poses().items():
        if name not in wheels.links:
            contacts += _contacts(tree, name, _low_points_m(tree, name, pose, wheels, mesh_points), wheels)
    kept = _lowest(contacts, wheels, 1) + _lowest(contacts, wheels, -1)
    return tuple(sorted(kept, key=lambda contact: -contact.point_m[0]))


def _lowest(contacts: List[GroundContact], wheels: WheelBase, side: int) -> List[GroundContact]:
    """Return the contacts on a side of the axle that come nearly as low as its lowest: no forks above casters."""
    there = [contact for contact in contacts if side * (contact.point_m[0] - wheels.axle_x_m) > BESIDE_AXLE_M]
    lowest_m = min((contact.point_m[2] for contact in there), default=0.0)
    return [contact for contact in there if contact.point_m[2] <= lowest_m + NEAR_M]


def lowest_edges_m(shape: Shape) -> List[np.ndarray]:
    """Return the (3,) foremost and rearmost points of a shape's lower side."""
    return [support_point_m(shape, np.array([tilt, 0.0, -1.0])) for tilt in (TILT, -TILT)]


def _near_m(name: str, wheels: WheelBase) -> float:
    return max(NEAR_M, (NAMED_RADII if CASTER_NAMES.search(name) else NEAR_RADII) * wheels.radius_m)


def _low_points_m(
    tree: RobotTree, name: str, pose: np.ndarray, wheels: WheelBase, mesh_points: MeshPoints
) -> np.ndarray:
    """Return the (n, 3) points of a link near the floor: of its collision shapes, or of visual ones without these."""
    link, found_m = tree.links[name], [np.empty((0, 3))]
    highest_m = wheels.floor_z_m + _near_m(name, wheels)
    for number, shape in enumerate(link.collisions or link.visuals):
        in_root = placed(shape, pose)
        points_m = np.array(lowest_edges_m(in_root))
        if points_m[:, 2].min() > highest_m or farthest_m([in_root], in_root.pose_in_link[:3, 3]) < SMALLEST_M:
            continue
        mesh_m = mesh_points(name, number) if link.collisions else None
        if mesh_m is not None:
            points_m = mesh_m @ pose[:3, :3].T + pose[:3, 3]
        found_m.append(points_m[points_m[:, 2] <= highest_m])
    return np.vstack(found_m)


def _contacts(tree: RobotTree, name: str, points_m: np.ndarray, wheels: WheelBase) -> Iterator[GroundContact]:
    """Yield a link's contacts, by its (n, 3) points near the floor."""
    foot_m = _swivel_foot_m(tree, name)
    if foot_m is not None and len(points_m):
        yield _contact(name, np.append(foot_m[:2], points_m[:, 2].min()))
        return
    sides = [_carrying_point_m(points_m, wheels, side) for side in (1, -1)]
    for side_name, point_m in zip(('front', 'rear'), sides):
        if point_m is not None:
            yield _contact(name if any(other is None for other in sides) else f'{name} ({side_name})', point_m)


def _carrying_point_m(points_m: np.ndarray, wheels: WheelBase, side: int) -> Optional[np.ndarray]:
    """Return where a link's (n, 3) points carry it on one side of the axle: in their middle, or at the outer edge."""
    there_m = points_m[side * (points_m[:, 0] - wheels.axle_x_m) > BESIDE_AXLE_M]
    if len(there_m) == 0:
        return None
    low_m = there_m[there_m[:, 2] <= there_m[:, 2].min() + SAME_HEIGHT_M]
    middle_m = 0.5 * (low_m.min(axis=0) + low_m.max(axis=0))
    if np.ptp(low_m[:, 0]) > LONG_RADII * wheels.radius_m:
        middle_m[0] = side * (side * low_m[:, 0]).max()
    return np.append(middle_m[:2], low_m[:, 2].min())


def _swivel_foot_m(tree: RobotTree, link: str) -> Optional[np.ndarray]:
    """Return the (3,) origin of the swivel that a link hangs on, in the root.

    A caster trails behind its swivel forward and in front of it backward: its mean place is the swivel's, wherever the
    file draws it.
    """
    swivel = next((joint for joint in joints_above(tree, link) if is_upright(tree, joint)), None)
    return None if swivel is None else np.asarray(tree.link_poses()[swivel.child][:3, 3])


def _contact(name: str, point_m: np.ndarray) -> GroundContact:
    x_m, y_m, z_m = point_m.tolist()
    return GroundContact(name, (x_m, y_m, z_m))


# A contact that is closer to the axle cannot keep a robot from tipping. Of the wheel's radius.
_SHORTEST_ARM = 0.1
# How far the support on the light side hangs above the floor, of its distance from the axle: a robot that tips over
# onto it leans by 0.06 degrees, whatever its size. With both down, they and not the wheels might carry it. With 0.01 a
# robot balanced on its axle rocks by 0.6 degrees, by which its base frame 0.1 m above the axle is 0.1 % of a metre off.
_CLEARANCE = 0.001
_GAP_DECIMALS = 3  # of m: contacts within a millimetre are on the floor together
_SUPPORT_RADIUS = 0.5  # of the wheel's; any ball touches a floor in one point


class _Arm(NamedTuple):
    """A contact as a lever about the axle."""

    length_m: float
    y_m: float
    gap_m: float  # to the floor


def support_balls(description: RobotDescription) -> Tuple[Shape, Shape]:
    """Return the balls on which the robot leans, in the root: before and behind the axle.

    The one on the centre of mass's side touches the floor, so that the robot stands level and on three points.
    """
    front = _support(description, 1.0, description.mass.com_m[0] >= description.axle_x_m)
    rear = _support(description, -1.0, description.mass.com_m[0] < description.axle_x_m)
    return front, rear


def _support(description: RobotDescription, side: float, is_down: bool) -> Shape:
    arm_m, y_m = _place(description, side)
    radius_m = _SUPPORT_RADIUS * 0.5 * description.wheel_diameter_m
    pose = np.eye(4)
    pose[:3, 3] = (
        description.axle_x_m + side * arm_m,
        y_m,
        description.floor_z_m + radius_m + (0.0 if is_down else _CLEARANCE * arm_m),
    )
    return Shape(Sphere(radius_m), pose)


def _place(description: RobotDescription, side: float) -> Tuple[float, float]:
    """Return the support's distance from the axle [m] and its y [m].

    It is where the lowest contact of this side is, of several the outermost; without any, at the footprint's end.
    Contacts side by side share the load so that its middle is below the centre of mass.
    """
    com_y_m = float(description.mass.com_m[1])
    arms = [_arm(description, contact, side) for contact in description.contacts]
    reaching = [arm for arm in arms if arm.length_m > _SHORTEST_ARM * 0.5 * description.wheel_diameter_m]
    if not reaching:
        end_m = max(side * (x_m - description.axle_x_m) for x_m, _ in description.footprint)
        return max(end_m, 0.5 * description.wheel_diameter_m), com_y_m
    lowest_m = min(arm.gap_m for arm in reaching)
    lowest = [arm for arm in reaching if arm.gap_m == lowest_m]
    across_m = [arm.y_m for arm in lowest]
    return max(arm.length_m for arm in lowest), min(max(com_y_m, min(across_m)), max(across_m))


def _arm(description: RobotDescription, contact: GroundContact, side: float) -> _Arm:
    x_m, y_m, z_m = contact.point_m
    gap_m = round(z_m - description.floor_z_m, _GAP_DECIMALS)
    return _Arm(side * (x_m - description.axle_x_m), y_m, gap_m)


BALANCED_M = 1e-3  # centre of mass this near the axle
LIFTED_M = 5e-4
TIPPED_DEG = 1.0


def judge_stance(contacts: Sequence[GroundContact], wheels: WheelBase, com_x_m: float, seen: Findings) -> None:
    """Warn of a robot that would tip, or whose casters carry it.

    Args:
        contacts: from ground_contacts.
        wheels: of the drive.
        com_x_m: the centre of mass in the root.
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
        arms_m = [side * (contact.point_m[0] - wheels.axle_x_m) for contact in contacts]
        arm_m, gap_m = max(
            (
                (arm, contact.point_m[2] - wheels.floor_z_m)
                for arm, contact in zip(arms_m, contacts)
                if arm > BALANCED_M
            ),
            key=lambda arm_and_gap: arm_and_gap[0] / max(arm_and_gap[1], 1e-9),
            default=(0.0, 0.0),
        )
        place = f'its centre of mass is {"ahead of" if side > 0 else "behind"} the axle'
        if arm_m == 0.0:
            seen.warn(f'{place}, where nothing touches the floor: it would tip over; simulated level')
        elif math.degrees(math.atan2(abs(gap_m), arm_m)) > TIPPED_DEG:
            seen.warn(f'{place}: it would tip until a contact {1e3 * gap_m:.0f} mm up carries it; simulated level')


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


_MOST_CORNERS = 16
_BEARINGS = 64  # in which corners are looked for; a round robot's sides, halved twice, are 16
_CLOSE_M = 2e-3  # a side goes where its neighbours' corner is no farther out
_GRID_DECIMALS = 3
# How far rounding to the grid moves a corner at most.
_ROUNDING_M = 10**-_GRID_DECIMALS * math.sqrt(0.5)
_SLACK_M = 1e-4  # of an rpy of 1.57 for pi / 2
_SAME = 1e-6  # m of a point, rad of a bearing
_UP = np.array([0.0, 0.0, 1.0])


def footprint_outline(shapes: Sequence[Shape], floor_z_m: float, where: str) -> OutlineXy:
    """Return the outline of all shapes that rise above the floor.

    Args:
        shapes: collision shapes without meshes, wheels and casters included, in the root.
        floor_z_m: the floor in the root.
        where: begins the error: the robot's file.

    Returns:
        Up to 16 corners (x, y) [m] in the root, counter-clockwise, in whole mm: convex, around everything.

    Raises:
        ConfigError: there is no such shape.
    """
    above = [shape for shape in shapes if support_point_m(shape, _UP)[2] > floor_z_m]
    if not above:
        raise ConfigError(f'{where}: given no collision shape above the floor; allowed: a <collision> in a link')
    bearings_rad = _side_bearings_rad(above)
    reaches_m = _reaches_m(above, bearings_rad)
    while True:
        side = _needless_side(bearings_rad, reaches_m)
        if side is None:
            break
        bearings_rad, reaches_m = np.delete(bearings_rad, side), np.delete(reaches_m, side)
    outline_m = _convex(np.round(_corners_m(bearings_rad, reaches_m), _GRID_DECIMALS))
    if not _holds(outline_m, above):
        outline_m = _convex(np.round(_corners_m(bearings_rad, reaches_m + _ROUNDING_M), _GRID_DECIMALS))
    return tuple((float(x_m), float(y_m)) for x_m, y_m in outline_m + 0.0)  # no -0


def _side_bearings_rad(shapes: Sequence[Shape]) -> np.ndarray:
    """Return the (n,) bearings, rising, of the normals of the outline's sides; those of the axes are among them."""
    step_rad = 2 * math.pi / _BEARINGS
    tips_m = np.array([_tip_m(shapes, (index + 0.5) * step_rad) for index in range(_BEARINGS)])
    sides_m = np.roll(tips_m, -1, axis=0) - tips_m
    sides_m = sides_m[np.hypot(sides_m[:, 0], sides_m[:, 1]) > _SAME]
    normals_rad = np.append(np.arctan2(-sides_m[:, 0], sides_m[:, 1]), [0.0, math.pi / 2, math.pi, -math.pi / 2])
    bearings_rad = np.sort(normals_rad % (2 * math.pi))
    steps_rad = np.diff(bearings_rad, append=bearings_rad[0] + 2 * math.pi)
    return np.asarray(bearings_rad[steps_rad > _SAME])


def _tip_m(shapes: Sequence[Shape], bearing_rad: float) -> np.ndarray:
    """Return the (2,) point of all shapes that is farthest out in a bearing."""
    direction = _direction(bearing_rad)
    return max((support_point_m(shape, direction) for shape in shapes), key=direction.dot)[:2]


def _reaches_m(shapes: Sequence[Shape], bearings_rad: np.ndarray) -> np.ndarray:
    """Return how far the shapes reach in each of (n,) bearings."""
    return np.array([reach_m(shapes, _direction(bearing_rad)) for bearing_rad in bearings_rad])


def _needless_side(bearings_rad: np.ndarray, reaches_m: np.ndarray) -> Optional[int]:
    """Return the side whose neighbours' corner is closest to it, if it is close or corners are too many."""
    before_rad, after_rad = np.roll(bearings_rad, 1), np.roll(bearings_rad, -1)
    corners_m = _crossings_m(before_rad, np.roll(reaches_m, 1), after_rad, np.roll(reaches_m, -1))
    growths_m = np.cos(bearings_rad) * corners_m[:, 0] + np.sin(bearings_rad) * corners_m[:, 1] - reaches_m
    meets = (after_rad - before_rad) % (2 * math.pi) < math.pi - _SAME
    growths_m = np.where(meets, np.round(growths_m, 9), np.inf)
    side = int(np.flatnonzero(growths_m == growths_m.min())[-1])  # a round robot keeps the sides along its axes
    return side if growths_m[side] <= _CLOSE_M or len(bearings_rad) > _MOST_CORNERS else None


def _corners_m(bearings_rad: np.ndarray, reaches_m: np.ndarray) -> np.ndarray:
    """Return the (n, 2) corners in which each side meets the next."""
    return _crossings_m(bearings_rad, reaches_m, np.roll(bearings_rad, -1), np.roll(reaches_m, -1))


def _crossings_m(
    bearings_rad: np.ndarray, reaches_m: np.ndarray, others_rad: np.ndarray, other_reaches_m: np.ndarray
) -> np.ndarray:
    """Return the (n, 2) points on two lines each, a line given by its normal's bearing and its distance."""
    x_m = reaches_m * np.sin(others_rad) - other_reaches_m * np.sin(bearings_rad)
    y_m = other_reaches_m * np.cos(bearings_rad) - reaches_m * np.cos(others_rad)
    sines = np.sin(others_rad - bearings_rad)
    with np.errstate(divide='ignore', invalid='ignore'):  # parallel lines: not asked for
        return np.asarray(np.stack([x_m, y_m], axis=1) / sines[:, None])


def _convex(corners_m: np.ndarray) -> np.ndarray:
    """Return (n, 2) corners without those at which the outline does not turn left, which only makes it larger."""
    kept: List[np.ndarray] = list(corners_m)
    index = 0
    while index < len(kept):
        before_m, here_m, after_m = kept[index - 1], kept[index], kept[(index + 1) % len(kept)]
        (in_x, in_y), (out_x, out_y) = here_m - before_m, after_m - here_m
        if in_x * out_y - in_y * out_x > _SAME**2:
            index += 1
        else:
            del kept[index]
            index = max(index - 1, 0)
    return np.array(kept)


def _holds(outline_m: np.ndarray, shapes: Sequence[Shape]) -> bool:
    """Say whether all shapes are inside an outline of (n, 2) corners."""
    sides_m = np.roll(outline_m, -1, axis=0) - outline_m
    bearings_rad = np.arctan2(-sides_m[:, 0], sides_m[:, 1])
    outs_m = np.cos(bearings_rad) * outline_m[:, 0] + np.sin(bearings_rad) * outline_m[:, 1]
    return bool((_reaches_m(shapes, bearings_rad) <= outs_m + _SLACK_M).all())


def _direction(bearing_rad: float) -> np.ndarray:
    """Return the level (3,) unit vector in a bearing."""
    return np.array([math.cos(bearing_rad), math.sin(bearing_rad), 0.0])
