"""The URDF that PyBullet loads for a robot: four links with the robot's mass, rolling and outline, and nothing else.

Whatever the robot's own URDF looks like, wheels touch the floor in one point each, the rest of the weight is carried
without friction, and a rigid body stands on three points, so that truth and wheels agree (docs/adr/0017-robots.md).
"""

from __future__ import annotations

from typing import Iterable, Iterator, NamedTuple, Tuple
from xml.etree import ElementTree

import numpy as np

from diff_encoder_sim.base.xml_values import Vector
from diff_encoder_sim.robots.ground_supports import support_balls
from diff_encoder_sim.robots.mass_properties import homogeneous, merged
from diff_encoder_sim.robots.robot_description import DriveWheel, MassProperties, RobotDescription
from diff_encoder_sim.robots.robot_tree import Cylinder, Shape, Sphere
from diff_encoder_sim.robots.urdf_writing import add_joint, add_link

BODY, LEFT_WHEEL, RIGHT_WHEEL, SUPPORTS = 'body', 'left_wheel', 'right_wheel', 'supports'
# Links that stand in for what touches the floor. They are no bodies that could hit a wall: the hull is.
FLOOR_ONLY_LINKS = (LEFT_WHEEL, RIGHT_WHEEL, SUPPORTS)

# Of the robot's mass. A URDF's own wheels may weigh nothing or everything; the solver wants neither.
_WHEEL_MASS, _SUPPORTS_MASS = 0.05, 0.001
# A wheel's inertia, of the robot's mass times its radius squared: as with the rotor of a geared motor behind it.
# The solver's error in turns falls with it: 0.05 % with that of a homogeneous ball, 0.002 % with this.
_WHEEL_INERTIA = 0.08
# PyBullet multiplies it by the floor's 0.5: rubber on a clean hard floor. A step in which the speed changes takes twice
# the mean force, and with half this friction the wheels slip then: 0.02 %, and 0.02 degrees in each metre.
_WHEEL_FRICTION = 2.0
_THICKEST_WHEEL = 0.5  # of its radius, on its outer side: no URDF says how thick a wheel of any shape is


class TrueWheels(NamedTuple):
    """The wheels of the simulated robot, their errors included."""

    left_radius_m: float
    right_radius_m: float
    separation_m: float


def physics_urdf(description: RobotDescription, wheels: TrueWheels) -> str:
    """Return the URDF of a robot with these wheels, its root link in the place of the robot's own root link.

    Positive speed of either wheel's joint, which has its own name, drives forward. Both wheels stand on the floor,
    whatever their radii.
    """
    balls = _wheel_balls(description, wheels)
    supports = support_balls(description)
    parts = [_wheel_mass(description.mass.mass_kg, *ball) for ball in zip(balls, wheels)]
    parts.append(homogeneous(supports, _SUPPORTS_MASS * description.mass.mass_kg))
    robot = ElementTree.Element('robot', name=description.tree.name)
    add_link(robot, BODY, _rest(description.mass, parts), (*description.hull, *_wheel_outlines(description)))
    for link, joint, ball, part in zip(
        (LEFT_WHEEL, RIGHT_WHEEL), (description.left.joint, description.right.joint), balls, parts
    ):
        centre_m = ball.pose_in_link[:3, 3]
        centred = ball._replace(pose_in_link=np.eye(4))
        add_link(robot, link, part._replace(com_m=np.zeros(3)), [centred], _WHEEL_FRICTION)
        joint_element = add_joint(robot, joint, 'continuous', BODY, link, centre_m)
        ElementTree.SubElement(joint_element, 'axis', xyz='0 1 0')
    add_link(robot, SUPPORTS, parts[-1], supports, friction=0.0)
    add_joint(robot, f'{SUPPORTS}_joint', 'fixed', BODY, SUPPORTS, np.zeros(3))
    return ElementTree.tostring(robot, encoding='unicode')


def _wheel_balls(description: RobotDescription, wheels: TrueWheels) -> Tuple[Shape, Shape]:
    """Return the balls that stand in for the left and the right wheel, in the root."""
    middle_m = 0.5 * (description.left.centre_m[1] + description.right.centre_m[1])
    half_m = 0.5 * wheels.separation_m
    left, right = (
        _ball(radius_m, (description.axle_x_m, middle_m + y_m, description.floor_z_m + radius_m))
        for radius_m, y_m in ((wheels.left_radius_m, half_m), (wheels.right_radius_m, -half_m))
    )
    return left, right


def _ball(radius_m: float, centre_m: Vector) -> Shape:
    pose = np.eye(4)
    pose[:3, 3] = centre_m
    return Shape(Sphere(radius_m), pose)


def _wheel_mass(robot_kg: float, ball: Shape, radius_m: float) -> MassProperties:
    inertia_kgm2 = _WHEEL_INERTIA * robot_kg * radius_m**2 * np.eye(3)
    return MassProperties(_WHEEL_MASS * robot_kg, ball.pose_in_link[:3, 3], inertia_kgm2)


def _wheel_outlines(description: RobotDescription) -> Iterator[Shape]:
    """Yield the wheels as obstacles meet them: cylinders, outward no farther than the footprint."""
    radius_m = 0.5 * description.wheel_diameter_m
    edges_m = [y_m for _, y_m in description.footprint]
    for wheel, edge_m in ((description.left, max(edges_m)), (description.right, min(edges_m))):
        half_m = min(abs(edge_m - wheel.centre_m[1]), _THICKEST_WHEEL * radius_m)
        if half_m > 0.0:
            yield Shape(Cylinder(radius_m, 2.0 * half_m), _lying_at(wheel))


def _lying_at(wheel: DriveWheel) -> np.ndarray:
    """Return the (4, 4) pose of a cylinder that lies along y at a wheel's centre."""
    pose = np.eye(4)
    pose[:3, :3] = ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))
    pose[:3, 3] = wheel.centre_m
    return pose


def _rest(total: MassProperties, parts: Iterable[MassProperties]) -> MassProperties:
    """Return the body that, with the parts, has the total's mass, centre of mass and inertia.

    Where no body has what is left of the inertia it has its share of the total's, by mass.
    """
    taken = [MassProperties(-part.mass_kg, part.com_m, -part.inertia_kgm2) for part in parts]
    rest = merged([total, *taken])
    smallest, middle, largest = np.linalg.eigvalsh(rest.inertia_kgm2)
    if smallest > 0 and smallest + middle > largest:
        return rest
    return rest._replace(inertia_kgm2=total.inertia_kgm2 * (rest.mass_kg / total.mass_kg))
