"""The drive in a diff_drive_controller's YAML file that the URDF names."""

from __future__ import annotations

from pathlib import Path
from typing import AbstractSet, Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple

from diff_encoder_sim.base.bounded_numbers import is_number
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.robots.gazebo_tags import DIFFERENTIAL, SKID_STEER, DriveTags, tag_words, usable
from diff_encoder_sim.robots.robot_tree import RobotTree
from diff_encoder_sim.robots.rolling_wheels import RollingWheel, wheel_joints

_LIMITS = {
    ('linear', 'max_velocity'): 'max_linear_speed',
    ('linear', 'max_acceleration'): 'max_linear_acceleration',
    ('angular', 'max_velocity'): 'max_angular_speed',
    ('angular', 'max_acceleration'): 'max_angular_acceleration',
}


def controllers(tree: RobotTree, wheels: Sequence[RollingWheel]) -> Tuple[DriveTags, ...]:
    """Return the drive controllers in the parameter files that plugins name and that exist."""
    found: List[DriveTags] = []
    for plugin in tree.xml.iter('plugin'):
        for element in plugin.iter():
            if tag_words(element) in ('parameters', 'params'):
                found += _in_file((element.text or '').strip())
    carriers = wheel_joints(tree, wheels)
    return tuple(tags for each in found for tags in _of_robot(each, tree, carriers))


def controllers_in(content: Any, source: str) -> Iterator[DriveTags]:
    """Yield the drive controllers in the content of a YAML file, at whatever depth."""
    if not isinstance(content, Mapping):
        return
    left, right = (_names(content, side) for side in ('left', 'right'))
    if left and right:
        yield _controller(content, left, right, source)
    for below in content.values():
        yield from controllers_in(below, source)


def _of_robot(tags: DriveTags, tree: RobotTree, carriers: AbstractSet[str]) -> Iterator[DriveTags]:
    """Yield a controller without the joints that carry no wheel; of another robot's joints only the first."""
    left, right = (
        tuple(name for name in names if name in carriers) or tuple({*names[:1]} - {*tree.joints})
        for names in (tags.left_joints, tags.right_joints)
    )
    if left and right:
        kind = SKID_STEER if max(len(left), len(right)) > 1 else DIFFERENTIAL
        yield tags._replace(kind=kind, left_joints=left, right_joints=right)


def _in_file(name: str) -> Iterator[DriveTags]:
    path = Path(name[len('file://') :] if name.startswith('file://') else name)
    try:
        if name and path.is_file():
            yield from controllers_in(load_yaml(path), path.name)
    except (ConfigError, OSError):
        return  # the controller's own affair: the URDF alone decides


def _controller(content: Mapping[Any, Any], left: Tuple[str, ...], right: Tuple[str, ...], source: str) -> DriveTags:
    separation_m, radius_m = _number(content, 'wheel_separation'), _number(content, 'wheel_radius')
    if separation_m is not None:
        separation_m *= _number(content, 'wheel_separation_multiplier') or 1.0
    if radius_m is not None:
        radius_m *= (
            _number(content, 'wheel_radius_multiplier') or _number(content, 'left_wheel_radius_multiplier') or 1.0
        )
    diameter_m = None if radius_m is None else 2.0 * radius_m
    return DriveTags(source, DIFFERENTIAL, True, left, right, separation_m, diameter_m, _limits(content))


def _names(content: Mapping[Any, Any], side: str) -> Tuple[str, ...]:
    given = content.get(f'{side}_wheel_names', content.get(f'{side}_wheel'))
    names = given if isinstance(given, list) else [given]
    return tuple(dict.fromkeys(name for name in names if isinstance(name, str)))


def _limits(content: Mapping[Any, Any]) -> Dict[str, float]:
    """Return the limits that hold: each has a flag, true unless it is given."""
    limits = {}
    for (motion, name), key in _LIMITS.items():
        axis = f'{motion}.{"x" if motion == "linear" else "z"}'
        flag = _at(content, f'{axis}.has_{name.replace("max_", "")}_limits')
        number = _number(content, f'{axis}.{name}')
        if number is not None and flag is not False:
            limits[key] = number
    return limits


def _at(content: Any, dotted: str) -> Any:
    """Return what stands at a dotted key, which ROS 2 writes as one key and ROS 1 as nested ones."""
    if isinstance(content, Mapping) and dotted in content:
        return content[dotted]
    first, _, below = dotted.partition('.')
    return _at(content.get(first), below) if below and isinstance(content, Mapping) else None


def _number(content: Mapping[Any, Any], key: str) -> Optional[float]:
    value = _at(content, key)
    return usable(value) if is_number(value) else None
