"""Worlds: the solid primitives of the SDF files that Gazebo loads."""

from __future__ import annotations

from pathlib import Path
from typing import List, NamedTuple, Union
from xml.etree import ElementTree

import numpy as np

from diff_encoder_sim.base.bounds import FRICTION
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.xml_values import bounded_numbers, finite_numbers, parse_lengths, rotation_from_rpy
from diff_encoder_sim.robots.solids import Box, Cylinder, Sphere, pose_at

ALLOWED_SHAPES = ('box', 'cylinder', 'sphere', 'plane')


class Plane(NamedTuple):
    """An unbounded floor: z = 0 of its pose is its surface."""

    mu: float = 1.0  # friction coefficient


Shape = Union[Box, Cylinder, Sphere, Plane]


class Solid(NamedTuple):
    """One collision primitive that stands still in the world."""

    name: str  # model/link/collision
    shape: Shape
    pose_in_world: np.ndarray  # 4x4 homogeneous


class Model(NamedTuple):
    """A named group of solids, as Gazebo reports it in /gazebo/model_states."""

    name: str
    pose_in_world: np.ndarray  # 4x4 homogeneous
    solids: List[Solid]


class World(NamedTuple):
    """The models of a world file, as far as a robot can collide with them or see them."""

    name: str
    models: List[Model]

    @property
    def solids(self) -> List[Solid]:
        """All collision primitives of all models."""
        return [solid for model in self.models for solid in model.solids]

    @property
    def floor_friction(self) -> float:
        """Friction coefficient of the first floor."""
        return next(solid.shape.mu for solid in self.solids if isinstance(solid.shape, Plane))


def load_world(path: Union[str, Path]) -> World:
    """Read the static primitives of an SDF 1.x world; ConfigError if they cannot be read or simulated."""
    try:
        root = ElementTree.parse(str(path)).getroot()
    except OSError as error:
        raise ConfigError(f'{path}: cannot be read: {error.strerror}') from None
    except (ElementTree.ParseError, LookupError, ValueError) as error:  # also of an encoding that is none of text
        raise ConfigError(f'{path}: not valid XML: {error}') from None
    element = root.find('world')
    if root.tag != 'sdf' or element is None:
        raise ConfigError(f'{path}: given <{root.tag}>; allowed: <sdf> with a <world>')
    if element.find('include') is not None:
        raise ConfigError(f'{path}: <include> is given; allowed: models of primitives in the file')
    world = World(element.get('name', Path(path).stem), [_model_of(model, path) for model in element.findall('model')])
    if not any(isinstance(solid.shape, Plane) for solid in world.solids):
        raise ConfigError(f'{path}: there is no floor; allowed: a model with a plane collision')
    return world


def _model_of(element: ElementTree.Element, path: Union[str, Path]) -> Model:
    model = Model(element.get('name', 'model'), _pose_of(element, path), [])
    if element.findtext('static', 'false').strip() not in ('true', '1'):
        raise ConfigError(f'{path}: model {model.name!r} moves; allowed: <static>true</static>')
    for link in element.findall('link'):
        link_pose = model.pose_in_world @ _pose_of(link, path)
        for collision in link.findall('collision'):
            name = f'{model.name}/{link.get("name")}/{collision.get("name")}'
            pose = link_pose @ _pose_of(collision, path)
            model.solids.append(Solid(name, _shape_of(collision, name, path), pose))
    return model


def _shape_of(collision: ElementTree.Element, name: str, path: Union[str, Path]) -> Shape:
    geometry = collision.find('geometry')
    element = next(iter(geometry), None) if geometry is not None else None
    kind = 'nothing' if element is None else element.tag
    if element is None or kind not in ALLOWED_SHAPES:
        raise ConfigError(f'{path}: {name}: geometry {kind} is given; allowed: {", ".join(ALLOWED_SHAPES)}')
    where = f'{path}: {name}: {kind}'
    if kind == 'box':
        x_m, y_m, z_m = parse_lengths(element.findtext('size'), 3, f'{where} size')
        return Box((x_m, y_m, z_m))
    if kind == 'plane':
        return Plane(_friction_of(collision, f'{path}: {name}'))
    radius_m = parse_lengths(element.findtext('radius'), 1, f'{where} radius')[0]
    if kind == 'sphere':
        return Sphere(radius_m)
    return Cylinder(radius_m, parse_lengths(element.findtext('length'), 1, f'{where} length')[0])


def _friction_of(collision: ElementTree.Element, where: str) -> float:
    """Return the friction coefficient of a collision, 1 by default, as in SDF."""
    key = 'surface/friction/ode/mu'
    text = collision.findtext(key, '1').strip()
    numbers = finite_numbers(text)
    if len(numbers) != 1 or not FRICTION.allows(numbers[0]):
        raise ConfigError(f'{where}: {key}: given {text!r}; allowed: {FRICTION}')
    return numbers[0]


def _pose_of(element: ElementTree.Element, path: Union[str, Path]) -> np.ndarray:
    """Return the 4x4 pose of an element in its parent; SDF writes x y z roll pitch yaw."""
    text = element.findtext('pose')
    if text is None:
        return np.eye(4)
    where = f'{path}: {element.tag} {element.get("name")!r} pose'
    x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad = bounded_numbers(text, 6, where)
    return pose_at((x_m, y_m, z_m), rotation_from_rpy(roll_rad, pitch_rad, yaw_rad))
