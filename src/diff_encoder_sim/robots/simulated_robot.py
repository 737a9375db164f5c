"""A robot as the simulator needs it: what PyBullet loads, and what is known of it."""

from __future__ import annotations

import copy
import functools
import re
from typing import Collection, Dict, Iterable, Iterator, List, NamedTuple, Optional, Tuple
from xml.etree import ElementTree

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.xml_values import Vector, rpy_from_rotation
from diff_encoder_sim.robots.contacts import support_balls
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import (
    Box,
    Cylinder,
    DriveWheel,
    Findings,
    Joint,
    Link,
    MassProperties,
    Mesh,
    RobotChoices,
    RobotDescription,
    RobotSource,
    RobotTree,
    Shape,
    Sphere,
)
from diff_encoder_sim.robots.meshes import (
    MeshFinder,
    file_corners_m,
    is_listed,
    listed_mesh,
    primitive_tree,
    without_unread_meshes,
)
from diff_encoder_sim.robots.solids import homogeneous, link_mass, lowest_point_m, merged, placed
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expansion

DEFAULT_FRICTION = 0.5  # PyBullet's own, with which bodies slide along walls


def add_link(
    robot: ElementTree.Element,
    name: str,
    mass: MassProperties,
    shapes: Iterable[Shape],
    friction: float = DEFAULT_FRICTION,
) -> None:
    """Add a link."""
    link = ElementTree.SubElement(robot, 'link', name=name)
    inertial = ElementTree.SubElement(link, 'inertial')
    ElementTree.SubElement(inertial, 'origin', xyz=_text(mass.com_m))
    ElementTree.SubElement(inertial, 'mass', value=repr(float(mass.mass_kg)))
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = mass.inertia_kgm2.tolist()
    values = {'ixx': xx, 'ixy': xy, 'ixz': xz, 'iyy': yy, 'iyz': yz, 'izz': zz}
    ElementTree.SubElement(inertial, 'inertia', {key: repr(value) for key, value in values.items()})
    contact = ElementTree.SubElement(link, 'contact')
    ElementTree.SubElement(contact, 'lateral_friction', value=repr(friction))
    for shape in shapes:
        _add_collision(link, shape)


def _add_collision(link: ElementTree.Element, shape: Shape) -> None:
    collision = ElementTree.SubElement(link, 'collision')
    ElementTree.SubElement(collision, 'origin', origin_attributes(shape.pose_in_link))
    geometry = ElementTree.SubElement(collision, 'geometry')
    if isinstance(shape.geometry, Box):
        ElementTree.SubElement(geometry, 'box', size=_text(shape.geometry.size_xyz_m))
    elif isinstance(shape.geometry, Cylinder):
        size = {'radius': repr(shape.geometry.radius_m), 'length': repr(shape.geometry.length_m)}
        ElementTree.SubElement(geometry, 'cylinder', size)
    elif isinstance(shape.geometry, Sphere):
        ElementTree.SubElement(geometry, 'sphere', radius=repr(shape.geometry.radius_m))


def origin_attributes(pose: np.ndarray) -> Dict[str, str]:
    """Return the attributes of an <origin> for a (4, 4) pose."""
    return {'xyz': _text(pose[:3, 3]), 'rpy': _text(rpy_from_rotation(pose[:3, :3]))}


def add_joint(
    robot: ElementTree.Element, name: str, kind: str, parent: str, child: str, origin_m: Iterable[float]
) -> ElementTree.Element:
    """Add a joint whose frame is at `origin_m` in the parent link, and return it."""
    joint = ElementTree.SubElement(robot, 'joint', name=name, type=kind)
    ElementTree.SubElement(joint, 'parent', link=parent)
    ElementTree.SubElement(joint, 'child', link=child)
    ElementTree.SubElement(joint, 'origin', xyz=_text(origin_m))
    return joint


def _text(numbers: Iterable[float]) -> str:
    return ' '.join(repr(float(number)) for number in numbers)


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


