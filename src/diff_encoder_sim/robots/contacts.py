"""Ground contacts of a robot, its casters and supports, and its outline."""

from __future__ import annotations

import math
import re
from typing import AbstractSet, Dict, List, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.description import DriveTrain, Findings, GroundContact, RobotDescription, RobotTree
from diff_encoder_sim.robots.solids import Shape, Sphere, farthest_m, pose_at, reach_m, vector

_MOST_CORNERS = 16
_BEARINGS = 64  # tested for corners; a round robot's sides, halved twice, are 16
_CLOSE_M = 2e-3  # a side is dropped if its neighbours' corner is no farther out
_GRID_DECIMALS = 3
_ROUNDING_M = 10**-_GRID_DECIMALS * math.sqrt(0.5)  # how far rounding to the grid moves a corner at most
_SLACK_M = 1e-4  # of an rpy of 1.57 for pi / 2
_SAME = 1e-6  # m of a point, rad of a bearing
_TURN_RAD = 2 * math.pi

# How far above the floor a contact may end: a caster's clearance, rounded numbers. More if its name is a caster's.
NEAR_M = 0.005
NEAR_RADII = 0.1  # of the drive wheels
NAMED_RADII = 0.5
CASTER_NAMES = re.compile('caster|castor|ball|skid|wheel|support|roller|slider', re.IGNORECASE)

TILT = 1e-3  # rad, by which the front and the rear edge of a flat face are distinguished
SAME_HEIGHT_M = 1e-3
LONG_RADII = 1.0  # of the drive wheels: a longer part stands on its outer edge
SMALLEST_M = 2e-3  # a marker, not a body
BALANCED_M = 1e-3  # a point or a centre of mass that is nearer to the axle: it carries nothing, does not tip
LIFTED_M = 5e-4
TIPPED = 0.0175  # rad

_SHORTEST_ARM = 0.1  # of the wheel's radius: a contact that is closer to the axle cannot keep a robot from tipping
# How far the support on the light side hangs above the floor, of its distance from the axle: a robot that tips over
# onto it leans by 0.06 degrees, whatever its size. With both down, they and not the wheels might carry it. With 0.01 a
# robot balanced on its axle rocks by 0.6 degrees, by which its base frame 0.1 m above the axle is 0.1 % of a metre off.
_CLEARANCE = 0.001
_GAP_DECIMALS = 3  # of m: contacts within a millimetre are on the floor together
_SUPPORT_RADIUS = 0.5  # of the wheel's; any ball touches a floor in one point


def footprint_outline(shapes: Sequence[Shape], floor_z_m: float, where: str) -> Tuple[Tuple[float, float], ...]:
    """Return the outline of all shapes in the root, wheels and casters included, that rise above the floor.

    Each side is a bearing of its normal and its distance from the origin. Sides that matter least are dropped, one
    after another; their neighbours meet farther out. Points of the plane are complex numbers. Returns up to 16 corners
    (x, y) [m] in the root, counter-clockwise, in whole mm: convex, around everything.

    ConfigError if there is no such shape; `where`, the robot's file, begins the text.
    """
    above = [shape for shape in shapes if shape.support_point_m(np.array([0.0, 0.0, 1.0]))[2] > floor_z_m]
    if not above:
        raise ConfigError(f'{where}: given no collision shape above the floor; allowed: a <collision> in a link')

    def reaches_m(bearings_rad: np.ndarray) -> np.ndarray:
        return np.array([reach_m(above, np.array([math.cos(each), math.sin(each), 0.0])) for each in bearings_rad])

    tips_m = []
    for bearing_rad in (np.arange(_BEARINGS) + 0.5) * _TURN_RAD / _BEARINGS:
        out = np.array([math.cos(bearing_rad), math.sin(bearing_rad), 0.0])
        x_m, y_m, _ = max((shape.support_point_m(out) for shape in above), key=out.dot)
        tips_m.append(complex(x_m, y_m))
    _, normals_rad = _sides(np.array(tips_m))
    bearings_rad = np.sort(np.append(normals_rad, [0.0, math.pi / 2, math.pi, -math.pi / 2]) % _TURN_RAD)
    bearings_rad = bearings_rad[np.diff(bearings_rad, append=bearings_rad[0] + _TURN_RAD) > _SAME]
    distances_m = reaches_m(bearings_rad)
    while True:
        before, after = np.roll(bearings_rad, 1), np.roll(bearings_rad, -1)
        meetings_m = _crossings_m(before, np.roll(distances_m, 1), after, np.roll(distances_m, -1))
        growths_m = np.round(_ahead_m(meetings_m, bearings_rad) - distances_m, 9)
        growths_m[(after - before) % _TURN_RAD >= math.pi - _SAME] = np.inf  # neighbours that do not meet
        side = np.flatnonzero(growths_m == growths_m.min())[-1]  # a round robot keeps the sides along its axes
        if growths_m[side] > _CLOSE_M and len(bearings_rad) <= _MOST_CORNERS:
            break
        bearings_rad, distances_m = np.delete(bearings_rad, side), np.delete(distances_m, side)
    outline_m = _rounded(bearings_rad, distances_m)
    begins_m, normals_rad = _sides(outline_m)
    if (reaches_m(normals_rad) > _ahead_m(begins_m, normals_rad) + _SLACK_M).any():  # rounding has cut something off
        outline_m = _rounded(bearings_rad, distances_m + _ROUNDING_M)
    return tuple((corner_m.real + 0.0, corner_m.imag + 0.0) for corner_m in outline_m.tolist())  # no -0


