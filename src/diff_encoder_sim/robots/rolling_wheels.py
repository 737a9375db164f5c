"""The wheels of a robot: links that turn without end about a level axis and have a shape that rolls."""

from __future__ import annotations

import math
import re
from itertools import combinations
from typing import FrozenSet, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.robots.description import Cylinder, Joint, RobotTree, Shape
from diff_encoder_sim.robots.solids import placed, rolling_radius_m

LEVEL = 0.17  # an axis' vertical part (10 degrees), below which a wheel can stand on it
UPRIGHT = 0.9  # an axis' vertical part, above which a joint swivels
SAME_RADIUS = 0.01  # shapes of one wheel: twin tyres, a tyre and its rim
PASSIVE = re.compile('caster|castor|idler|passive|support|roller|ball', re.IGNORECASE)
NEAR_FLOOR = 0.35  # of its radius: how far above the lowest wheel a wheel may end


class RollingWheel(NamedTuple):
    """A link that can roll on the floor, driven or not."""

    joint: str
    link: str
    centre_m: np.ndarray  # (3,) of the rolling shape, in the root
    axis: np.ndarray  # (3,) the joint's unit axis, in the root
    radius_m: Optional[float]  # None: no shape of it rolls
    shape: str  # where the radius is from: 'collision cylinder'
    swivel: Optional[str]  # the upright joint above it, which steers it or lets it trail

    @property
    def bottom_m(self) -> float:
        """Return the height in the root at which it touches the floor."""
        return float(self.centre_m[2]) - (self.radius_m or 0.0)


def rolling_wheels(tree: RobotTree) -> Tuple[RollingWheel, ...]:
    """Return the wheels near the floor, in the file's order: none of an arm, no spinning scanner."""
    joints = (joint for joint in tree.joints.values() if spins(tree, joint))
    found = [wheel for wheel in (wheel_of(tree, joint) for joint in joints) if wheel.radius_m is not None]
    level = [wheel for wheel in found if abs(wheel.axis[2]) < LEVEL]
    floor_m = min((wheel.bottom_m for wheel in level), default=0.0)
    return tuple(wheel for wheel in level if wheel.bottom_m < floor_m + NEAR_FLOOR * (wheel.radius_m or 0.0))


def wheel_joints(tree: RobotTree, wheels: Sequence[RollingWheel]) -> FrozenSet[str]:
    """Return the joints that can drive the robot: those of wheels that neither swivel nor are casters.

    Without two of these (wheels may lack a round shape) all joints count that spin about a level axis.

    Args:
        tree: the robot.
        wheels: from rolling_wheels.
    """
    fixed = frozenset(wheel.joint for wheel in without_casters([each for each in wheels if each.swivel is None]))
    if len(fixed) > 1:
        return fixed
    return frozenset(
        joint.name
        for joint in tree.joints.values()
        if spins(tree, joint) and abs(wheel_of(tree, joint).axis[2]) < LEVEL
    )


def without_casters(wheels: Sequence[RollingWheel]) -> List[RollingWheel]:
    """Leave out wheels that are casters by name, where two others remain."""
    driven = [wheel for wheel in wheels if not PASSIVE.search(f'{wheel.joint} {wheel.link}')]
    return driven if len(driven) >= 2 else [*wheels]


def spins(tree: RobotTree, joint: Joint) -> bool:
    """Return whether a joint turns without end: continuous, or revolute with limits of a turn or more."""
    return joint.kind == 'continuous' or (joint.kind == 'revolute' and turning_range_rad(tree, joint) >= 2.0 * math.pi)


def turning_range_rad(tree: RobotTree, joint: Joint) -> float:
    """Return the angle between a joint's limits."""
    limit = next((each.find('limit') for each in tree.xml.findall('joint') if each.get('name') == joint.name), None)
    try:
        return math.inf if limit is None else float(limit.get('upper', 'inf')) - float(limit.get('lower', '-inf'))
    except ValueError:
        return math.inf


def wheel_of(tree: RobotTree, joint: Joint) -> RollingWheel:
    """Return the wheel that a joint turns."""
    pose = tree.link_poses()[joint.child]
    radius_m, centre_m, shape = _rolling_shape(tree, joint)
    centre_in_root_m = pose[:3, :3] @ centre_m + pose[:3, 3]
    swivel = next((above.name for above in joints_above(tree, joint.parent) if is_upright(tree, above)), None)
    return RollingWheel(joint.name, joint.child, centre_in_root_m, pose[:3, :3] @ joint.axis, radius_m, shape, swivel)