def joined_links(tree: RobotTree) -> str:
    """Return the URDF of a robot of equal mass, shapes and motion, without visuals.

    Links that are fixed to one another become one for each friction. Root link, moving joints and the frames of their
    links stay. Shapes are those of the tree, in which a capsule is a cylinder; none is a mesh, and each link has a
    mass (`sound_urdf.sound_wheels`).
    """
    robot = ElementTree.Element('robot', name=tree.name)
    moving = [joint for joint in tree.joints.values() if joint.kind != 'fixed']
    parts = [_fixed_to(tree, top) for top in (tree.root, *(joint.child for joint in moving))]
    # Contacts are solved in the order of the joints. With the wheels first truth and wheels of ALTO agree a hundred
    # times better, after as many iterations, than with casters first.
    for joint in moving:
        _add_moving(robot, tree, joint, next(names[0] for names in parts if joint.parent in names))
    for names in parts:
        _add_part(robot, tree, names)
    return ElementTree.tostring(robot, encoding='unicode')


def _fixed_to(tree: RobotTree, top: str) -> List[str]:
    """Return the name of a link and of the links below it that do not move against it."""
    names = [top]
    for name in names:
        names += [joint.child for joint in tree.joints.values() if (joint.parent, joint.kind) == (name, 'fixed')]
    return names


def _add_moving(robot: ElementTree.Element, tree: RobotTree, joint: Joint, parent: str) -> None:
    """Add a joint with all that its file says of it, on another link that its own parent is fixed to."""
    moved = next(copy.deepcopy(element) for element in tree.xml.iterfind('joint') if element.get('name') == joint.name)
    for replaced in (*moved.findall('parent'), *moved.findall('origin')):
        moved.remove(replaced)
    poses = tree.link_poses()
    ElementTree.SubElement(moved, 'parent', link=parent)
    ElementTree.SubElement(moved, 'origin', origin_attributes(np.linalg.inv(poses[parent]) @ poses[joint.child]))
    robot.append(moved)


def _add_part(robot: ElementTree.Element, tree: RobotTree, names: List[str]) -> None:
    """Add a rigid part of links as its first one with all of equal friction, and one more for each other friction."""
    by_friction: Dict[float, List[str]] = {}
    for name in names:
        given = tree.links[name].friction
        by_friction.setdefault(DEFAULT_FRICTION if given is None else given, []).append(name)
    poses = tree.link_poses()
    to_part = np.linalg.inv(poses[names[0]])
    for friction, equal in by_friction.items():
        links = [(tree.links[name], to_part @ poses[name]) for name in equal]
        mass = merged(link_mass(link.inertial, pose) for link, pose in links if link.inertial is not None)
        shapes = [placed(shape, pose) for link, pose in links for shape in link.collisions]
        add_link(robot, equal[0], mass, shapes, friction)
        if equal[0] != names[0]:
            above = tree.joint_above(equal[0])
            assert above is not None  # only the root has none, which is the first of its part
            add_joint(robot, above.name, 'fixed', names[0], equal[0], np.zeros(3))


_SAME = 1e-6  # m, and of a unit vector: how exactly wheels stand side by side, and touch the floor
# A shape that is closer to the floor than this, of the wheel's radius, is one to lean on.
_NEAR_FLOOR = 0.1
_CLEAR_M = 1e-3  # and one that hangs higher than this is not leant on
_INSIDE = np.s_[:3, 3]


class _Ball(NamedTuple):
    """A link whose only collision shape is a ball about its joint."""

    centre_m: np.ndarray  # (3,) in the root
    radius_m: float


class _NearFloor(NamedTuple):
    """A collision shape on which the robot leans, or would if it tipped over."""

    x_m: float
    gap_m: float  # to the floor
    slides: bool  # a ball without friction


def sound_wheels(tree: RobotTree, left_joint: str, right_joint: str) -> Optional[TrueWheels]:
    """Return the wheels of a URDF that a rigid-body simulation moves as its wheels roll; None of any other.

    Each link has a mass and an inertia that a body can have; nothing moves but the wheels, which are balls about
    their joints; and the robot stands on them and on balls without friction that are all on its centre of mass's side.
    """
    moving = {name for name, joint in tree.joints.items() if joint.kind != 'fixed'}
    if moving != {left_joint, right_joint} or not all(_is_solid(link) for link in tree.links.values()):
        return None
    left, right = (_wheel(tree, tree.joints[name]) for name in (left_joint, right_joint))
    if left is None or right is None or _has_resistance(tree):
        return None
    floor_z_m = left.centre_m[2] - left.radius_m
    is_level = np.abs(right.centre_m - left.centre_m)[0] < _SAME > abs(right.centre_m[2] - right.radius_m - floor_z_m)
    wheels = {tree.joints[left_joint].child, tree.joints[right_joint].child}
    contacts = list(_near_floor(tree, wheels, floor_z_m, _NEAR_FLOOR * left.radius_m))
    if not is_level or not _stands_on_three_points(contacts, left.centre_m[0], _com_x_m(tree)):
        return None
    return TrueWheels(left.radius_m, right.radius_m, float(left.centre_m[1] - right.centre_m[1]))


