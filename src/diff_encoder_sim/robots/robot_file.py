"""A robot as users name it (one of the package, a robot file, a xacro or URDF alone), and the settings that follow."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Union

import numpy as np
import yaml
from pydantic import Field

from diff_encoder_sim.base.bounds import Offset_m, PulsesPerTurn
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import Params, did_you_mean, load_params
from diff_encoder_sim.robots.calibration_file import CalibrationParams
from diff_encoder_sim.robots.describing import LIMITS, describe
from diff_encoder_sim.robots.description import AddedLaser, RobotChoices, RobotDescription, RobotSource, robot_file_line
from diff_encoder_sim.robots.solids import reach_m

ROBOT_FILE_SUFFIXES = ('.yaml', '.yml')

# Values of config/navigation.yaml and config/amcl.yaml, which hold unless the robot is slower or sees less.
_USUAL_LIMITS = {
    'max_vel_x': ('max_linear_speed', 0.45),
    'max_vel_trans': ('max_linear_speed', 0.45),
    'max_vel_theta': ('max_angular_speed', 1.0),
    'min_vel_theta': ('max_angular_speed', 0.2),
    'acc_lim_x': ('max_linear_acceleration', 0.7),
    'acc_lim_theta': ('max_angular_acceleration', 4.9),
}
_LASER_MAX_RANGE_M = 3.5
_DIGITS = 6
LASER_ABOVE_M = 0.05  # above the robot's highest point, where nothing of it is in the way

COMMENTS_FROM = 60  # column of a written robot file
CALIBRATED_HEAD = '# Calibrated by its drives; intervals are of 95 %.'
_HEAD = """# {}, as check_robot found it. Correct what is wrong: this file overrides the URDF.
# Under `set`, any key of config.yaml, simulator.yaml, amcl.yaml, navigation.yaml and lockstep.yaml can
# be set, as FILE.KEY."""
_UNITS = {  # of settings by the last part of their key
    '[m]': 'wheel_diameter wheel_separation axle_x footprint range_min range_max noise laser_max_range',
    '[m/s]': 'max_linear_speed max_vel_x max_vel_trans',
    '[m/s^2]': 'max_linear_acceleration acc_lim_x',
    '[rad]': 'angle_min angle_span',
    '[rad/s]': 'max_angular_speed max_vel_theta min_vel_theta',
    '[rad/s^2]': 'max_angular_acceleration acc_lim_theta',
    '[N m]': 'wheel_torque',
    '[Hz]': 'rate',
}
# Rows of the description's table that have another name than the setting.
_ROWS = {'left_joint': 'left wheel joint', 'right_joint': 'right wheel joint', 'axle_x': 'axle'}
_ROWS.update({key: row for key, (row, _) in LIMITS.items()})


class AddedLaserParams(Params):
    """A scanner for a robot, in place of those of its URDF."""

    parent: str = Field(min_length=1, description='link that carries it')
    xyz: List[Offset_m] = Field(min_length=3, max_length=3, description='place in that link [m]')


class RobotFileParams(Params):
    """The keys of a robot file; config/robots/ has patterns."""

    urdf: Optional[str] = Field(
        None, min_length=1, description='xacro or URDF file, relative to this file; recorded drives need none'
    )
    arguments: Dict[str, Union[bool, int, float, str]] = Field({}, description='xacro arguments by name')
    packages: List[str] = Field(
        [], description='folders in which packages of package:// and $(find) are looked for, relative to this file'
    )
    laser: Optional[AddedLaserParams] = Field(
        None, description='a level scanner, added as link `laser` and simulated in place of those of the URDF'
    )
    ppr: Optional[PulsesPerTurn] = Field(
        None, description="counts per wheel revolution of the robot's own encoder; need not be whole"
    )
    overrides: Dict[str, Any] = Field({}, alias='set', description='values of parameters, by dotted keys')
    calibration: Optional[CalibrationParams] = Field(None, description='written by calibrate; see below')


class RobotNotFound(ConfigError):
    """There is no robot of that name or path."""


