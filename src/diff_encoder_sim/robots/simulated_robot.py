"""A robot as the simulator needs it: the URDF that PyBullet loads, its true wheels, and its description."""

from __future__ import annotations

import functools
from typing import Dict, Iterable, List, NamedTuple, Optional, Tuple
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np

from diff_encoder_sim.base.xml_values import rpy_from_rotation
from diff_encoder_sim.robots.contacts import support_balls
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import RobotChoices, RobotDescription, RobotSource, RobotTree
from diff_encoder_sim.robots.solids import (
    Box,
    Cylinder,
    MassProperties,
    Mesh,
    Shape,
    Sphere,
    homogeneous,
    measures,
    merged,
    pose_at,
)
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expansion

DEFAULT_FRICTION = 0.5  # PyBullet's own, with which bodies slide along walls

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
_THICKEST_WHEEL = 0.5  # of its radius, on its outer side: no URDF gives the thickness of a wheel of any shape
_LYING = np.array([(1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)])  # a cylinder's axes, its axis along y

# Arguments of a xacro for the errors of its wheels, as ALTO's file has them.
_ERROR_ARGUMENTS = ('wheel_radius_error_left', 'wheel_radius_error_right', 'wheel_separation_error')

_SAME = 1e-6  # m, and of a unit vector: how exactly wheels stand side by side, and touch the floor
_NEAR_FLOOR = 0.1  # of the wheel's radius: a shape that is closer to the floor is one to lean on
_CLEAR_M = 1e-3  # a shape that hangs higher does not carry
_HERE = np.eye(4)


class TrueWheels(NamedTuple):
    """The wheels of the simulated robot, their errors included."""

    left_radius_m: float
    right_radius_m: float
    separation_m: float


class GeometryErrors(NamedTuple):
    """Differences of the true wheels from the description's, relative."""

    left_radius: float = 0.0
    right_radius: float = 0.0
    separation: float = 0.0


_NONE = GeometryErrors()


class SimulatedRobot(NamedTuple):
    """A robot with its true wheels."""

    description: RobotDescription
    urdf: str  # what PyBullet loads; wheel joints are named as in the description, and positive is forward
    wheels: TrueWheels
    floor_only_links: Tuple[str, ...]  # of that URDF: touch nothing but the floor, which the others do not touch

    @property
    def joints(self) -> Tuple[str, str]:
        """Return the names of the left and the right wheel's joint."""
        return self.description.left.joint, self.description.right.joint

    @property
    def forward_signs(self) -> Tuple[float, float]:
        """Return the signs of the left and the right joint's speed, by the robot's own axes, when it drives forward."""
        left, right = self.description.left, self.description.right
        return 1.0 if left.is_forward_positive else -1.0, 1.0 if right.is_forward_positive else -1.0


def load_simulated_robot(source: RobotSource, choices: RobotChoices, errors: GeometryErrors = _NONE) -> SimulatedRobot:
    """Read a robot and make its physics right.

    One that is sound keeps its masses and shapes. Errors of its wheels are then those of its own xacro arguments;
    without such arguments, and for all other robots, the wheels of the simulated robot are changed. ConfigError if the
    robot's files are bad, or describe no robot with two driven wheels.
    """
    description = describe(source, choices)
    left_m, right_m = (radius_m * (1.0 + error) for radius_m, error in zip(description.radii_m, errors))
    wheels = TrueWheels(left_m, right_m, description.wheel_separation_m * (1.0 + errors.separation))
    declared = expansion(source).declared
    own_errors = {name: repr(value) for name, value in zip(_ERROR_ARGUMENTS, errors) if value and name in declared}
    urdf = expansion(source._replace(arguments=tuple({**dict(source.arguments), **own_errors}.items()))).urdf
    sound = _sound(urdf, str(source.file), description.left.joint, description.right.joint)
    if sound is not None and np.allclose(sound[1], wheels, rtol=1e-6, atol=0.0):
        return SimulatedRobot(description, *sound, ())
    return SimulatedRobot(description, physics_urdf(description, wheels), wheels, FLOOR_ONLY_LINKS)


@functools.lru_cache(maxsize=16)  # trials of a campaign ask again and again
def _sound(urdf: str, where: str, left_joint: str, right_joint: str) -> Optional[Tuple[str, TrueWheels]]:
    """Return what PyBullet loads of a sound URDF, and its wheels; None of another."""
    tree = parse_urdf(urdf, where)
    wheels = sound_wheels(tree, left_joint, right_joint)
    return wheels and (joined_links(tree), wheels)


