"""Old xacros, whose tags have no prefix: xacro took them until ROS Melodic, and published robots still have them."""

from __future__ import annotations

import xml.dom.minidom
from typing import Container

NOTE = 'an old xacro: tags without the prefix xacro: are taken as with it'

# Tags of xacro by the attribute that distinguishes them from others of the same name.
_TAGS = {
    'arg': 'default',
    'if': 'value',
    'include': 'filename',
    'insert_block': 'name',
    'macro': 'name',
    'property': 'name',
    'unless': 'value',
}

# What a macro may be named after, and is not a call of it where it stands alone.
_URDF_TAGS = frozenset(
    ['robot', 'link', 'joint', 'gazebo', 'transmission', 'material', 'ros2_control', 'sensor']
    + ['inertial', 'visual', 'collision', 'contact', 'origin', 'mass', 'inertia', 'geometry']
    + ['box', 'cylinder', 'sphere', 'mesh', 'color', 'texture', 'camera', 'ray', 'lidar', 'imu']
    + ['parent', 'child', 'axis', 'limit', 'dynamics', 'mimic', 'calibration', 'safety_controller']
)
_PLACES = frozenset(['robot', 'link', 'joint', 'visual', 'collision', 'xacro:macro', 'xacro:if', 'xacro:unless'])


def prefix_tags(document: xml.dom.minidom.Document) -> bool:
    """Give xacro's own tags in a document their prefix; return whether one had none."""
    found = False
    for element in document.getElementsByTagName('*'):
        key = _TAGS.get(element.tagName)
        if key and element.hasAttribute(key):
            _prefix(element)
            found = True
    return found


def prefix_call(element: xml.dom.minidom.Element, macros: Container[str]) -> bool:
    """Give a call of a macro its prefix; return whether it had none."""
    tag, parent = element.tagName, element.parentNode
    is_call = ':' not in tag and tag not in _URDF_TAGS and tag in macros
    if not is_call or parent is None or parent.nodeName not in _PLACES:
        return False
    _prefix(element)
    return True


def _prefix(element: xml.dom.minidom.Element) -> None:
    element.tagName = element.nodeName = f'xacro:{element.tagName}'