class RobotFile(NamedTuple):
    """A robot's own files and numbers."""

    urdf: Optional[RobotSource]  # None of a robot that is known by its numbers only
    ppr: Optional[float]  # counts per wheel revolution; None if no robot file gives it
    overrides: Dict[str, Any]  # by dotted keys, as robot_params.override takes them
    label: str  # such as 'burger'
    where: str  # the file to name in errors about these values
    calibration: Optional[CalibrationParams] = None

    @property
    def source(self) -> RobotSource:
        """Return the robot's description; ConfigError if there is none."""
        if self.urdf is None:
            raise ConfigError(f"{self.where}: urdf: missing; expected the robot's xacro or URDF, which this needs")
        return self.urdf


SLIP = 'simulator.wheel_errors.slip_noise'
NO_ROBOT = RobotFile(None, None, {}, '', '')  # of which nothing is known


def load_robot_file(
    given: str, folder: Path, package_folder: Path, arguments: Mapping[str, str], packages: Sequence[Path] = ()
) -> RobotFile:
    """Load a robot by its name, its YAML file, or its xacro or URDF alone.

    A path is relative to `folder`; names are those of config/robots/ in `package_folder`. Arguments and packages of
    the command line precede those of the file. RobotNotFound; ConfigError if its file or a folder of packages is bad.
    """
    shipped, path = package_folder / 'config' / 'robots' / f'{given}.yaml', folder / Path(given).expanduser()
    if Path(given).name == given and shipped.is_file():  # a name takes precedence over a path
        path = shipped
    elif not given or not path.exists():
        names = robot_names(package_folder / 'config')
        allowed = f'{", ".join(names)}, or a .yaml, .xacro or .urdf file{did_you_mean(given, names)}'
        raise RobotNotFound(f'robot: given {given!r}, but there is no {path}; allowed: {allowed}')
    is_yaml = path.suffix in ROBOT_FILE_SUFFIXES
    params = load_params(RobotFileParams, path) if is_yaml else RobotFileParams(urdf=str(path))
    own_packages = [path.parent / Path(each).expanduser() for each in params.packages]
    for where, folders in (('packages', packages), (f'{path}: packages', own_packages)):
        for each in folders:
            if not each.is_dir():
                raise ConfigError(f'{where}: given {str(each)!r}; allowed: a folder that exists')
    source = None
    if params.urdf is not None:
        given_values = {**params.arguments, **arguments}.items()  # as text for xacro: true and false as in YAML
        values = {name: str(each).lower() if isinstance(each, bool) else str(each) for name, each in given_values}
        laser = None if params.laser is None else AddedLaser(params.laser.parent, tuple(params.laser.xyz))
        urdf = path.parent / Path(params.urdf).expanduser() if is_yaml else path
        urdf = urdf.resolve() if is_yaml and '..' in urdf.parts else urdf  # as people read it: a/b for a/c/../b
        source = RobotSource(urdf, tuple(sorted(values.items())), (*packages, *own_packages), laser)
    label = path.stem if is_yaml else path.name.partition('.')[0]
    return RobotFile(source, params.ppr, dict(params.overrides), label, str(path), params.calibration)


def robot_names(config_folder: Path) -> List[str]:
    """Return the names of the robots in config/robots."""
    return sorted(path.stem for path in (config_folder / 'robots').glob('*.yaml'))


