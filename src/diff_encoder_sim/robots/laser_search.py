"""The place of the scanner: by the user, by a Gazebo sensor, by a link's name."""

from __future__ import annotations

import math
import re
from typing import Dict, Iterator, NamedTuple, Optional, Tuple
from xml.etree import ElementTree

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import did_you_mean
from diff_encoder_sim.base.xml_values import rotation_from_rpy
from diff_encoder_sim.robots.description import Findings, RobotLaser, RobotTree
from diff_encoder_sim.robots.driven_wheels import tag_words

SENSOR_TYPES = ('ray', 'gpu_ray', 'lidar', 'gpu_lidar')
TURN_RAD = 2.0 * math.pi
SHORTEST_PERIOD_S = 0.01  # of a scan; periods are whole multiples of it
FRAME_TAGS = ('framename', 'gzframeid', 'ignitionframeid')
MOST_RAYS = 100_000  # that LidarParams allows
FEWEST_RAYS = 8  # range finders have fewer


class LaserTags(NamedTuple):
    """A planar scanner of a <sensor> element."""

    source: str
    link: str
    frame: str  # of its scans; '' where it is not given
    pose_in_link: np.ndarray  # (4, 4)
    settings: Dict[str, float]  # keys of LidarParams, as far as they are given
    notes: Tuple[str, ...]


def gazebo_lasers(tree: RobotTree) -> Tuple[LaserTags, ...]:
    """Return the planar scanners in the file's order; those that scan in several planes are none."""
    found = []
    for element in tree.xml.iter('gazebo'):
        for sensor in element.iter('sensor'):
            if sensor.get('type') in SENSOR_TYPES and _rays(sensor, 'vertical') <= 1:
                found.append(_read_laser(tree, element.get('reference', ''), sensor))
    return tuple(laser for laser in found if laser is not None)


def _read_laser(tree: RobotTree, link: str, sensor: ElementTree.Element) -> Optional[LaserTags]:
    rays = _rays(sensor, 'horizontal')
    if rays < FEWEST_RAYS or link not in tree.links:
        return None
    settings, notes = _angles(sensor, rays), []
    for key, path in (('range_min', 'range/min'), ('range_max', 'range/max'), ('noise', 'noise/stddev')):
        number = _number(sensor, path)
        if number is not None and (number > 0.0 or key != 'range_max'):
            settings[key] = max(0.0, number)
    if settings.get('range_min', 0.0) >= settings.get('range_max', math.inf):
        del settings['range_min'], settings['range_max']
    rate_hz = _number(sensor, 'update_rate')
    if rate_hz is not None and rate_hz > 0.0:
        settings['rate'] = whole_period_rate_hz(rate_hz)
        if not math.isclose(settings['rate'], rate_hz, rel_tol=1e-3):
            notes.append(
                f'laser {link!r}: {rate_hz:g} Hz is simulated as {settings["rate"]:.4g} Hz: periods are whole 10 ms'
            )
    source = f'<sensor type="{sensor.get("type")}"> of link {link!r}'
    return LaserTags(source, link, _frame(sensor), _pose(sensor), settings, tuple(notes))


def whole_period_rate_hz(rate_hz: float) -> float:
    """Return the nearest rate whose period is whole 10 ms."""
    return 1.0 / (SHORTEST_PERIOD_S * min(10_000, max(1, round(1.0 / (SHORTEST_PERIOD_S * rate_hz)))))


def _angles(sensor: ElementTree.Element, rays: int) -> Dict[str, float]:
    """Return samples, angle_min and angle_span; SDF's last ray is at max_angle, LidarParams' a step before its end."""
    first_rad, last_rad = _number(sensor, 'horizontal/min_angle'), _number(sensor, 'horizontal/max_angle')
    settings: Dict[str, float] = {'samples': rays}
    if first_rad is not None and last_rad is not None and last_rad > first_rad:
        settings['angle_min'] = max(-TURN_RAD, min(TURN_RAD, first_rad))
        settings['angle_span'] = min(TURN_RAD, (last_rad - first_rad) * rays / (rays - 1))
    return settings