def _sides(corners_m: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the begin (m,) of each side of an outline that has a length, and the bearing (m,) of its normal."""
    sides_m = np.roll(corners_m, -1) - corners_m
    is_long = np.abs(sides_m) > _SAME
    return corners_m[is_long], np.angle(-1j * sides_m[is_long])


def _ahead_m(points_m: np.ndarray, bearings_rad: np.ndarray) -> np.ndarray:
    """Return how far (n,) points lie in the directions of (n,) bearings."""
    return np.asarray(np.cos(bearings_rad) * points_m.real + np.sin(bearings_rad) * points_m.imag)


def _crossings_m(
    bearings_rad: np.ndarray, distances_m: np.ndarray, others_rad: np.ndarray, other_distances_m: np.ndarray
) -> np.ndarray:
    """Return the (n,) points on two lines each, a line given by its normal's bearing and its distance."""
    normals, others = (np.cos(each) + 1j * np.sin(each) for each in (bearings_rad, others_rad))
    with np.errstate(divide='ignore', invalid='ignore'):  # parallel lines, which the caller excludes
        crossings_m = -1j * (distances_m * others - other_distances_m * normals) / np.sin(others_rad - bearings_rad)
    return np.asarray(crossings_m)


def _rounded(bearings_rad: np.ndarray, distances_m: np.ndarray) -> np.ndarray:
    """Return the (n,) corners of neighbouring sides in whole mm, without those at which they do not turn left."""
    corners_m = _crossings_m(bearings_rad, distances_m, np.roll(bearings_rad, -1), np.roll(distances_m, -1))
    corners_m = np.round(corners_m, _GRID_DECIMALS)
    while True:
        sides_m = np.roll(corners_m, -1) - corners_m
        turns_left = (np.roll(sides_m, 1).conj() * sides_m).imag > _SAME**2
        if turns_left.all():
            return corners_m
        corners_m = np.delete(corners_m, np.argmin(turns_left))


def ground_contacts(tree: RobotTree, drive: DriveTrain, driven_links: AbstractSet[str]) -> Tuple[GroundContact, ...]:
    """Return what is near the floor, front to back: of each link at most one before and one behind the axle.

    `driven_links` are those of the driven wheels, with all links below them. Meshes of the tree are replaced.
    """
    others = [name for name in tree.poses if name not in driven_links]
    found = [contact for name in others for contact in _contacts_of(tree, name, drive)]
    # On each side of the axle those that are nearly as low as its lowest: no forks above casters.
    kept: List[GroundContact] = []
    for side in (1, -1):
        there = [each for each in found if side * (each.point_m[0] - drive.axle_x_m) > BALANCED_M]
        kept += [each for each in there if each.point_m[2] <= min(other.point_m[2] for other in there) + NEAR_M]
    return tuple(sorted(kept, key=lambda contact: -contact.point_m[0]))


def _contacts_of(tree: RobotTree, name: str, drive: DriveTrain) -> List[GroundContact]:
    """Return a link's contacts, by its collision shapes, or by its visual ones if it has none."""
    pose, link = tree.poses[name], tree.links[name]
    near_radii = NAMED_RADII if CASTER_NAMES.search(name) else NEAR_RADII
    most_z_m = drive.floor_z_m + max(NEAR_M, near_radii * drive.radius_m)
    found_m = [np.empty((0, 3))]
    for shape in link.collisions or link.visuals:
        in_root = shape.placed(pose)
        # The foremost and rearmost points of its lower side.
        points_m = np.array([in_root.support_point_m(np.array([tilt, 0.0, -1.0])) for tilt in (TILT, -TILT)])
        if points_m[:, 2].min() > most_z_m or farthest_m([in_root], in_root.pose_in_link[:3, 3]) < SMALLEST_M:
            continue
        if shape.corners_m is not None:
            points_m = shape.corners_m @ pose[:3, :3].T + pose[:3, 3]
        found_m.append(points_m[points_m[:, 2] <= most_z_m])
    low_m = np.vstack(found_m)
    # A caster trails behind its swivel forward and in front of it backward: its mean place is the swivel's, wherever
    # the file draws it.
    swivel = tree.swivel_above(name)
    if swivel is not None and len(low_m):
        return [GroundContact(name, vector(np.append(tree.poses[swivel.child][:2, 3], low_m[:, 2].min())))]
    # On each side of the axle the link stands in the middle of its low points, or at the outer edge.
    found: Dict[str, np.ndarray] = {}
    for word, side in (('front', 1), ('rear', -1)):
        there_m = low_m[side * (low_m[:, 0] - drive.axle_x_m) > BALANCED_M]
        if len(there_m):
            lowest_m = there_m[there_m[:, 2] <= there_m[:, 2].min() + SAME_HEIGHT_M]
            found[word] = 0.5 * (lowest_m.min(axis=0) + lowest_m.max(axis=0))
            found[word][2] = lowest_m[:, 2].min()
            if np.ptp(lowest_m[:, 0]) > LONG_RADII * drive.radius_m:
                found[word][0] = side * (side * lowest_m[:, 0]).max()
    is_one = len(found) == 1
    return [GroundContact(name if is_one else f'{name} ({word})', vector(found[word])) for word in found]


def support_balls(description: RobotDescription) -> Tuple[Shape, Shape]:
    """Return the balls on which the robot leans, in the root: before and behind the axle.

    The one on the centre of mass's side touches the floor, so that the robot stands level and on three points. Each is
    at the lowest contact of its side, of several the outermost; without any, at the footprint's end. Contacts side by
    side share the load so that its middle is below the centre of mass.
    """
    axle_x_m, radius_m, com_m = description.axle_x_m, _SUPPORT_RADIUS * description.radius_m, description.mass.com_m
    balls = []
    for side, is_down in ((1.0, com_m[0] >= axle_x_m), (-1.0, com_m[0] < axle_x_m)):
        arms = [  # length, y, gap to the floor [m]
            (side * (x_m - axle_x_m), y_m, round(z_m - description.floor_z_m, _GAP_DECIMALS))
            for _, (x_m, y_m, z_m) in description.contacts
            if side * (x_m - axle_x_m) > _SHORTEST_ARM * description.radius_m
        ]
        if arms:
            lowest_m = min(gap_m for _, _, gap_m in arms)
            lengths_m, across_m, _ = zip(*(arm for arm in arms if arm[2] == lowest_m))
            arm_m, y_m = max(lengths_m), min(max(float(com_m[1]), min(across_m)), max(across_m))
        else:
            end_m = max(side * (x_m - axle_x_m) for x_m, _ in description.footprint)
            arm_m, y_m = max(end_m, description.radius_m), float(com_m[1])
        z_m = description.floor_z_m + radius_m + (0.0 if is_down else _CLEARANCE * arm_m)
        balls.append(Shape(Sphere(radius_m), pose_at((axle_x_m + side * arm_m, y_m, z_m))))
    return balls[0], balls[1]


def judge_stance(contacts: Sequence[GroundContact], drive: DriveTrain, com_x_m: float, seen: Findings) -> None:
    """Warn of a robot that would tip, or whose casters carry it; `com_x_m` is the centre of mass in the root."""
    places = [(each.name, each.point_m[0] - drive.axle_x_m, each.point_m[2] - drive.floor_z_m) for each in contacts]
    for contact, (name, _, gap_m) in zip(contacts, places):
        seen.add('touches the floor', name, f'at x = {contact.point_m[0]:.4g} m, {1e3 * gap_m:+.1f} mm')
    if not contacts:
        seen.warn(
            'nothing but the drive wheels touches the floor (a balancing robot?): '
            'it is simulated with supports at both ends of its footprint'
        )
        return
    # How far below the wheels the line from a contact before to one behind the axle passes it.
    lifts = [
        (-(rear_gap + (gap - rear_gap) * -rear / (front - rear)), f'{front_name} and {rear_name}')
        for front_name, front, gap in places
        if front > BALANCED_M
        for rear_name, rear, rear_gap in places
        if rear < -BALANCED_M
    ]
    lifted_m, carriers = max(lifts, default=(0.0, ''))
    ahead_m = com_x_m - drive.axle_x_m
    side = 1 if ahead_m > 0 else -1
    carries = any(side * x_m > max(BALANCED_M, abs(gap_m) / TIPPED) for _, x_m, gap_m in places)
    if lifted_m > LIFTED_M:
        mm = f'{1e3 * lifted_m:.1f} mm'
        seen.warn(f'{carriers} would lift the drive wheels by {mm}: simulated level, with the wheels on the floor')
    elif abs(ahead_m) > BALANCED_M and not carries:
        place = 'ahead of' if side > 0 else 'behind'
        seen.warn(f'its centre of mass is {place} the axle, where nothing carries it: it would tip; simulated level')
