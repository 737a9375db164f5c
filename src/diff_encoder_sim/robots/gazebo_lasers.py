"""The planar laser scanners that a URDF's <gazebo> elements describe."""

from __future__ import annotations

import math
from typing import Dict, NamedTuple, Optional, Tuple
from xml.etree import ElementTree

import numpy as np

from diff_encoder_sim.base.plain_numbers import plain_float
from diff_encoder_sim.base.xml_values import rotation_from_rpy
from diff_encoder_sim.robots.gazebo_tags import tag_words
from diff_encoder_sim.robots.robot_tree import RobotTree

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
        number = math.nan if element is None else plain_float(element.text or '')
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
        numbers = [plain_float(word) for word in words]
    except ValueError:
        return pose
    if len(numbers) == 6 and all(map(math.isfinite, numbers)):
        pose[:3, :3], pose[:3, 3] = rotation_from_rpy(*numbers[3:]), numbers[:3]
    return pose