def _rays(sensor: ElementTree.Element, direction: str) -> int:
    samples, resolution = _number(sensor, f'{direction}/samples'), _number(sensor, f'{direction}/resolution')
    return round(min(MOST_RAYS, (1.0 if samples is None else samples) * (1.0 if resolution is None else resolution)))


def _number(sensor: ElementTree.Element, path: str) -> Optional[float]:
    """Return the finite number below a sensor; plugins have tags of the same names, so a path names its parent."""
    element = sensor.find(f'.//{path}') if '/' in path else sensor.find(path)
    try:
        number = math.nan if element is None else float(element.text or '')
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def _frame(sensor: ElementTree.Element) -> str:
    named = (element.text for element in sensor.iter() if tag_words(element) in FRAME_TAGS)
    return next((text.strip().lstrip('/') for text in named if text), '')


def _pose(sensor: ElementTree.Element) -> np.ndarray:
    """Return the (4, 4) pose of a sensor in its link."""
    pose = np.eye(4)
    words = (sensor.findtext('pose') or '').split()
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        return pose
    if len(numbers) == 6 and all(map(math.isfinite, numbers)):
        pose[:3, :3], pose[:3, 3] = rotation_from_rpy(*numbers[3:]), numbers[:3]
    return pose


LEVEL_DEG = 5.0  # a scanner that leans less is simulated level
_NAMES = re.compile(r'laser|lidar|(^|_)scan(ner)?(_|$)|hokuyo|(^|_)(lds|sick|urg)(_|\d|$)', re.IGNORECASE)
_OTHERS = re.compile(
    'mount|bracket|support|holder|stand|plate|tower|screw|riser|inertia|wheel|camera|rgbd|depth|sonar|cliff',
    re.IGNORECASE,
)


class _Scanner(NamedTuple):
    link: str
    pose: np.ndarray  # (4, 4) in the root
    source: str
    settings: Dict[str, float]
    notes: Tuple[str, ...]


def find_laser(tree: RobotTree, chosen: Optional[str], seen: Findings) -> Optional[RobotLaser]:
    """Return the scanner; None, with a warning, where the robot has none.

    Args:
        tree: the robot.
        chosen: the user's link.
        seen: takes what is found.

    Raises:
        ConfigError: the user's link is missing, or leans.
    """
    scanners = list(_found(tree))
    if chosen is not None:
        (own,) = _chosen(tree, chosen)
        # The chosen link may be the frame of a sensor's scans.
        scanners = [own, *(each for each in scanners if not np.allclose(each.pose, own.pose, atol=1e-3))]
    level = [scanner for scanner in scanners if _is_level(scanner.pose)]
    leaning = [repr(scanner.link) for scanner in scanners if not _is_level(scanner.pose)]
    if leaning:
        seen.note(f'scanners that are not level are left out: {", ".join(leaning)}')
    if not level:
        seen.warn('no laser is found: simulator.laser_link names its link, `laser` in a robot file adds one')
        return None
    others = list(dict.fromkeys(scanner.link for scanner in level[1:] if scanner.link != level[0].link))
    if others:
        seen.note(f'one laser is simulated, {level[0].link!r}, and not {", ".join(map(repr, others))}')
    return _mount(level[0], seen)


def lean_deg(pose: np.ndarray) -> float:
    """Return the angle between the vertical and the z axis of a (4, 4) pose."""
    return math.degrees(math.acos(min(1.0, max(-1.0, float(pose[2, 2])))))


