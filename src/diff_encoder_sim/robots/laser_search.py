"""The place of the scanner: by the user, by a Gazebo sensor, by a link's name."""

from __future__ import annotations

import math
import re
from typing import Any, Dict, List, Optional
from xml.etree import ElementTree

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import did_you_mean
from diff_encoder_sim.base.xml_values import finite_numbers, rotation_from_rpy
from diff_encoder_sim.robots.description import Findings, RobotLaser, RobotTree
from diff_encoder_sim.robots.driven_wheels import tag_letters
from diff_encoder_sim.robots.solids import pose_at

SENSOR_TYPES = ('ray', 'gpu_ray', 'lidar', 'gpu_lidar')
TURN_RAD = 2.0 * math.pi
SHORTEST_PERIOD_S = 0.01  # of a scan; periods are whole multiples of it
MOST_PERIODS = 10_000
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
    """Return the level scanner; None, with a warning, without one. ConfigError if the user's choice is unusable."""
    scanners = sensors = gazebo_lasers(tree)
    if not sensors:  # first the links at the end of a chain, below the case: frames of scans
        named = [link for link in tree.poses if _NAMES.search(link) and not _OTHERS.search(link)]
        named.sort(key=lambda link: bool(tree.below(link)))
        scanners = [RobotLaser(link, tree.poses[link], {}, "its link's name") for link in named]
    if chosen is not None:
        given = f'{tree.where}: given {chosen!r} as laser link, which'
        if chosen not in tree.links:
            known = f'{", ".join(tree.links)}{did_you_mean(chosen, tree.links)}'
            raise ConfigError(f'{given} is missing; allowed: one of {known}')
        pose = tree.poses[chosen]
        if not _is_level(pose):
            raise ConfigError(f'{given} leans; allowed: a scanner upright within {LEVEL_DEG:.0f} degrees')
        nothing = RobotLaser(chosen, pose, {}, '')
        sensor = next((each for each in sensors if chosen in (each.link, each.carrier)), nothing)
        own = RobotLaser(chosen, pose, sensor.settings, 'given', notes=sensor.notes)
        # The chosen link may be the frame of a sensor's scans.
        scanners = [own, *(each for each in scanners if not np.allclose(each.pose_in_root, pose, atol=1e-3))]
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
    if laser.pose_in_root[2, 2] < 0.0:
        seen.warn(f'laser {laser.link!r} is upside down: simulated upright')
        # x axis as before, rays in reverse order: the last is the first.
        settings = dict(laser.settings)
        if 'angle_min' in settings:
            step_rad = settings['angle_span'] / settings['samples']
            settings['angle_min'] = -(settings['angle_min'] + settings['angle_span'] - step_rad)
        upright = rotation_from_rpy(0.0, 0.0, laser.pose_in_base.yaw_rad)
        laser = laser._replace(pose_in_root=pose_at(laser.pose_in_root[:3, 3], upright), settings=settings)
    for note in laser.notes:
        seen.note(note)
    x_m, y_m, z_m = laser.pose_in_root[:3, 3].tolist()
    seen.add('laser link', f'{laser.link} at ({x_m:.3f}, {y_m:.3f}, {z_m:.3f}) m', laser.source)
    if laser.settings:
        seen.add('laser', ', '.join(f'{key} {value:.4g}' for key, value in laser.settings.items()), laser.source)
    return laser


def _is_level(pose: np.ndarray) -> bool:
    """Return whether a scanner is level, upright or upside down."""
    return bool(abs(pose[2, 2]) >= math.cos(math.radians(LEVEL_DEG)))


def gazebo_lasers(tree: RobotTree) -> List[RobotLaser]:
    """Return the planar scanners of <sensor> elements in the file's order, without those of several planes.

    Each is in the frame of its scans, if that is at the same place as the sensor. Settings that are impossible are left
    out.
    """
    found = []
    sensors = [
        (each.get('reference', ''), sensor) for each in tree.xml.iter('gazebo') for sensor in each.iter('sensor')
    ]
    for carrier, sensor in sensors:
        kind, rays = sensor.get('type'), _rays(sensor, 'horizontal')
        is_scanner = kind in SENSOR_TYPES and _rays(sensor, 'vertical') <= 1 and rays >= FEWEST_RAYS
        if carrier not in tree.links or not is_scanner:
            continue
        numbers, pose = finite_numbers(sensor.findtext('pose')), tree.poses[carrier]
        if len(numbers) == 6:
            pose = pose @ pose_at(numbers[:3], rotation_from_rpy(*numbers[3:]))
        frames = (each.text for each in sensor.iter() if tag_letters(each) in FRAME_TAGS)
        link = next((text.strip().lstrip('/') for text in frames if text), '')
        if link in tree.poses and np.allclose(tree.poses[link], pose, atol=1e-3):
            pose = tree.poses[link]
        else:
            link = carrier
        settings: Dict[str, Any] = {'samples': rays}
        notes: List[str] = []
        first_rad, last_rad = _number(sensor, 'horizontal/min_angle'), _number(sensor, 'horizontal/max_angle')
        if last_rad > first_rad:
            # SDF's last ray is at max_angle, LidarParams' a step before its end.
            settings['angle_min'] = max(-TURN_RAD, min(TURN_RAD, first_rad))
            settings['angle_span'] = min(TURN_RAD, (last_rad - first_rad) * rays / (rays - 1))
        for key, path in (('range_min', 'range/min'), ('range_max', 'range/max'), ('noise', 'noise/stddev')):
            number = _number(sensor, path)
            if number > 0.0 or (key != 'range_max' and not math.isnan(number)):
                settings[key] = max(0.0, number)
        if settings.get('range_min', 0.0) >= settings.get('range_max', math.inf):
            del settings['range_min'], settings['range_max']
        rate_hz = _number(sensor, 'update_rate')
        if rate_hz > 0.0:  # the nearest whose period is whole
            periods = min(MOST_PERIODS, max(1, round(1.0 / (SHORTEST_PERIOD_S * rate_hz))))
            settings['rate'] = 1.0 / (SHORTEST_PERIOD_S * periods)
            if not math.isclose(settings['rate'], rate_hz, rel_tol=1e-3):
                simulated = f'{rate_hz:g} Hz is simulated as {settings["rate"]:.4g} Hz'
                notes.append(f'laser {carrier!r}: {simulated}: periods are whole 10 ms')
        found.append(RobotLaser(link, pose, settings, f'<sensor type="{kind}"> of link {carrier!r}', carrier, notes))
    return found


def _rays(sensor: ElementTree.Element, direction: str) -> int:
    numbers = [_number(sensor, f'{direction}/{name}') for name in ('samples', 'resolution')]
    return round(min(MOST_RAYS, math.prod(1.0 if math.isnan(number) else number for number in numbers)))


def _number(sensor: ElementTree.Element, path: str) -> float:
    """Return the number below a sensor, NaN if missing; plugins have tags of the same names, so a path has a parent."""
    numbers = finite_numbers(sensor.findtext(f'.//{path}' if '/' in path else path))
    return numbers[0] if len(numbers) == 1 else math.nan
