"""The text of a robot file: what was found out about a robot, for its user to look through and change."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Dict, Iterator, List

import yaml

from diff_encoder_sim.robots.proposed_laser import proposed_laser
from diff_encoder_sim.robots.robot_setup import RobotSetup

COMMENTS_FROM = 60  # column

# Rows of the table of what was found, by the settings that follow from them; where a row is missing, config/ decides.
_QUANTITIES = {
    'config.left_joint': 'left wheel joint',
    'config.right_joint': 'right wheel joint',
    'simulator.left_joint': 'left wheel joint',
    'simulator.right_joint': 'right wheel joint',
    'config.wheel_diameter': 'wheel diameter [m]',
    'simulator.wheel_diameter': 'wheel diameter [m]',
    'config.wheel_separation': 'wheel separation [m]',
    'simulator.wheel_separation': 'wheel separation [m]',
    'config.axle_x': 'axle',
    'amcl.axle_x': 'axle',
    'config.base_frame': 'base frame',
    'simulator.laser_link': 'laser link',
    'simulator.lidar': 'laser',
    'simulator.drive.wheel_torque': 'wheel torque [N m]',
    'simulator.drive.max_linear_acceleration': 'highest acceleration [m/s^2]',
    'simulator.drive.max_angular_acceleration': 'highest angular acceleration [rad/s^2]',
    'simulator.drive.max_linear_speed': 'highest speed [m/s]',
    'simulator.drive.max_angular_speed': 'highest turning rate [rad/s]',
    'navigation.global_costmap.footprint': 'footprint',
    'navigation.local_costmap.footprint': 'footprint',
}

_UNITS = {
    'wheel_diameter': '[m]',
    'wheel_separation': '[m]',
    'axle_x': '[m]',
    'footprint': '[m]',
    'range_min': '[m]',
    'range_max': '[m]',
    'noise': '[m]',
    'laser_max_range': '[m]',
    'angle_min': '[rad]',
    'angle_span': '[rad]',
    'rate': '[Hz]',
    'wheel_torque': '[N m]',
    'max_linear_speed': '[m/s]',
    'max_vel_x': '[m/s]',
    'max_vel_trans': '[m/s]',
    'max_angular_speed': '[rad/s]',
    'max_vel_theta': '[rad/s]',
    'min_vel_theta': '[rad/s]',
    'max_linear_acceleration': '[m/s^2]',
    'acc_lim_x': '[m/s^2]',
    'max_angular_acceleration': '[rad/s^2]',
    'acc_lim_theta': '[rad/s^2]',
}

_GROUPS = {
    'config': 'Encoder and odometry: the geometry that odometry assumes',
    'simulator': 'The simulated robot',
    'amcl': 'Localization',
    'navigation': 'Navigation',
    'lockstep': 'Computing times',
}


def robot_file_text(setup: RobotSetup, path: Path) -> str:
    """Return the robot file of a robot, to be written to `path`, from where its own paths start."""
    return '\n'.join([*_head(setup, path.parent), *_settings(setup)]) + '\n'


def _head(setup: RobotSetup, folder: Path) -> Iterator[str]:
    source = setup.file.source
    yield f'# {setup.name}, as check_robot found it. Change what you know better: this file goes before the URDF.'
    yield '# Under `set`, any key of config.yaml, simulator.yaml, amcl.yaml, navigation.yaml and lockstep.yaml can'
    yield '# be set, as FILE.KEY.'
    yield _line('urdf', _relative(source.file, folder), '# xacro or URDF, relative to this file')
    if source.arguments:
        yield _line('arguments', dict(source.arguments), "# of the xacro's xacro:arg")
    if source.package_folders:
        yield _line('packages', [_relative(each, folder) for each in source.package_folders], '# folders of packages')
    known = setup.file.ppr is not None
    ppr = _line('ppr', setup.file.ppr if known else 90, "# counts per wheel revolution of the robot's own encoder")
    yield ppr if known else f'# {ppr}'
    yield from _laser(setup)
    yield 'set:'


def _laser(setup: RobotSetup) -> Iterator[str]:
    """Yield the laser that the user added, or a proposal for a robot without one."""
    added = setup.file.source.added_laser
    if added is not None:
        yield _line(
            'laser', {'parent': added.parent, 'xyz': list(added.xyz_m)}, '# [m] a scanner in place of those of the URDF'
        )
    elif setup.description.laser is None:
        place = proposed_laser(setup.description).place()
        yield '# ' + _line('laser', place, '# [m] no laser was found: this adds one above the robot')


def _settings(setup: RobotSetup) -> Iterator[str]:
    by_stem: Dict[str, List[str]] = {}
    for key in setup.settings:
        by_stem.setdefault(key.partition('.')[0], []).append(key)
    for stem, keys in by_stem.items():
        yield f'  # {_GROUPS.get(stem, stem)}'
        for key in keys:
            unit = _UNITS.get(key.rpartition('.')[2], '')
            comment = ' '.join(filter(None, [unit, _source(setup, key)]))
            yield '  ' + _line(key, setup.settings[key], comment and f'# {comment}')


def _source(setup: RobotSetup, key: str) -> str:
    """Return where a value is from; '' where it follows from others."""
    if key in setup.file.overrides:
        return setup.file.where
    quantity = _QUANTITIES.get(key) or _QUANTITIES.get(key.rpartition('.')[0])
    return next((row.source for row in setup.description.found if row.quantity == quantity), '')


def _line(key: str, value: Any, comment: str) -> str:
    # A single value ends with the mark of a document's end.
    text = yaml.safe_dump(value, default_flow_style=True, width=10_000, allow_unicode=True).strip().replace('\n...', '')
    return f'{f"{key}: {text}".ljust(COMMENTS_FROM)} {comment}'.rstrip()


def _relative(path: Path, folder: Path) -> str:
    return os.path.relpath(str(path.resolve()), str(folder.resolve()))
