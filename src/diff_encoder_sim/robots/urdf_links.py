"""The <link> of a URDF: mass, shapes, friction."""

from __future__ import annotations

from typing import Iterator, List, Optional
from xml.etree import ElementTree

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.xml_values import bounded_numbers
from diff_encoder_sim.robots.robot_tree import Box, Cylinder, Geometry, Inertial, Link, Mesh, Shape, Sphere
from diff_encoder_sim.robots.urdf_values import named, parse_pose

LEAST_KG = 1e-9  # of a link that has a mass
LEAST_M = 1e-9  # of a shape; a smaller one is of size zero


def parse_link(element: ElementTree.Element, where: str, notes: List[str]) -> Link:
    """Return a link; what is ignored of it is added to `notes`.

    Raises:
        ConfigError: it has no name, or bad numbers in its inertial or a collision.
    """
    name = named(element, where)
    place = f'{where}: link {name!r}'
    collisions = [_shape(each, f'{place}: collision') for each in element.findall('collision')]
    if None in collisions:
        notes.append(f'link {name!r}: a <collision> without a shape or of size zero is ignored')
    inertial = _inertial(element, place)
    if inertial is None and element.find('inertial') is not None:
        notes.append(f'link {name!r}: an <inertial> without mass is ignored')
    shapes = tuple(shape for shape in collisions if shape is not None)
    return Link(name, inertial, shapes, tuple(_visuals(element)), _friction(element, place))


def _inertial(link: ElementTree.Element, place: str) -> Optional[Inertial]:
    inertial, mass = link.find('inertial'), link.find('inertial/mass')
    if inertial is None or mass is None:
        return None
    (mass_kg,) = bounded_numbers(mass.get('value'), 1, f'{place}: mass value')
    if mass_kg < LEAST_KG and mass_kg != 0:
        raise ConfigError(f'{place}: mass value: given {mass.get("value")!r}; allowed: at least {LEAST_KG:g} [kg]')
    pose = parse_pose(inertial, f'{place}: inertial')
    rotation = pose[:3, :3]
    inertia = rotation @ _inertia(inertial.find('inertia'), place) @ rotation.T
    return Inertial(mass_kg, pose[:3, 3], inertia) if mass_kg > 0 else None


def _inertia(inertia: Optional[ElementTree.Element], place: str) -> np.ndarray:
    """Return the (3, 3) inertia [kg m^2] along the inertial's own axes; 0 where a number is missing."""
    keys = ('ixx', 'ixy', 'ixz', 'iyy', 'iyz', 'izz')
    given = {} if inertia is None else inertia.attrib
    xx, xy, xz, yy, yz, zz = (bounded_numbers(given.get(key, '0'), 1, f'{place}: inertia {key}')[0] for key in keys)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _visuals(link: ElementTree.Element) -> Iterator[Shape]:
    """Yield the visual shapes that are good; nothing depends on the others."""
    for visual in link.findall('visual'):
        try:
            shape = _shape(visual, '')
        except ConfigError:
            continue
        if shape is not None:
            yield shape


def _shape(element: ElementTree.Element, place: str) -> Optional[Shape]:
    """Return a shape; None where it is missing, of an unknown kind, or of size zero."""
    geometry = element.find('geometry')
    made = next((_geometry(each, place) for each in ([] if geometry is None else geometry)), None)
    return None if made is None else Shape(made, parse_pose(element, place))


def _geometry(element: ElementTree.Element, place: str) -> Optional[Geometry]:
    where = f'{place}: {element.tag}'
    if element.tag == 'mesh':
        return _mesh(element, where)
    if element.tag == 'box':
        x_m, y_m, z_m = sizes_m = _sizes_m(element, 'size', 3, where)
        return Box((x_m, y_m, z_m)) if min(sizes_m) > LEAST_M else None
    if element.tag == 'sphere':
        (radius_m,) = _sizes_m(element, 'radius', 1, where)
        return Sphere(radius_m) if radius_m > LEAST_M else None
    if element.tag in ('cylinder', 'capsule'):
        (radius_m,), (length_m,) = (_sizes_m(element, key, 1, where) for key in ('radius', 'length'))
        whole_m = length_m + 2 * radius_m if element.tag == 'capsule' else length_m
        return Cylinder(radius_m, whole_m) if min(radius_m, whole_m) > LEAST_M else None
    return None


def _mesh(element: ElementTree.Element, where: str) -> Mesh:
    uri = element.get('filename', '').strip()
    if not uri:
        raise ConfigError(f'{where}: filename: missing')
    x, y, z = bounded_numbers(element.get('scale', '1 1 1'), 3, f'{where} scale')
    if 0 in (x, y, z):
        raise ConfigError(f'{where} scale: given {element.get("scale")!r}; allowed: not zero')
    return Mesh(uri, (x, y, z))


def _sizes_m(element: ElementTree.Element, key: str, count: int, where: str) -> List[float]:
    sizes_m = bounded_numbers(element.get(key), count, f'{where} {key}')
    if min(sizes_m) < 0:
        raise ConfigError(f'{where} {key}: given {element.get(key)!r}; allowed: lengths greater than 0 [m]')
    return sizes_m


def _friction(link: ElementTree.Element, place: str) -> Optional[float]:
    friction = link.find('contact/lateral_friction')
    if friction is None:
        return None
    (value,) = bounded_numbers(friction.get('value'), 1, f'{place}: lateral_friction value')
    if value < 0:
        raise ConfigError(f'{place}: lateral_friction value: given {friction.get("value")!r}; allowed: not negative')
    return value
