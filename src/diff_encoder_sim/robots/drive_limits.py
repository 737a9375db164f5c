"""Limits of the drive, by plugins, controllers and the URDF's joint limits."""

from __future__ import annotations

from typing import Dict, Iterator, Sequence, Tuple

from diff_encoder_sim.robots.coaxial_pairs import WheelPair
from diff_encoder_sim.robots.drive_train import DriveTrain
from diff_encoder_sim.robots.findings import Findings
from diff_encoder_sim.robots.gazebo_tags import DriveTags
from diff_encoder_sim.robots.robot_tree import RobotTree
from diff_encoder_sim.robots.wheel_geometry import WheelGeometry

FASTEST_MPS = 5.0  # a joint's limit beyond it is a placeholder
SLOWEST_MPS = 0.05
G_MPS2 = 9.81

_UNITS = {
    'wheel_torque': 'wheel torque [N m]',
    'max_linear_speed': 'highest speed [m/s]',
    'max_angular_speed': 'highest turning rate [rad/s]',
    'max_linear_acceleration': 'highest acceleration [m/s^2]',
    'max_angular_acceleration': 'highest angular acceleration [rad/s^2]',
}

Limit = Tuple[str, float, str]  # key of DriveParams, value, source


def drive_limits(tree: RobotTree, drive: DriveTrain, mass_kg: float, seen: Findings) -> Dict[str, float]:
    """Return the limits that the robot's file gives, by keys of DriveParams; the first source of each counts.

    The torque is never more than one wheel could pass on if it carried the whole robot on a floor of friction 1:
    plugins give 10 N m and more to robots of 1 kg, which a real motor does not have, and which only lets wheels slip.
    """
    geometry = drive.geometry
    limits: Dict[str, Tuple[float, str]] = {}
    for key, value, source in [*_by_drives(drive.drives, geometry), *_by_joints(tree, drive.pair, geometry, seen)]:
        limits.setdefault(key, (value, source))
    traction_nm = mass_kg * G_MPS2 * 0.5 * geometry.diameter_m
    torque_nm, source = limits.get('wheel_torque', (traction_nm, ''))
    if torque_nm >= traction_nm:
        beyond = f' (given by {source}: {torque_nm:.4g})' if source else ''
        limits['wheel_torque'] = traction_nm, f'mass x g x wheel radius: more only slips{beyond}'
    for key, (value, source) in limits.items():
        seen.add(_UNITS[key], f'{value:.4g}', source)
    return {key: value for key, (value, _) in limits.items()}


def _by_drives(drives: Sequence[DriveTags], geometry: WheelGeometry) -> Iterator[Limit]:
    for tags in drives:
        for key, value in tags.limits.items():
            if key == 'rim_acceleration':
                yield 'max_linear_acceleration', value, tags.source
                yield 'max_angular_acceleration', 2.0 * value / geometry.separation_m, tags.source
            else:
                yield key, value, tags.source


def _by_joints(tree: RobotTree, pair: WheelPair, geometry: WheelGeometry, seen: Findings) -> Iterator[Limit]:
    """Yield what the joints' limits allow; zero stands for none."""
    joints = [tree.joints[name] for name in pair.joints]
    efforts_nm = [joint.effort for joint in joints if joint.effort]
    speeds_radps = [joint.speed for joint in joints if joint.speed]
    if efforts_nm:
        yield 'wheel_torque', min(efforts_nm), "the joints' effort limit"
    if not speeds_radps:
        return
    speed_mps = min(speeds_radps) * 0.5 * geometry.diameter_m
    if speed_mps < SLOWEST_MPS:
        seen.warn(
            f"the joints' velocity limit of {min(speeds_radps):.3g} rad/s, {speed_mps:.2g} m/s, "
            'is left out: too slow to drive'
        )
    elif speed_mps <= FASTEST_MPS:
        yield 'max_linear_speed', speed_mps, "the joints' velocity limit"
        yield 'max_angular_speed', 2.0 * speed_mps / geometry.separation_m, "the joints' velocity limit"
