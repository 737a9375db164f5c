"""Inertias that no body can have, found and replaced: published URDFs are full of them."""

from __future__ import annotations

from typing import Dict, Iterator, List, Mapping, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.description import MassProperties
from diff_encoder_sim.robots.meshes import MeshFinder, visual_primitives_of
from diff_encoder_sim.robots.robot_tree import Inertial, RobotTree, Shape
from diff_encoder_sim.robots.solids import farthest_m, homogeneous, link_mass, merged, placed

# Principal moments of a thin plate, a = b + c, come with few digits.
_ROUNDING = 0.05
_MOST_NAMED = 3
LEAST_KG = 1e-3  # of a robot: bounded_numbers allows wheels of 1 mm

LinkShapes = Mapping[str, Tuple[Shape, ...]]


class LinkMasses(NamedTuple):
    """What each link weighs."""

    by_link: Dict[str, MassProperties]  # in the root's frame, joints at zero; links without mass are left out
    warnings: Tuple[str, ...]  # a line for each kind of inertia that was replaced

    @property
    def total(self) -> MassProperties:
        """Return the mass of the robot."""
        return merged(self.by_link.values())


class _Fault(NamedTuple):
    """Why no body has an inertia."""

    kind: str
    detail: str


def link_masses(tree: RobotTree, shapes: LinkShapes, find: MeshFinder) -> LinkMasses:
    """Return all links' masses, absurd inertias replaced by those of homogeneous solids.

    Args:
        tree: the robot.
        shapes: each link's collision shapes, meshes replaced, in the link.
        find: finds the mesh of a visual shape, which stands in where a link has no collision shape.

    Raises:
        ConfigError: the robot has no mass, or one that no robot has.
    """
    poses = tree.link_poses()
    around = _shapes_around(tree, poses, shapes)
    by_link: Dict[str, MassProperties] = {}
    faults: Dict[str, _Fault] = {}
    for name, link in tree.links.items():
        if link.inertial is None or link.inertial.mass_kg <= 0:
            continue
        inertial = link.inertial
        com_m = link_mass(inertial, poses[name]).com_m
        fault = _fault(inertial, farthest_m(around[name], com_m) or np.inf)
        if fault is not None:
            faults[name] = fault
            solid = homogeneous(shapes[name] or visual_primitives_of(link, find), inertial.mass_kg)
            inertial = inertial._replace(inertia_kgm2=solid.inertia_kgm2)
        by_link[name] = link_mass(inertial, poses[name])
    if not by_link:
        raise ConfigError(
            f'{tree.where}: given no link with a mass; allowed: <inertial> with a mass greater than 0 in a link, '
            'such as that of the body'
        )
    masses = LinkMasses(by_link, tuple(_in_words(faults)))
    if masses.total.mass_kg < LEAST_KG:
        given = f'given {masses.total.mass_kg:.3g} kg in all links'
        raise ConfigError(f'{tree.where}: {given}; allowed: a robot of at least {LEAST_KG:g} kg')
    return masses


def _fault(inertial: Inertial, reach_m: float) -> Optional[_Fault]:
    """Return what is wrong with the inertia of a mass all within `reach_m` of its centre; None if nothing is."""
    moments = np.linalg.eigvalsh(inertial.inertia_kgm2)
    shown = 'principal moments ' + ', '.join(f'{moment:.3g}' for moment in moments) + ' kg m^2'
    if moments[0] <= 0:
        return _Fault('an inertia that is not positive', shown)
    if moments[0] + moments[1] < (1 - _ROUNDING) * moments[2]:
        return _Fault('an inertia of no body, one principal moment larger than the sum of the others', shown)
    gyration_m = float(np.sqrt(moments[2] / inertial.mass_kg))
    if gyration_m > reach_m:
        return _Fault(
            'an inertia of a body larger than its shapes',
            f'{moments[2]:.3g} kg m^2 of {inertial.mass_kg:.3g} kg: a radius of gyration of {1e3 * gyration_m:.0f} mm, '
            f'shapes within {1e3 * reach_m:.0f} mm',
        )
    return None


def _in_words(faults: Mapping[str, _Fault]) -> Iterator[str]:
    """Yield a line for each kind of fault, with the first of its links."""
    for kind in dict.fromkeys(fault.kind for fault in faults.values()):
        links = [f'{link} ({fault.detail})' for link, fault in faults.items() if fault.kind == kind]
        more = len(links) - _MOST_NAMED
        named = ', '.join(links[:_MOST_NAMED]) + (f' and {more} more' if more > 0 else '')
        yield f'{kind}, replaced by that of a homogeneous solid: {named}'


def _shapes_around(tree: RobotTree, poses: Mapping[str, np.ndarray], shapes: LinkShapes) -> Dict[str, List[Shape]]:
    """Return, by link, the shapes of all links that are fixed to it, and its own, in the root; else those of all."""
    joints = {joint.child: joint for joint in tree.joints.values()}
    around: Dict[str, List[Shape]] = {}
    for name, pose in poses.items():
        joint = joints.get(name)
        around[name] = around[joint.parent] if joint is not None and joint.kind == 'fixed' else []
        around[name] += [placed(shape, pose) for shape in shapes[name]]
    everything = [placed(shape, pose) for name, pose in poses.items() for shape in shapes[name]]
    return {name: found or everything for name, found in around.items()}