def joints_above(tree: RobotTree, link: str) -> Iterator[Joint]:
    """Yield the joints from a link up to the root."""
    above = tree.joint_above(link)
    while above is not None:
        yield above
        above = tree.joint_above(above.parent)


def is_upright(tree: RobotTree, joint: Joint) -> bool:
    """Return whether a joint turns about an upright axis."""
    turns = joint.kind in ('continuous', 'revolute')
    return turns and abs((tree.link_poses()[joint.child][:3, :3] @ joint.axis)[2]) > UPRIGHT


def rigid_links(tree: RobotTree, link: str) -> Iterator[str]:
    """Yield a link and those fixed to it from below."""
    yield link
    for joint in tree.joints.values():
        if joint.parent == link and joint.kind == 'fixed':
            yield from rigid_links(tree, joint.child)


def _rolling_shape(tree: RobotTree, joint: Joint) -> Tuple[Optional[float], np.ndarray, str]:
    """Return radius, centre (3,) in the wheel's link, and source: of the largest shape that rolls, collision first."""
    poses = tree.link_poses()
    to_wheel = np.linalg.inv(poses[joint.child])
    for kind in ('collision', 'visual'):
        shapes: List[Shape] = []
        for name in rigid_links(tree, joint.child):
            link = tree.links[name]
            shapes += [
                placed(s, to_wheel @ poses[name]) for s in (link.collisions if kind == 'collision' else link.visuals)
            ]
        rolling = [(rolling_radius_m(shape, joint.axis) or 0.0, shape) for shape in shapes]
        radius_m = max((radius for radius, _ in rolling), default=0.0)
        if radius_m > 0.0:
            largest = [shape for radius, shape in rolling if radius > (1.0 - SAME_RADIUS) * radius_m]
            width_m = min(_width_m(shape) for shape in largest)
            # A mesh's tread is narrower than the wheel with its motor; twin tyres are equally wide.
            largest = [shape for shape in largest if _width_m(shape) <= (1.0 + SAME_RADIUS) * width_m]
            centre_m = np.mean([shape.pose_in_link[:3, 3] for shape in largest], axis=0)
            return radius_m, centre_m, f'{kind} {type(largest[0].geometry).__name__.lower()}'
    return None, np.zeros(3), 'no rolling shape'


def _width_m(shape: Shape) -> float:
    return shape.geometry.length_m if isinstance(shape.geometry, Cylinder) else 0.0


PARALLEL = 0.995  # cosine
OFF_LINE = 0.1  # of the radius: how far a wheel may be off the other's axis
LIKE_RADIUS = 0.05
LEAST_SEPARATION = 0.2  # of the radius


class WheelPair(NamedTuple):
    """Two wheels, the left one at the larger y."""

    left: RollingWheel
    right: RollingWheel

    @property
    def joints(self) -> List[str]:
        """Return the joints' names, left first."""
        return [self.left.joint, self.right.joint]

    @property
    def radius_m(self) -> float:
        """Return the mean radius."""
        return 0.5 * ((self.left.radius_m or 0.0) + (self.right.radius_m or 0.0))


def coaxial_pairs(wheels: Iterable[RollingWheel]) -> List[WheelPair]:
    """Return all pairs of like wheels on one axle; of three on one axle, three pairs."""
    return [left_first(a, b) for a, b in combinations(wheels, 2) if are_coaxial(a, b)]


def left_first(a: RollingWheel, b: RollingWheel) -> WheelPair:
    """Return two wheels as a pair."""
    return WheelPair(a, b) if a.centre_m[1] >= b.centre_m[1] else WheelPair(b, a)


def are_parallel(a: RollingWheel, b: RollingWheel) -> bool:
    """Return whether the axes of two wheels are parallel."""
    return bool(abs(a.axis @ b.axis) > PARALLEL)


def are_coaxial(a: RollingWheel, b: RollingWheel) -> bool:
    """Return whether two wheels have one axis and one radius, side by side."""
    apart_m, larger_m = b.centre_m - a.centre_m, max(a.radius_m or 0.0, b.radius_m or 0.0)
    return bool(
        are_parallel(a, b)
        and np.linalg.norm(np.cross(apart_m, a.axis)) < OFF_LINE * larger_m
        and abs(apart_m @ a.axis) > LEAST_SEPARATION * larger_m
        and abs((a.radius_m or 0.0) - (b.radius_m or 0.0)) <= LIKE_RADIUS * larger_m
    )
