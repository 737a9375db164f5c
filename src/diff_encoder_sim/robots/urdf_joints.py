"""The <joint> of a URDF."""

from __future__ import annotations

import math
from typing import Optional
from xml.etree import ElementTree

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.plain_numbers import plain_float
from diff_encoder_sim.base.typed_params import did_you_mean
from diff_encoder_sim.base.xml_values import bounded_numbers, joint_link
from diff_encoder_sim.robots.robot_tree import Joint
from diff_encoder_sim.robots.urdf_values import named, parse_pose

JOINT_KINDS = ('fixed', 'continuous', 'revolute', 'prismatic', 'floating', 'planar')
_WITHOUT_AXIS = ('fixed', 'floating')


def parse_joint(element: ElementTree.Element, where: str) -> Joint:
    """Return a joint.

    Raises:
        ConfigError: it has no name, parent or child, an unknown type, or bad numbers.
    """
    name = named(element, where)
    place = f'{where}: joint {name!r}'
    kind, parent, child = element.get('type', ''), joint_link(element, 'parent'), joint_link(element, 'child')
    if kind not in JOINT_KINDS:
        raise ConfigError(
            f'{place}: type: given {kind!r}; allowed: {", ".join(JOINT_KINDS)}{did_you_mean(kind, JOINT_KINDS)}'
        )
    for end, link in (('parent', parent), ('child', child)):
        if not link:
            raise ConfigError(f'{place}: {end}: missing; allowed: <{end} link="..."/>')
    if parent == child:
        raise ConfigError(f'{place}: given {parent!r} as parent and child; allowed: two links')
    pose, axis = parse_pose(element, place), _axis(element, kind, place)
    effort, speed = _limit(element, 'effort', place), _limit(element, 'velocity', place)
    return Joint(name, kind, parent, child, pose, axis, effort, speed, element.find('mimic') is not None)


def _axis(joint: ElementTree.Element, kind: str, place: str) -> np.ndarray:
    """Return the (3,) unit axis; x where none is given or needed."""
    axis = joint.find('axis')
    if axis is None or kind in _WITHOUT_AXIS:
        return np.array([1.0, 0.0, 0.0])
    vector = np.array(bounded_numbers(axis.get('xyz', '1 0 0'), 3, f'{place}: axis xyz'))
    length = float(np.linalg.norm(vector))
    if length < 1e-6:
        raise ConfigError(f'{place}: axis xyz: given {axis.get("xyz")!r}; allowed: a direction, not zero')
    return vector / length


def _limit(joint: ElementTree.Element, key: str, place: str) -> Optional[float]:
    """Return a limit; None where there is none, or it is infinite."""
    limit = joint.find('limit')
    text = None if limit is None else limit.get(key)
    if text is None:
        return None
    try:
        value = plain_float(text)
    except ValueError:
        value = math.nan
    if math.isnan(value) or value < 0:
        raise ConfigError(f'{place}: limit {key}: given {text!r}; allowed: a number, not negative')
    return value if math.isfinite(value) else None
