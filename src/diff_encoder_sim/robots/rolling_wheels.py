"""The wheels of a robot: links that turn without end about a level axis and have a shape that rolls."""

from __future__ import annotations

import re
from itertools import combinations
from typing import FrozenSet, Iterable, List, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.xml_values import Vector
from diff_encoder_sim.robots.description import Cylinder, DrivenWheel, Joint, RobotTree, Shape
from diff_encoder_sim.robots.solids import placed, rolling_radius_m

LEVEL = 0.17  # an axis' vertical part (10 degrees), below which a wheel can stand on it
UPRIGHT = 0.9  # an axis' vertical part, above which a joint swivels
SAME_RADIUS = 0.01  # shapes of one wheel: twin tyres, a tyre and its rim
PASSIVE = re.compile('caster|castor|idler|passive|support|roller|ball', re.IGNORECASE)
NEAR_FLOOR = 0.35  # of its radius: how far above the lowest wheel a wheel may end

PARALLEL = 0.995  # cosine
OFF_LINE = 0.1  # of the radius: how far a wheel may be off the other's axis
LIKE_RADIUS = 0.05
LEAST_SEPARATION = 0.2  # of the radius

WheelPair = Tuple[DrivenWheel, DrivenWheel]  # left, right


def rolling_wheels(tree: RobotTree) -> Tuple[DrivenWheel, ...]:
    """Return the wheels near the floor, in the file's order: none of an arm, no spinning scanner."""
    found = [wheel_of(tree, joint) for joint in tree.joints.values() if joint.spins]
    level = [wheel for wheel in found if wheel.radius_m is not None and abs(wheel.axis[2]) < LEVEL]
    floor_m = min((wheel.bottom_m for wheel in level), default=0.0)
    return tuple(wheel for wheel in level if wheel.bottom_m < floor_m + NEAR_FLOOR * (wheel.radius_m or 0.0))


def wheel_of(tree: RobotTree, joint: Joint) -> DrivenWheel:
    """Return the wheel that a joint turns, by the largest of its shapes that roll; collision shapes first."""
    pose = tree.poses[joint.child]
    to_wheel = np.linalg.inv(pose)
    radius_m, centre_m, source = None, np.zeros(3), 'no rolling shape'
    for kind in ('collision', 'visual'):
        shapes: List[Shape] = []
        for name in tree.subtree(joint.child, is_rigid=True):
            link = tree.links[name]
            given = link.collisions if kind == 'collision' else link.visuals
            shapes += [placed(shape, to_wheel @ tree.poses[name]) for shape in given]
        rolling = [(rolling_radius_m(shape, joint.axis) or 0.0, shape) for shape in shapes]
        largest_m = max((radius for radius, _ in rolling), default=0.0)
        if largest_m > 0.0:
            largest = [shape for radius, shape in rolling if radius > (1.0 - SAME_RADIUS) * largest_m]
            # A mesh's tread is narrower than the wheel with its motor; twin tyres are equally wide.
            width_m = min(map(_width_m, largest))
            largest = [shape for shape in largest if _width_m(shape) <= (1.0 + SAME_RADIUS) * width_m]
            radius_m, centre_m = largest_m, np.mean([shape.pose_in_link[:3, 3] for shape in largest], axis=0)
            source = f'{kind} {type(largest[0].geometry).__name__.lower()}'
            break
    centre_in_root_m, axis = pose[:3, :3] @ centre_m + pose[:3, 3], tree.axis_in_root(joint)
    swivel = next((above.name for above in tree.joints_above(joint.parent) if is_upright(tree, above)), None)
    return DrivenWheel(joint.name, joint.child, _vector(centre_in_root_m), _vector(axis), radius_m, source, swivel)


def _width_m(shape: Shape) -> float:
    return shape.geometry.length_m if isinstance(shape.geometry, Cylinder) else 0.0


def _vector(array: np.ndarray) -> Vector:
    x, y, z = array.tolist()
    return x, y, z


def is_upright(tree: RobotTree, joint: Joint) -> bool:
    """Return whether a joint turns about an upright axis."""
    return joint.kind in ('continuous', 'revolute') and bool(abs(tree.axis_in_root(joint)[2]) > UPRIGHT)


def drivable_joints(tree: RobotTree, wheels: Sequence[DrivenWheel]) -> FrozenSet[str]:
    """Return the joints that can drive the robot: those of wheels that neither swivel nor are casters.

    Without two of these (wheels may lack a round shape) all joints count that spin about a level axis.

    Args:
        tree: the robot.
        wheels: from rolling_wheels.
    """
    fixed = frozenset(wheel.joint for wheel in without_casters([each for each in wheels if each.swivel is None]))
    if len(fixed) > 1:
        return fixed
    spinning = (joint for joint in tree.joints.values() if joint.spins)
    return frozenset(joint.name for joint in spinning if abs(tree.axis_in_root(joint)[2]) < LEVEL)


def without_casters(wheels: Sequence[DrivenWheel]) -> List[DrivenWheel]:
    """Leave out wheels that are casters by name, if two others remain."""
    driven = [wheel for wheel in wheels if not PASSIVE.search(f'{wheel.joint} {wheel.link}')]
    return driven if len(driven) >= 2 else [*wheels]


def coaxial_pairs(wheels: Iterable[DrivenWheel]) -> List[WheelPair]:
    """Return all pairs of like wheels on one axle; of three on one axle, three pairs."""
    return [left_first(a, b) for a, b in combinations(wheels, 2) if are_coaxial(a, b)]


def left_first(a: DrivenWheel, b: DrivenWheel) -> WheelPair:
    """Return two wheels as a pair, the left one at the larger y."""
    return (a, b) if a.centre_m[1] >= b.centre_m[1] else (b, a)


def joints_of(pair: WheelPair) -> Tuple[str, str]:
    """Return the joints' names, left first."""
    return pair[0].joint, pair[1].joint


def mean_radius_m(pair: WheelPair) -> float:
    """Return the mean radius of two wheels."""
    return 0.5 * ((pair[0].radius_m or 0.0) + (pair[1].radius_m or 0.0))


def are_parallel(a: DrivenWheel, b: DrivenWheel) -> bool:
    """Return whether the axes of two wheels are parallel."""
    return bool(abs(np.dot(a.axis, b.axis)) > PARALLEL)


def are_coaxial(a: DrivenWheel, b: DrivenWheel) -> bool:
    """Return whether two wheels have one axis and one radius, side by side."""
    apart_m, larger_m = np.subtract(b.centre_m, a.centre_m), max(a.radius_m or 0.0, b.radius_m or 0.0)
    return bool(
        are_parallel(a, b)
        and np.linalg.norm(np.cross(apart_m, a.axis)) < OFF_LINE * larger_m
        and abs(apart_m @ a.axis) > LEAST_SEPARATION * larger_m
        and abs((a.radius_m or 0.0) - (b.radius_m or 0.0)) <= LIKE_RADIUS * larger_m
    )
