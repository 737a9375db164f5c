"""The robot's links as TF frames, as robot_state_publisher publishes them."""

from __future__ import annotations

import math
from typing import Collection, List, Mapping, NamedTuple, Tuple
from xml.etree import ElementTree

from diff_encoder_sim.base.xml_values import Vector, joint_link, parse_numbers
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.xacro_expansion import expansion

ROOT_INERTIA = 'root_inertia'  # argument of a xacro that can put the root link's inertia on a separate link

QuatXyzw = Tuple[float, float, float, float]


class LinkFrame(NamedTuple):
    """A link's frame in that of its parent."""

    parent: str
    child: str
    translation_xyz_m: Vector
    quat_xyzw: QuatXyzw


class LinkFrames:
    """Frames of a URDF: those that are fixed, and those that turn with a joint."""

    def __init__(self, urdf: str) -> None:
        """Read the frames from a URDF's text; ConfigError if a joint's origin or axis is no vector."""
        self.fixed: List[LinkFrame] = []
        self._turning: List[Tuple[str, Vector, LinkFrame]] = []
        for joint in ElementTree.fromstring(urdf).findall('joint'):
            name, element = joint.get('name', ''), joint.find('origin')
            origin = {} if element is None else element.attrib
            x_m, y_m, z_m = parse_numbers(origin.get('xyz', '0 0 0'), 3, f'joint {name!r} origin xyz')
            roll_rad, pitch_rad, yaw_rad = parse_numbers(origin.get('rpy', '0 0 0'), 3, f'joint {name!r} origin rpy')
            # Fixed axes: roll about x first, yaw about z last.
            tilt = _product(_about((0.0, 1.0, 0.0), pitch_rad), _about((1.0, 0.0, 0.0), roll_rad))
            quat = _as_kdl(_product(_about((0.0, 0.0, 1.0), yaw_rad), tilt))
            frame = LinkFrame(joint_link(joint, 'parent'), joint_link(joint, 'child'), (x_m, y_m, z_m), quat)
            if joint.get('type') == 'fixed':
                self.fixed.append(frame)
                continue
            axis = joint.find('axis')
            text = '1 0 0' if axis is None else axis.get('xyz', '1 0 0')  # x is URDF's default
            x, y, z = parse_numbers(text, 3, f'joint {name!r} axis')
            length = math.sqrt(x * x + y * y + z * z)
            self._turning.append((name, (x / length, y / length, z / length), frame))
        # robot_state_publisher's order: alphabetical, by link and by joint.
        self.fixed.sort(key=lambda frame: frame.child)
        self._turning.sort(key=lambda turning: turning[0])

    def turned(self, angles_rad: Mapping[str, float]) -> List[LinkFrame]:
        """Return the turning frames of the joints whose angle is given, by the joints' names."""
        return [
            frame._replace(quat_xyzw=_as_kdl(_product(frame.quat_xyzw, _about(axis, angles_rad[name]))))
            for name, axis, frame in self._turning
            if name in angles_rad
        ]


def _about(axis: Vector, angle_rad: float) -> QuatXyzw:
    sine = math.sin(0.5 * angle_rad)
    return sine * axis[0], sine * axis[1], sine * axis[2], math.cos(0.5 * angle_rad)


def _product(first: QuatXyzw, second: QuatXyzw) -> QuatXyzw:
    x1, y1, z1, w1 = first
    x2, y2, z2, w2 = second
    return (
        w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
        w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
        w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
        w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
    )


def _as_kdl(quat: QuatXyzw) -> QuatXyzw:
    """Return the quaternion with KDL's sign: w is positive if it is above a half, else the largest of x, y, z is."""
    x, y, z, w = quat
    leading = w if 4.0 * w * w > 1.0 else max((x, y, z), key=abs)
    return quat if leading >= 0.0 else (-x, -y, -z, -w)


def without_root_inertia(source: RobotSource) -> RobotSource:
    """Return the source with the xacro's argument for it, if it has one."""
    if ROOT_INERTIA not in expansion(source).declared or ROOT_INERTIA in dict(source.arguments):
        return source
    return source._replace(arguments=(*source.arguments, (ROOT_INERTIA, 'false')))


def display_urdf(source: RobotSource, moving: Collection[str]) -> str:
    """Return the URDF with all joints fixed but those that are published on /joint_states, named by `moving`.

    A link below a joint without a state has no frame: a caster's, a laser's on a mast that can be lifted. The root link
    has no inertia, of which robot_state_publisher warns. ConfigError if the file cannot be read or expanded.
    """
    urdf = expansion(without_root_inertia(source)).urdf
    robot = ElementTree.fromstring(urdf.strip())
    still = [each for each in robot.findall('joint') if each.get('type') != 'fixed' and each.get('name') not in moving]
    for joint in still:
        joint.set('type', 'fixed')
        for element in (*joint.findall('mimic'), *joint.findall('limit')):
            joint.remove(element)
    children = {child.get('link') for child in robot.findall('joint/child')}
    roots = [link for link in robot.findall('link') if link.get('name') not in children]
    heavy = [(link, inertial) for link in roots for inertial in link.findall('inertial')]
    for link, inertial in heavy:
        link.remove(inertial)
    return ElementTree.tostring(robot, encoding='unicode') if still or heavy else urdf
