"""The robot's links as frames, as robot_state_publisher tells them."""

from __future__ import annotations

import math
from typing import List, Mapping, NamedTuple, Tuple
from xml.etree import ElementTree

from diff_encoder_sim.simulation.world import parse_numbers

Vector = Tuple[float, float, float]
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
        """Raises:
        ConfigError: a joint's origin or axis is no vector.
        """
        self.fixed: List[LinkFrame] = []
        self._turning: List[Tuple[str, Vector, LinkFrame]] = []
        for joint in ElementTree.fromstring(urdf).findall('joint'):
            frame = _frame_at_zero(joint)
            if joint.get('type') == 'fixed':
                self.fixed.append(frame)
            else:
                self._turning.append((joint.get('name', ''), _axis(joint), frame))
        # robot_state_publisher goes by link and by joint, in alphabetical order.
        self.fixed.sort(key=lambda frame: frame.child)
        self._turning.sort(key=lambda turning: turning[0])

    def turned(self, angles_rad: Mapping[str, float]) -> List[LinkFrame]:
        """The frames that turn, of those joints whose angle is given."""
        return [
            frame._replace(
                quat_xyzw=_with_largest_part_positive(_product(frame.quat_xyzw, _about(axis, angles_rad[name])))
            )
            for name, axis, frame in self._turning
            if name in angles_rad
        ]


def _frame_at_zero(joint: ElementTree.Element) -> LinkFrame:
    origin = joint.find('origin')
    attributes = origin.attrib if origin is not None else {}
    where = f'joint {joint.get("name")!r} origin'
    xyz_m = parse_numbers(attributes.get('xyz', '0 0 0'), 3, f'{where} xyz')
    roll, pitch, yaw = parse_numbers(attributes.get('rpy', '0 0 0'), 3, f'{where} rpy')
    # Fixed axes: roll about x first, yaw about z last.
    quat = _product(
        _about((0.0, 0.0, 1.0), yaw), _product(_about((0.0, 1.0, 0.0), pitch), _about((1.0, 0.0, 0.0), roll))
    )
    return LinkFrame(
        joint.find('parent').get('link', ''),
        joint.find('child').get('link', ''),
        tuple(xyz_m),
        _with_largest_part_positive(quat),
    )


def _axis(joint: ElementTree.Element) -> Vector:
    """Unit vector; URDF's default is x."""
    axis = joint.find('axis')
    text = '1 0 0' if axis is None else axis.get('xyz', '1 0 0')
    x, y, z = parse_numbers(text, 3, f'joint {joint.get("name")!r} axis')
    length = math.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


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


def _with_largest_part_positive(quat: QuatXyzw) -> QuatXyzw:
    """Of the two quaternions of a rotation the one that KDL gives: w where it is above a half,
    else the largest of x, y, z, is positive.
    """
    x, y, z, w = quat
    leading = w if 4.0 * w * w > 1.0 else max((x, y, z), key=abs)
    return quat if leading >= 0.0 else (-x, -y, -z, -w)
