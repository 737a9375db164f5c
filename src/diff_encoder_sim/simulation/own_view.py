"""Where the scanner is on the robot, and whether the robot stands in its own light."""

from __future__ import annotations

import math
from typing import List, Tuple

import numpy as np

from diff_encoder_sim.robots.proposed_laser import proposed_laser_line
from diff_encoder_sim.robots.robot_description import RobotDescription, RobotLaser
from diff_encoder_sim.robots.robot_tree import Mesh
from diff_encoder_sim.robots.solids import holds_point, reach_m
from diff_encoder_sim.simulation.check_results import Check
from diff_encoder_sim.simulation.lidar import LidarParams
from diff_encoder_sim.simulation.physics import BulletPhysics

_RAYS = 360
_SIX_WAYS = np.vstack([np.eye(3), -np.eye(3)])
_FAR_M = 5.0  # beyond any part of a robot
_MOST_HIDDEN = 0.1  # of the rays: posts and cables
_LEAST_HIDDEN = 0.01  # PyBullet hits a cylinder from inside by single rays along its axes


def check_laser(description: RobotDescription, physics: BulletPhysics, lidar: LidarParams) -> Check:
    """Check the scanner of a robot that stands at rest in the world's origin."""
    mount = description.laser
    if mount is None:
        return Check(
            'laser', 'none', True, f'closed-loop trials need one, which is added by {proposed_laser_line(description)}'
        )
    (x_m, y_m, z_m), yaw_rad = _place(mount)
    height_m = z_m + physics.base_pose()[0][2]
    place = f'{mount.link} at x {x_m:.3f}, y {y_m:.3f}, {height_m:.3f} m above the floor, '
    place += f'turned by {math.degrees(yaw_rad):.0f} degrees, ' if abs(yaw_rad) > 1e-3 else ''
    if height_m <= 0.0:
        return Check('laser', f'{place}below the floor', False, f'give {mount.link} a place above the floor')
    bearings_rad = lidar.angle_min + lidar.angle_span * np.arange(_RAYS) / _RAYS
    directions = np.stack([np.cos(bearings_rad + yaw_rad), np.sin(bearings_rad + yaw_rad), np.zeros(_RAYS)], axis=1)
    begin_m, end_m = (np.array([x_m, y_m, height_m]) + reach_m * directions for reach_m in (lidar.range_min, _FAR_M))
    hidden = physics.is_seen(begin_m, end_m)
    # Rays do not see a shape that they begin in.
    begin_in_root_m = begin_m - [0.0, 0.0, height_m - z_m]
    is_inside = all(any(holds_point(shape, point_m) for shape in description.hull) for point_m in begin_in_root_m)
    if is_inside and not _is_in_its_case(description, mount.link):
        return _inside(description, f'{place}inside a collision shape of the robot')
    return _hidden(place, bearings_rad, hidden)


def _place(mount: RobotLaser) -> Tuple[List[float], float]:
    pose = mount.pose_in_root
    return pose[:3, 3].tolist(), math.atan2(pose[1, 0], pose[0, 0])


def _is_in_its_case(description: RobotDescription, link: str) -> bool:
    """Return whether the scanner is in a shape of its own link: real rays begin outside of that."""
    shapes = description.tree.links[link].collisions
    cases = [shape for shape in shapes if not isinstance(shape.geometry, Mesh)]
    return any(all(reach_m([case], way) > 0.0 for way in _SIX_WAYS) for case in cases)


def _inside(description: RobotDescription, value: str) -> Check:
    """Judge a scanner within a shape: that may be because the shape stands in for a mesh with a recess."""
    shapes = (shape for link in description.tree.links.values() for shape in link.collisions)
    if any(isinstance(shape.geometry, Mesh) for shape in shapes):
        return Check(
            'laser', value, True, 'meshes are replaced by their hulls; nothing of the robot hides the world here'
        )
    return Check('laser', value, False, 'move the link, or make the shape smaller')


def _hidden(place: str, bearings_rad: np.ndarray, hidden: np.ndarray) -> Check:
    if hidden.mean() < _LEAST_HIDDEN:
        return Check('laser', f'{place}sees nothing of the robot', True, '')
    seen_deg = np.degrees(bearings_rad[hidden])
    value = (
        f'{place}sees the robot itself in {100 * hidden.mean():.0f} % of its rays, '
        f'from {seen_deg.min():.0f} to {seen_deg.max():.0f} degrees'
    )
    advice = (
        'the simulated scanner sees through the robot: limit simulator.lidar.angle_min and angle_span to what is free'
    )
    return Check('laser', value, bool(hidden.mean() <= _MOST_HIDDEN), advice)
