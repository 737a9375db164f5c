"""The place of the scanner: by the user, by a Gazebo sensor, by a link's name."""

from __future__ import annotations

import math
import re
from typing import Dict, Iterator, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.typed_params import did_you_mean
from diff_encoder_sim.robots.findings import Findings
from diff_encoder_sim.robots.gazebo_lasers import LaserTags, gazebo_lasers
from diff_encoder_sim.robots.robot_description import RobotLaser
from diff_encoder_sim.robots.robot_tree import RobotTree

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
