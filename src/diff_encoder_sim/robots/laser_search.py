"""The place of the scanner: by the user, by a Gazebo sensor, by a link's name."""

from __future__ import annotations

import math
import re
from typing import Any, Dict, List, Optional
from xml.etree import ElementTree

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import did_you_mean
from diff_encoder_sim.base.xml_values import rotation_from_rpy
from diff_encoder_sim.robots.description import Findings, RobotLaser, RobotTree
from diff_encoder_sim.robots.drive_tags import tag_letters
from diff_encoder_sim.robots.solids import pose_at

SENSOR_TYPES = ('ray', 'gpu_ray', 'lidar', 'gpu_lidar')
TURN_RAD = 2.0 * math.pi
SHORTEST_PERIOD_S = 0.01  # of a scan; periods are whole multiples of it
FRAME_TAGS = ('framename', 'gzframeid', 'ignitionframeid')
MOST_RAYS = 100_000  # that LidarParams allows
FEWEST_RAYS = 8  # range finders have fewer
LEVEL_DEG = 5.0  # a scanner that leans less is simulated level
_NAMES = re.compile(r'laser|lidar|(^|_)scan(ner)?(_|$)|hokuyo|(^|_)(lds|sick|urg)(_|\d|$)', re.IGNORECASE)
_OTHERS = re.compile(
    'mount|bracket|support|holder|stand|plate|tower|screw|riser|inertia|wheel|camera|rgbd|depth|sonar|cliff',
    re.IGNORECASE,
)


def find_laser(tree: RobotTree, chosen: Optional[str], seen: Findings) -> Optional[RobotLaser]:
    """Return the scanner, level and upright; None, with a warning, if the robot has none.

    Args:
        tree: the robot.
        chosen: the user's link.
        seen: takes what is found.

    Raises:
        ConfigError: the user's link is missing, or leans.
    """
    sensors = gazebo_lasers(tree)
    scanners = [_in_frame_of_scans(sensor, tree) for sensor in sensors] if sensors else _by_names(tree)
    if chosen is not None:
        own = _chosen(tree, chosen, sensors)
        # The chosen link may be the frame of a sensor's scans.
        others = [each for each in scanners if not np.allclose(each.pose_in_root, own.pose_in_root, atol=1e-3)]
        scanners = [own, *others]
    level = [scanner for scanner in scanners if _is_level(scanner.pose_in_root)]
    leaning = [repr(scanner.link) for scanner in scanners if not _is_level(scanner.pose_in_root)]
    if leaning:
        seen.note(f'scanners that are not level are left out: {", ".join(leaning)}')
    if not level:
        seen.warn('no laser is found: simulator.laser_link names its link, `laser` in a robot file adds one')
        return None
    laser = level[0]
    unused = list(dict.fromkeys(repr(scanner.link) for scanner in level[1:] if scanner.link != laser.link))
    if unused:
        seen.note(f'one laser is simulated, {laser.link!r}, and not {", ".join(unused)}')
    x_m, y_m, z_m = laser.pose_in_root[:3, 3].tolist()
    if lean_deg(laser.pose_in_root) > 90.0:
        seen.warn(f'laser {laser.link!r} is upside down: simulated upright')
        laser = _turned_over(laser)
    for note in laser.notes:
        seen.note(note)
    seen.add('laser link', f'{laser.link} at ({x_m:.3f}, {y_m:.3f}, {z_m:.3f}) m', laser.source)
    if laser.settings:
        seen.add('laser', ', '.join(f'{key} {value:.4g}' for key, value in laser.settings.items()), laser.source)
    return laser


def _chosen(tree: RobotTree, link: str, sensors: List[RobotLaser]) -> RobotLaser:
    """Return the user's scanner, with the settings of its sensor."""
    if link not in tree.links:
        known = f'{", ".join(tree.links)}{did_you_mean(link, tree.links)}'
        raise ConfigError(f'{tree.where}: given {link!r} as laser link, which is missing; allowed: one of {known}')
    pose = tree.poses[link]
    if not _is_level(pose):
        raise ConfigError(
            f'{tree.where}: given {link!r} as laser link, which leans by {lean_deg(pose):.0f} degrees; '
            f'allowed: a scanner upright within {LEVEL_DEG:.0f} degrees'
        )
    sensor = next((each for each in sensors if link in (each.link, each.frame)), None)
    return RobotLaser(link, pose, sensor.settings if sensor else {}, 'given', notes=sensor.notes if sensor else ())


def _by_names(tree: RobotTree) -> List[RobotLaser]:
    """Return links that are scanners by name; first those at the end of a chain, below the case: frames of scans."""
    named = [link for link in tree.poses if _NAMES.search(link) and not _OTHERS.search(link)]
    named.sort(key=lambda link: bool(tree.below(link)))
    return [RobotLaser(link, tree.poses[link], {}, "its link's name") for link in named]