def physics_urdf(description: RobotDescription, wheels: TrueWheels) -> str:
    """Return the URDF of a robot with these wheels, its root link in the place of the robot's own root link.

    Positive speed of either wheel's joint, which has its own name, drives forward. Both wheels stand on the floor,
    whatever their radii.
    """
    total, supports = description.mass, support_balls(description)
    parts: List[MassProperties] = []  # both wheels, the supports
    for radius_m, y_m in zip(wheels, (0.5 * wheels.separation_m, -0.5 * wheels.separation_m)):
        place_m = description.axle_x_m, description.middle_y_m + y_m, description.floor_z_m + radius_m
        inertia_kgm2 = _WHEEL_INERTIA * total.mass_kg * radius_m**2 * np.eye(3)
        parts.append(MassProperties(_WHEEL_MASS * total.mass_kg, np.array(place_m), inertia_kgm2))
    parts.append(homogeneous(supports, _SUPPORTS_MASS * total.mass_kg))
    # The body, with the parts, has the robot's mass, centre of mass and inertia. If no body has what is left of the
    # inertia it has its share of the robot's, by mass.
    body = merged([total, *(MassProperties(-part.mass_kg, part.com_m, -part.inertia_kgm2) for part in parts)])
    if not body.can_be_of_a_body():
        body = body._replace(inertia_kgm2=total.inertia_kgm2 * (body.mass_kg / total.mass_kg))
    hull, edges_m = list(description.hull), [y_m for _, y_m in description.footprint]
    # The wheels as obstacles meet them: cylinders, outward no farther than the footprint.
    for wheel, edge_m in ((description.left, max(edges_m)), (description.right, min(edges_m))):
        half_m = min(abs(edge_m - wheel.centre_m[1]), _THICKEST_WHEEL * description.radius_m)
        if half_m > 0.0:
            hull.append(Shape(Cylinder(description.radius_m, 2.0 * half_m), pose_at(wheel.centre_m, _LYING)))
    robot = Element('robot', name=description.tree.name)
    _add_link(robot, BODY, body, hull)
    for link, wheel, radius_m, part in zip(FLOOR_ONLY_LINKS, (description.left, description.right), wheels, parts):
        ball = Shape(Sphere(radius_m), np.eye(4))
        _add_link(robot, link, part._replace(com_m=np.zeros(3)), [ball], _WHEEL_FRICTION)
        joint = _add_joint(robot, wheel.joint, 'continuous', BODY, link, pose_at(part.com_m))
        SubElement(joint, 'axis', xyz='0 1 0')
    _add_link(robot, SUPPORTS, parts[2], supports, friction=0.0)
    _add_joint(robot, f'{SUPPORTS}_joint', 'fixed', BODY, SUPPORTS)
    return tostring(robot, encoding='unicode')


def joined_links(tree: RobotTree) -> str:
    """Return the URDF of a robot of equal mass, shapes and motion, without visuals.

    Links that are fixed to one another become one for each friction. Root link, moving joints and the frames of their
    links stay. Shapes are those of the tree, in which a capsule is a cylinder; none is a mesh, and each link has a
    mass (`sound_wheels`).
    """
    robot = Element('robot', name=tree.name)
    moving = [joint for joint in tree.joints.values() if joint.kind != 'fixed']
    parts = {top: list(tree.subtree(top, is_rigid=True)) for top in (tree.root, *(joint.child for joint in moving))}
    # Contacts are solved in the order of the joints. With the wheels first truth and wheels of ALTO agree a hundred
    # times better, after as many iterations, than with casters first.
    for joint in moving:
        parent = next(top for top, names in parts.items() if joint.parent in names)
        in_parent = np.linalg.inv(tree.poses[parent]) @ tree.poses[joint.child]
        given = next(element for element in tree.xml.iterfind('joint') if element.get('name') == joint.name)
        others = [element for element in given if element.tag not in ('parent', 'child', 'origin')]
        _add_joint(robot, joint.name, joint.kind, parent, joint.child, in_parent).extend(others)
    for top, names in parts.items():  # one link with all of equal friction, and one more for each other friction
        by_friction: Dict[float, List[str]] = {}
        for name in names:
            friction = tree.links[name].friction
            by_friction.setdefault(DEFAULT_FRICTION if friction is None else friction, []).append(name)
        to_part = np.linalg.inv(tree.poses[top])
        for friction, equal in by_friction.items():
            links = [(tree.links[name], to_part @ tree.poses[name]) for name in equal]
            mass = merged(link.inertial.moved(pose) for link, pose in links if link.inertial is not None)
            shapes = [shape.placed(pose) for link, pose in links for shape in link.collisions]
            _add_link(robot, equal[0], mass, shapes, friction)
            if equal[0] != top:
                _add_joint(robot, tree.above[equal[0]].name, 'fixed', top, equal[0])
    return tostring(robot, encoding='unicode')