def _is_solid(link: Link) -> bool:
    """Return whether a link has the mass of a body, and no mesh as collision shape."""
    if link.inertial is None or any(isinstance(shape.geometry, Mesh) for shape in link.collisions):
        return False
    smallest, middle, largest = np.linalg.eigvalsh(link.inertial.inertia_kgm2)
    return bool(link.inertial.mass_kg > 0 and smallest > 0 and smallest + middle >= largest)


def _wheel(tree: RobotTree, joint: Joint) -> Optional[_Ball]:
    """Return a wheel that is a ball about its joint, which turns forward about the root's y; None of another."""
    pose, shapes = tree.link_poses()[joint.child], tree.links[joint.child].collisions
    if len(shapes) != 1 or np.abs(pose[:3, :3] @ joint.axis - (0.0, 1.0, 0.0)).max() > _SAME:
        return None
    geometry, centre_m = shapes[0].geometry, shapes[0].pose_in_link[_INSIDE]
    if not isinstance(geometry, Sphere) or np.abs(centre_m).max() > _SAME:
        return None
    return _Ball(pose[_INSIDE], geometry.radius_m)


def _has_resistance(tree: RobotTree) -> bool:
    """Return whether a contact resists rolling or spinning, or bounces, by PyBullet's tags."""
    tags = (tag for contact in tree.xml.iterfind('link/contact') for tag in contact if tag.tag != 'lateral_friction')
    return any(tag.get('value') not in ('0', '0.0') for tag in tags)


def _near_floor(tree: RobotTree, wheels: Collection[str], floor_z_m: float, near_m: float) -> Iterator[_NearFloor]:
    """Yield the shapes of other links that are near the floor."""
    poses = tree.link_poses()
    for name, link in tree.links.items():
        for shape in link.collisions if name not in wheels else ():
            x_m, _, z_m = lowest_point_m(placed(shape, poses[name])).tolist()
            if z_m - floor_z_m < near_m:
                yield _NearFloor(x_m, z_m - floor_z_m, isinstance(shape.geometry, Sphere) and link.friction == 0)


def _stands_on_three_points(contacts: List[_NearFloor], axle_x_m: float, com_x_m: float) -> bool:
    """Return whether the robot leans where its centre of mass is, and hangs clear on the other side of the axle."""
    side = np.sign(com_x_m - axle_x_m)
    down = [contact for contact in contacts if contact.gap_m < _CLEAR_M]
    return (
        all(contact.slides and contact.gap_m > -_SAME for contact in contacts)
        and bool(down)
        and all(side * (contact.x_m - axle_x_m) > 0 for contact in down)
    )


def _com_x_m(tree: RobotTree) -> float:
    poses = tree.link_poses()
    masses = (link_mass(link.inertial, poses[name]) for name, link in tree.links.items() if link.inertial is not None)
    return float(merged(masses).com_m[0])


# Signs that a xacro or URDF depends on more than its own text and arguments: other files, the environment.
_NEEDS_OTHERS = re.compile(r'include|load_yaml|<mesh|\$\((?!arg\b)')


def needs_other_files(text: str) -> bool:
    """Say whether a xacro or URDF may mean something else, or nothing, on another machine."""
    return _NEEDS_OTHERS.search(text) is not None