def _in_frame_of_scans(laser: RobotLaser, tree: RobotTree) -> RobotLaser:
    """Return a sensor's scanner in the frame of its scans, if that is at the same place."""
    frame_pose = tree.poses.get(laser.frame)
    if frame_pose is None or not np.allclose(frame_pose, laser.pose_in_root, atol=1e-3):
        return laser
    return laser._replace(link=laser.frame, pose_in_root=frame_pose)


def lean_deg(pose: np.ndarray) -> float:
    """Return the angle between the vertical and the z axis of a (4, 4) pose."""
    return math.degrees(math.acos(min(1.0, max(-1.0, float(pose[2, 2])))))


def _is_level(pose: np.ndarray) -> bool:
    """Return whether a scanner is level, upright or upside down."""
    return not LEVEL_DEG < lean_deg(pose) < 180.0 - LEVEL_DEG


def _turned_over(laser: RobotLaser) -> RobotLaser:
    """Return a scanner that is upside down upright, x axis as before, rays in reverse order: the last is the first."""
    pose, settings = laser.pose_in_root, laser.settings
    yaw_rad = math.atan2(pose[1, 0], pose[0, 0])
    if 'angle_min' in settings:
        step_rad = settings['angle_span'] / settings['samples']
        settings = {**settings, 'angle_min': -(settings['angle_min'] + settings['angle_span'] - step_rad)}
    upright = pose_at(pose[:3, 3], rotation_from_rpy(0.0, 0.0, yaw_rad))
    return laser._replace(pose_in_root=upright, settings=settings)


def gazebo_lasers(tree: RobotTree) -> List[RobotLaser]:
    """Return the planar scanners of <sensor> elements in the file's order, without those of several planes."""
    return [
        _sensor(tree, element.get('reference', ''), sensor)
        for element in tree.xml.iter('gazebo')
        for sensor in element.iter('sensor')
        if sensor.get('type') in SENSOR_TYPES
        and _rays(sensor, 'vertical') <= 1
        and _rays(sensor, 'horizontal') >= FEWEST_RAYS
        and element.get('reference', '') in tree.links
    ]


def _sensor(tree: RobotTree, link: str, sensor: ElementTree.Element) -> RobotLaser:
    rays, notes = _rays(sensor, 'horizontal'), []
    settings: Dict[str, Any] = {'samples': rays}
    first_rad, last_rad = _number(sensor, 'horizontal/min_angle'), _number(sensor, 'horizontal/max_angle')
    if first_rad is not None and last_rad is not None and last_rad > first_rad:
        # SDF's last ray is at max_angle, LidarParams' a step before its end.
        settings['angle_min'] = max(-TURN_RAD, min(TURN_RAD, first_rad))
        settings['angle_span'] = min(TURN_RAD, (last_rad - first_rad) * rays / (rays - 1))
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
            simulated = f'{rate_hz:g} Hz is simulated as {settings["rate"]:.4g} Hz'
            notes.append(f'laser {link!r}: {simulated}: periods are whole 10 ms')
    frames = (element.text for element in sensor.iter() if tag_letters(element) in FRAME_TAGS)
    frame = next((text.strip().lstrip('/') for text in frames if text), '')
    source = f'<sensor type="{sensor.get("type")}"> of link {link!r}'
    return RobotLaser(link, tree.poses[link] @ _pose(sensor), settings, source, frame, tuple(notes))


def whole_period_rate_hz(rate_hz: float) -> float:
    """Return the nearest rate whose period is whole 10 ms."""
    return 1.0 / (SHORTEST_PERIOD_S * min(10_000, max(1, round(1.0 / (SHORTEST_PERIOD_S * rate_hz)))))


def _rays(sensor: ElementTree.Element, direction: str) -> int:
    samples, resolution = _number(sensor, f'{direction}/samples'), _number(sensor, f'{direction}/resolution')
    return round(min(MOST_RAYS, (1.0 if samples is None else samples) * (1.0 if resolution is None else resolution)))


def _number(sensor: ElementTree.Element, path: str) -> Optional[float]:
    """Return the finite number below a sensor; plugins have tags of the same names, so a path names its parent."""
    element = sensor.find(f'.//{path}') if '/' in path else sensor.find(path)
    numbers = [] if element is None else _numbers(element.text)
    return numbers[0] if len(numbers) == 1 else None


def _pose(sensor: ElementTree.Element) -> np.ndarray:
    """Return the (4, 4) pose of a sensor in its link."""
    numbers = _numbers(sensor.findtext('pose'))
    return pose_at(numbers[:3], rotation_from_rpy(*numbers[3:])) if len(numbers) == 6 else np.eye(4)


def _numbers(text: Optional[str]) -> List[float]:
    """Return the numbers in a text; none if one is not finite."""
    try:
        numbers = [float(word) for word in (text or '').split()]
    except ValueError:
        return []
    return numbers if all(map(math.isfinite, numbers)) else []