def derived_settings(robot: RobotDescription) -> Dict[str, Any]:
    """Return settings by dotted keys from the stem of a file of config/; a robot file's own values precede these."""
    left_m, right_m = map(_rounded, robot.wheel_diameters_m)
    settings: Dict[str, Any] = dict.fromkeys(('config.axle_x', 'amcl.axle_x'), _rounded(robot.axle_x_m))
    for stem in ('config', 'simulator'):  # the simulated ones too: workers have only the URDF, not the user's choices
        settings[f'{stem}.wheel_diameter'] = left_m if left_m == right_m else {'left': left_m, 'right': right_m}
        settings[f'{stem}.wheel_separation'] = _rounded(robot.wheel_separation_m)
        settings.update({f'{stem}.left_joint': robot.left.joint, f'{stem}.right_joint': robot.right.joint})
    for side, wheel in (('left', robot.left), ('right', robot.right)):
        settings[f'config.{side}_reversed'] = not wheel.is_forward_positive
    costmaps = [f'navigation.{name}_costmap' for name in ('global', 'local')]
    frames = ('config.base_frame', 'amcl.base_frame_id', *(f'{costmap}.robot_base_frame' for costmap in costmaps))
    settings.update(dict.fromkeys(frames, robot.tree.root))
    if robot.laser is not None:
        settings['simulator.laser_link'] = robot.laser.link
        settings.update({f'simulator.lidar.{key}': value for key, value in robot.laser.settings.items()})
        if 'range_max' in robot.laser.settings:
            settings['amcl.laser_max_range'] = min(_LASER_MAX_RANGE_M, robot.laser.settings['range_max'])
    limits = robot.drive_limits
    settings.update({f'simulator.drive.{key}': _rounded(value) for key, value in limits.items()})
    for key, (limit, usual) in _USUAL_LIMITS.items():  # the navigator commands not more than the drive's limits
        if limit in limits:
            settings[f'navigation.DWAPlannerROS.{key}'] = _rounded(min(usual, limits[limit]))
    corners = [[_rounded(x_m), _rounded(y_m)] for x_m, y_m in robot.footprint]
    settings.update({f'{costmap}.footprint': corners for costmap in costmaps})
    return settings


def _rounded(value: float) -> float:
    """Return a number as a person would write it: 0.066 for 0.06600000000000002."""
    return float(f'{round(value, 9):.{_DIGITS}g}') + 0.0


def _proposed_laser(description: RobotDescription) -> AddedLaser:
    """Return a scanner above the robot, on its root link."""
    top_m = max(0.0, reach_m(description.hull, np.array([0.0, 0.0, 1.0])))
    return AddedLaser(description.tree.root, (0.0, 0.0, round(top_m + LASER_ABOVE_M, 3)))


def proposed_laser_line(description: RobotDescription) -> str:
    """Return the robot file that adds a scanner above the robot, for messages."""
    return robot_file_line(description.tree.where, laser=_proposed_laser(description).place())


class RobotSetup(NamedTuple):
    """A robot, ready to be simulated and navigated."""

    file: RobotFile
    description: RobotDescription
    settings: Dict[str, Any]  # values of parameters by dotted keys: the URDF's, overridden by the robot file's

    @property
    def name(self) -> str:
        """Return the robot's name in its URDF, which is that of its model in the simulation."""
        return self.description.tree.name

    def check_laser(self) -> None:
        """Check that there is a laser: closed-loop trials need one; ConfigError if none was found."""
        if self.description.laser is None:
            raise ConfigError(
                f'{self.file.where}: the robot has no laser, which closed-loop trials need; allowed: '
                f'{proposed_laser_line(self.description)}, or simulator.laser_link, the name of a link'
            )

    def with_laser(self) -> RobotSetup:
        """Return the robot with a laser, if it has none: one that a warning proposes."""
        if self.description.laser is not None:
            return self
        warning = f'no laser is found: one above the robot is simulated, as by {proposed_laser_line(self.description)}'
        source = self.file.source._replace(added_laser=_proposed_laser(self.description))
        setup = set_up_robot(self.file._replace(urdf=source))
        warnings = (*setup.description.warnings, warning)
        return setup._replace(description=dataclasses.replace(setup.description, warnings=warnings))


def set_up_robot(file: RobotFile) -> RobotSetup:
    """Describe a robot; values in its file override those of the URDF. ConfigError if it is no differential drive."""
    choices: Dict[str, Any] = {}
    for choice in RobotChoices.model_fields:
        key = f'simulator.{choice}'
        value = file.overrides.get(key, file.overrides.get(f'config.{choice}') if 'joint' in choice else None)
        if value:
            choices[choice] = value
    description = describe(file.source, RobotChoices.from_mapping(choices, f'{file.where}: simulator'))
    return RobotSetup(file, description, {**derived_settings(description), **file.overrides})