def _add_link(
    robot: Element, name: str, mass: MassProperties, shapes: Iterable[Shape], friction: float = DEFAULT_FRICTION
) -> None:
    link = SubElement(robot, 'link', name=name)
    inertial = SubElement(link, 'inertial')
    _add_origin(inertial, pose_at(mass.com_m))
    SubElement(inertial, 'mass', value=repr(float(mass.mass_kg)))
    upper = zip(('ixx', 'ixy', 'ixz', 'iyy', 'iyz', 'izz'), mass.inertia_kgm2[np.triu_indices(3)].tolist())
    SubElement(inertial, 'inertia', {key: repr(value) for key, value in upper})
    contact = SubElement(link, 'contact')
    SubElement(contact, 'lateral_friction', value=repr(friction))
    for shape in shapes:
        collision = SubElement(link, 'collision')
        _add_origin(collision, shape.pose_in_link)
        geometry = SubElement(collision, 'geometry')
        if isinstance(shape.geometry, Box):
            SubElement(geometry, 'box', size=_text(shape.geometry.size_xyz_m))
        elif isinstance(shape.geometry, (Cylinder, Sphere)):
            sizes = zip(('radius', 'length'), map(repr, shape.geometry))
            SubElement(geometry, type(shape.geometry).__name__.lower(), dict(sizes))


def _add_joint(
    robot: Element, name: str, kind: str, parent: str, child: str, child_in_parent: np.ndarray = _HERE
) -> Element:
    joint = SubElement(robot, 'joint', name=name, type=kind)
    SubElement(joint, 'parent', link=parent)
    SubElement(joint, 'child', link=child)
    _add_origin(joint, child_in_parent)
    return joint


def _add_origin(element: Element, pose: np.ndarray) -> None:
    SubElement(element, 'origin', xyz=_text(pose[:3, 3]), rpy=_text(rpy_from_rotation(pose[:3, :3])))


def _text(numbers: Iterable[float]) -> str:
    return ' '.join(repr(float(number)) for number in numbers)


def sound_wheels(tree: RobotTree, left_joint: str, right_joint: str) -> Optional[TrueWheels]:
    """Return the wheels of a URDF that a rigid-body simulation moves as its wheels roll; None of any other.

    Each link has a mass and an inertia that a body can have; nothing moves but the wheels, which are balls about
    their joints; and the robot stands on them and on balls without friction that are all on its centre of mass's side.
    """
    masses = [link.inertial.moved(tree.poses[link.name]) for link in tree.links.values() if link.inertial is not None]
    is_rigid = len(masses) == len(tree.links) and all(mass.can_be_of_a_body() for mass in masses)
    has_mesh = any(isinstance(shape.geometry, Mesh) for link in tree.links.values() for shape in link.collisions)
    moving = {name for name, joint in tree.joints.items() if joint.kind != 'fixed'}
    # A contact that resists rolling or spinning, or bounces, by PyBullet's tags.
    tags = [tag for tag in tree.xml.iterfind('link/contact/*') if tag.tag != 'lateral_friction']
    resists = any(tag.get('value') not in ('0', '0.0') for tag in tags)
    if moving != {left_joint, right_joint} or not is_rigid or has_mesh or resists:
        return None
    joints = [tree.joints[name] for name in (left_joint, right_joint)]
    balls = [tree.links[joint.child].collisions for joint in joints]
    is_ball = all(len(shapes) == 1 and isinstance(shapes[0].geometry, Sphere) for shapes in balls)
    axes = np.array([tree.axis_in_root(joint) for joint in joints])
    if not is_ball or not np.allclose(axes, (0.0, 1.0, 0.0), rtol=0.0, atol=_SAME):
        return None
    left_m, right_m = (tree.poses[joint.child][:3, 3] for joint in joints)
    left_radius_m, right_radius_m = (measures(shapes[0].geometry)[1] for shapes in balls)
    floor_z_m, bottom_z_m = left_m[2] - left_radius_m, right_m[2] - right_radius_m
    is_level = abs(right_m[0] - left_m[0]) < _SAME > abs(bottom_z_m - floor_z_m)
    is_centred = all(np.abs(shapes[0].pose_in_link[:3, 3]).max() <= _SAME for shapes in balls)
    # What is near the floor are balls without friction; on the lighter side these hang clear.
    side, gaps_m = np.sign(float(merged(masses).com_m[0]) - left_m[0]), []
    for link in tree.links.values():
        for shape in link.collisions if link.name not in [joint.child for joint in joints] else ():
            lowest_m = shape.placed(tree.poses[link.name]).support_point_m(np.array([0.0, 0.0, -1.0]))
            slides = isinstance(shape.geometry, Sphere) and link.friction == 0
            is_ahead = side * (lowest_m[0] - left_m[0]) > 0
            gaps_m.append((lowest_m[2] - floor_z_m, slides, is_ahead))
    near = [each for each in gaps_m if each[0] < _NEAR_FLOOR * left_radius_m]
    stands = all(slides and gap_m > -_SAME and (is_ahead or gap_m >= _CLEAR_M) for gap_m, slides, is_ahead in near)
    if not is_level or not is_centred or not stands or min((gap_m for gap_m, _, _ in near), default=1.0) >= _CLEAR_M:
        return None
    return TrueWheels(left_radius_m, right_radius_m, float(left_m[1] - right_m[1]))