def self_contained_urdf(urdf: str, where: str, find: MeshFinder) -> str:
    """Return a URDF with the outer corners of its meshes in place of their files' names.

    What is found out about a robot is the same with it as with the meshes. So all collision meshes are written out, and
    the visual meshes of links whose visual shapes count; other visual meshes keep their names. Without any such mesh
    it is the text as it is.

    Args:
        urdf: the XML, xacro expanded.
        where: begins errors: the robot's file.
        find: finds a mesh's file.

    Raises:
        ConfigError: a collision mesh is missing, broken or too large.
    """
    tree = parse_urdf(urdf, where)
    left_out = Findings()
    simple = primitive_tree(without_unread_meshes(tree, find, left_out), find, Findings())
    is_changed = bool(left_out.warnings)
    for link in tree.xml.findall('link'):
        kinds = ('collision', 'visual') if simple.links[link.get('name', '')].visuals else ('collision',)
        meshes = [mesh for kind in kinds for mesh in link.findall(f'{kind}/geometry/mesh')]
        for mesh in meshes:
            is_changed |= _list_corners(mesh, where, find)
    return ElementTree.tostring(tree.xml, encoding='unicode') if is_changed else urdf


def _list_corners(mesh: ElementTree.Element, where: str, find: MeshFinder) -> bool:
    """Put a mesh's corners in place of its file's name; say whether that was needed and possible."""
    uri = mesh.get('filename', '').strip()
    if is_listed(uri):
        return False
    try:
        mesh.set('filename', listed_mesh(uri, file_corners_m(uri, where, find)))
    except ConfigError:  # of a visual mesh: it does not count here either
        return False
    return True


class GeometryErrors(NamedTuple):
    """What the true wheels differ by from the description's, relative."""

    left_radius: float = 0.0
    right_radius: float = 0.0
    separation: float = 0.0

    def applied_to(self, description: RobotDescription) -> TrueWheels:
        """Return the true wheels of a robot."""
        radius_m = 0.5 * description.wheel_diameter_m
        return TrueWheels(
            radius_m * (1.0 + self.left_radius),
            radius_m * (1.0 + self.right_radius),
            description.wheel_separation_m * (1.0 + self.separation),
        )

    def arguments(self) -> Tuple[Tuple[str, str], ...]:
        """Return the errors that are not 0 as xacro arguments, under the names that ALTO's file has for them."""
        named = {
            'wheel_radius_error_left': self.left_radius,
            'wheel_radius_error_right': self.right_radius,
            'wheel_separation_error': self.separation,
        }
        return tuple((name, repr(error)) for name, error in named.items() if error)


NO_ERRORS = GeometryErrors()


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


def load_simulated_robot(
    source: RobotSource, choices: RobotChoices, errors: GeometryErrors = NO_ERRORS
) -> SimulatedRobot:
    """Read a robot and make its physics right.

    One that is sound keeps its masses and shapes. Errors of its wheels are then those of its own xacro arguments;
    without such arguments, and for all other robots, the wheels of the simulated robot are changed.

    Raises:
        ConfigError: the robot's files are bad, or describe no robot with two driven wheels.
    """
    description = describe(source, choices)
    wheels = errors.applied_to(description)
    sound = _as_it_is(source, description, errors)
    if sound is not None and np.allclose(sound.wheels, wheels, rtol=1e-6, atol=0.0):
        return sound
    return SimulatedRobot(description, physics_urdf(description, wheels), wheels, FLOOR_ONLY_LINKS)


def _as_it_is(source: RobotSource, description: RobotDescription, errors: GeometryErrors) -> Optional[SimulatedRobot]:
    """Return a robot of the file's own URDF; None where that is not sound."""
    declared = expansion(source).declared
    arguments = {**dict(source.arguments), **{name: value for name, value in errors.arguments() if name in declared}}
    urdf = expansion(source._replace(arguments=tuple(arguments.items()))).urdf
    sound = _sound(urdf, str(source.file), description.left.joint, description.right.joint)
    return sound and SimulatedRobot(description, *sound, ())


@functools.lru_cache(maxsize=16)  # trials of a campaign ask again and again
def _sound(urdf: str, where: str, left_joint: str, right_joint: str) -> Optional[Tuple[str, TrueWheels]]:
    """Return what PyBullet loads of a sound URDF, and its wheels; None of another."""
    tree = parse_urdf(urdf, where)
    wheels = sound_wheels(tree, left_joint, right_joint)
    return wheels and (joined_links(tree), wheels)