def _chosen(tree: RobotTree, link: str) -> Iterator[_Scanner]:
    """Yield the user's scanner, with what a sensor says of it."""
    if link not in tree.links:
        raise ConfigError(
            f'{tree.where}: given {link!r} as laser link, which is missing; '
            f'allowed: one of {", ".join(tree.links)}{did_you_mean(link, tree.links)}'
        )
    pose = tree.link_poses()[link]
    if not _is_level(pose):
        raise ConfigError(
            f'{tree.where}: given {link!r} as laser link, which leans by {lean_deg(pose):.0f} degrees; '
            f'allowed: a scanner upright within {LEVEL_DEG:.0f} degrees'
        )
    tags = next((tags for tags in gazebo_lasers(tree) if link in (tags.link, tags.frame)), None)
    yield _Scanner(link, pose, 'given', {} if tags is None else tags.settings, () if tags is None else tags.notes)


def _found(tree: RobotTree) -> Iterator[_Scanner]:
    """Yield scanners by Gazebo's sensors; without any, by names."""
    poses, sensors = tree.link_poses(), gazebo_lasers(tree)
    for tags in sensors:
        yield _by_sensor(tags, poses)
    if not sensors:
        parents = {joint.parent for joint in tree.joints.values()}
        named = [link for link in poses if _NAMES.search(link) and not _OTHERS.search(link)]
        # The frame of the scans is the end of a chain, below its case.
        for link in sorted(named, key=lambda link: link in parents):
            yield _Scanner(link, poses[link], "its link's name", {}, ())


def _by_sensor(tags: LaserTags, poses: Dict[str, np.ndarray]) -> _Scanner:
    """Return a sensor's scanner, in the frame of its scans where that is at the same place."""
    pose = poses[tags.link] @ tags.pose_in_link
    frame_pose = poses.get(tags.frame)
    if frame_pose is not None and np.allclose(frame_pose, pose, atol=1e-3):
        return _Scanner(tags.frame, frame_pose, tags.source, tags.settings, tags.notes)
    return _Scanner(tags.link, pose, tags.source, tags.settings, tags.notes)


def _is_level(pose: np.ndarray) -> bool:
    return lean_deg(pose) <= LEVEL_DEG or _is_upside_down(pose)


def _is_upside_down(pose: np.ndarray) -> bool:
    return lean_deg(pose) >= 180.0 - LEVEL_DEG


def _mount(scanner: _Scanner, seen: Findings) -> RobotLaser:
    """Return the scanner level and upright."""
    x_m, y_m, z_m = scanner.pose[:3, 3].tolist()
    settings, pose = dict(scanner.settings), scanner.pose
    if _is_upside_down(pose):
        seen.warn(f'laser {scanner.link!r} is upside down: simulated upright')
        pose, settings = _turned_over(pose), _reversed(settings)
    for note in scanner.notes:
        seen.note(note)
    seen.add('laser link', f'{scanner.link} at ({x_m:.3f}, {y_m:.3f}, {z_m:.3f}) m', scanner.source)
    if settings:
        shown = ', '.join(f'{key} {value:.4g}' for key, value in settings.items())
        seen.add('laser', shown, scanner.source if scanner.settings else 'default')
    return RobotLaser(scanner.link, pose, settings)


def _turned_over(pose: np.ndarray) -> np.ndarray:
    """Return a (4, 4) pose with its x axis in the same direction and z upward."""
    yaw_rad = math.atan2(pose[1, 0], pose[0, 0])
    upright = np.eye(4)
    upright[:2, :2] = [[math.cos(yaw_rad), -math.sin(yaw_rad)], [math.sin(yaw_rad), math.cos(yaw_rad)]]
    upright[:3, 3] = pose[:3, 3]
    return upright


def _reversed(settings: Dict[str, float]) -> Dict[str, float]:
    """Return the settings of rays that turn the other way: the last one is now the first."""
    if 'angle_min' not in settings:
        return settings
    step_rad = settings['angle_span'] / settings['samples']
    return {**settings, 'angle_min': -(settings['angle_min'] + settings['angle_span'] - step_rad)}