def robot_file_text(setup: RobotSetup, path: Path) -> str:
    """Return the robot file of a robot, to be written to `path`, from where its own paths start."""
    lines = [_HEAD.format(setup.name), *_own_lines(setup.file, path)]
    if setup.description.laser is None:
        place = _proposed_laser(setup.description).place()
        lines.append('# ' + _line('laser', place, '# [m] no laser was found: this adds one above the robot'))
    lines.append('set:')
    sources = {row.quantity.partition(' [')[0]: row.source for row in reversed(setup.description.found)}
    units = {name: unit for unit, names in _UNITS.items() for name in names.split()}
    for key, value in setup.settings.items():
        last = key.rpartition('.')[2]
        row = 'laser' if key.startswith('simulator.lidar.') else _ROWS.get(last, last.replace('_', ' '))
        origin = setup.file.where if key in setup.file.overrides else sources.get(row.partition(' [')[0], '')
        comment = ' '.join(filter(None, [units.get(last, ''), origin]))
        lines.append('  ' + _line(key, value, comment and f'# {comment}'))
    return '\n'.join(lines) + '\n'


def _own_lines(file: RobotFile, path: Path) -> List[str]:
    """Return the lines of a robot's description, to be written to `path`, and of its encoder."""
    lines = []
    if file.urdf is not None:
        files = (file.urdf.file, *file.urdf.package_folders)
        urdf, *packages = (os.path.relpath(str(each.resolve()), str(path.parent.resolve())) for each in files)
        lines.append(_line('urdf', urdf, '# xacro or URDF, relative to this file'))
        if file.urdf.arguments:
            lines.append(_line('arguments', dict(file.urdf.arguments), "# of the xacro's xacro:arg"))
        if packages:
            lines.append(_line('packages', packages, '# folders of packages'))
    mark, ppr = ('# ', 90) if file.ppr is None else ('', file.ppr)
    lines.append(mark + _line('ppr', ppr, "# counts per wheel revolution of the robot's own encoder"))
    if file.urdf is not None and file.urdf.added_laser is not None:
        lines.append(_line('laser', file.urdf.added_laser.place(), '# [m] a scanner in place of those of the URDF'))
    return lines


def calibrated_robot_text(
    base: RobotFile, calibration: Mapping[str, Any], settings: Mapping[str, Any], path: Path, is_simulated: bool = False
) -> str:
    """Return the robot file of a calibrated robot, to be written to `path`, from where its own paths start.

    The keys of `calibration` are those of CalibrationParams, or none; `settings` by dotted keys replace those of
    `base`. The calibrated wheels are also those that are simulated, unless the robot of the drives `is_simulated` or
    `base` has errors of its geometry: then the odometry of a simulated robot is calibrated, which stays as it is.
    """
    calibrated = CalibrationParams.from_mapping(calibration, 'calibration') if calibration else None
    found, by_motion = (calibrated.settings(), calibrated.slip_by_motion) if calibrated else ({}, {})
    values = {**base.overrides, **found, **settings}
    errors = [key for key, value in base.overrides.items() if key.startswith('simulator.wheel_errors.') and value]
    is_simulated = is_simulated or bool({*errors} - {SLIP, *by_motion})
    values.update({} if is_simulated else by_motion)
    if base.urdf is not None and not is_simulated:
        wheels = ('wheel_diameter', 'wheel_separation')
        values.update({f'simulator.{key}': values[f'config.{key}'] for key in wheels if f'config.{key}' in values})
        values.update({SLIP: values['config.motion_noise']} if found else {})
    lines = [CALIBRATED_HEAD, *_own_lines(base, path)]
    for key, content in (('set', values), ('calibration', calibration)):
        lines += [f'{key}:', *('  ' + _line(each, value, '') for each, value in content.items())] if content else []
    return '\n'.join(lines) + '\n'


def _line(key: str, value: Any, comment: str) -> str:
    # A single value ends with the mark of a document's end.
    text = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=10_000, allow_unicode=True)
    text = text.strip().replace('\n...', '')
    return f'{f"{key}: {text}".ljust(COMMENTS_FROM)} {comment}'.rstrip()
