"""The source of a drive's wheel angles, as reencode's options choose it."""

from __future__ import annotations

import argparse
from typing import Optional, Tuple

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.reencode_arguments import ppr_of_text
from diff_encoder_sim.cli.reencode_robot import RecordedRobot
from diff_encoder_sim.encoders.pulses import PerWheel, ppr_label
from diff_encoder_sim.recording.bag_source import BagSource
from diff_encoder_sim.reencoding.csv_stream import CsvStream
from diff_encoder_sim.reencoding.csv_wheels import CsvWheels
from diff_encoder_sim.reencoding.field_wheels import FieldWheels, Wheel
from diff_encoder_sim.reencoding.joint_wheels import JointWheels
from diff_encoder_sim.reencoding.message_fields import MessageField, find_field
from diff_encoder_sim.reencoding.odometry_wheels import OdometryWheels
from diff_encoder_sim.reencoding.reference import find_poses
from diff_encoder_sim.reencoding.serving_topics import serving_options
from diff_encoder_sim.reencoding.wheel_source import WheelSource
from diff_encoder_sim.reencoding.wheel_units import COUNTED, TICKS, WheelUnit
from diff_encoder_sim.reencoding.wheels import JOINT_TYPES, WheelOptions, find_wheels, has_joints
from diff_encoder_sim.trials.trial_definition import Trial

# Options by the sources that they belong to.
_SOURCES = ('joint_states', 'pulses', 'ticks', 'odom', 'csv')
_BELONGS_TO = {
    'left': ('joint_states', 'pulses'),
    'right': ('joint_states', 'pulses'),
    'pulses_ppr': ('pulses', 'joint_states'),  # which may be found to be counts
    'unit': ('ticks', 'csv'),
    'ticks_per_revolution': ('ticks', 'csv'),
    'ticks_modulus': ('ticks', 'csv'),
    'reversed': ('ticks', 'csv'),
    'columns': ('csv',),
    'time_unit': ('csv',),
}


def check_wheel_options(options: argparse.Namespace) -> None:
    """Refuse options that contradict each other.

    Raises:
        ConfigError: there is more than one source, or an option of another one.
    """
    given = [name for name in _SOURCES if getattr(options, name)]
    if len(given) > 1:
        all_of_them = 'both' if len(given) == 2 else 'all'
        raise ConfigError(f'{", ".join(map(_option, given))}: given {all_of_them}; allowed: one of them')
    if bool(options.bag) == bool(options.csv):
        raise ConfigError(f'BAG, --csv: given {"both" if options.csv else "neither"}; allowed: one of them')
    if options.csv and not options.columns:
        raise ConfigError('--csv: given without --columns; expected --columns TIME LEFT RIGHT, as names or numbers')
    for name, sources in _BELONGS_TO.items():
        if getattr(options, name) not in (None, '', ()) and (given or ['joint_states'])[0] not in sources:
            used = _option(given[0]) if given else 'wheel angles of joints'
            allowed = ' or '.join(map(_option, sources))
            raise ConfigError(f'{_option(name)}: given with {used}; allowed: with {allowed}')


def bag_wheels(
    options: argparse.Namespace, source: BagSource, trial: Optional[Trial], robot: RecordedRobot
) -> WheelSource:
    """Return the wheels of a bag.

    Raises:
        ConfigError: there are none; it lists what the bag has.
    """
    if options.odom:
        poses = find_poses(options.bag, source, '--odom', options.odom)
        return OdometryWheels(poses, _joints(robot), robot.odometry)
    if options.ticks:
        return _field_wheels(options, source, robot)
    return _joint_wheels(options, source, trial, robot)


def csv_wheels(options: argparse.Namespace, stream: CsvStream, robot: RecordedRobot) -> CsvWheels:
    """Return the wheels of a CSV file.

    Raises:
        ConfigError: the unit needs a number of ticks per revolution.
    """
    ppr = _ticks_ppr(options, robot)
    moduli = _moduli(options, None, None)
    return CsvWheels(
        stream.topic, _joints(robot), _units(options, robot, ppr, moduli), ppr, _about(options, ppr, moduli)
    )


def _field_wheels(options: argparse.Namespace, source: BagSource, robot: RecordedRobot) -> FieldWheels:
    left, right = (find_field(options.bag, source, '--ticks', given) for given in options.ticks)
    if left.name == right.name:
        raise ConfigError(f'{options.bag}: --ticks: given {left.name} for both wheels; allowed: two that differ')
    ppr = _ticks_ppr(options, robot)
    moduli = _moduli(options, left, right)
    units, joints = _units(options, robot, ppr, moduli), _joints(robot)
    wheels = [Wheel(*parts) for parts in zip(joints, (left, right), units)]
    return FieldWheels(wheels[0], wheels[1], ppr, _about(options, ppr, moduli))


def _joint_wheels(
    options: argparse.Namespace, source: BagSource, trial: Optional[Trial], robot: RecordedRobot
) -> JointWheels:
    if not (options.joint_states or options.pulses or has_joints(source)):
        listed = _serving(options, source) or f'nothing in its topics {", ".join(sorted(source.topics))}'
        raise ConfigError(f'{options.bag}: no topic of {" or ".join(JOINT_TYPES)}; what could serve: {listed}')
    given_ppr = ppr_of_text('--pulses-ppr', options.pulses_ppr) if options.pulses_ppr else None
    trial_ppr = trial.ppr if trial else None
    chosen = WheelOptions(options.joint_states, options.pulses, given_ppr or trial_ppr, options.left, options.right)
    try:
        wheels = find_wheels(options.bag, source, chosen, robot.encoder)
    except ConfigError as error:
        other = '' if options.joint_states or options.pulses else _serving(options, source)
        raise ConfigError(f'{error}; what else could serve: {other}' if other else str(error)) from None
    if given_ppr is not None and wheels.ppr is None:
        raise ConfigError(
            f'--pulses-ppr: given, but {wheels.topic} has wheel angles; expected --pulses TOPIC with it, or neither'
        )
    return JointWheels(wheels, source.is_cdr, robot.encoder.counter_modulus)


def _serving(options: argparse.Namespace, source: BagSource) -> str:
    return ' | '.join(serving_options(options.bag, source))


def _joints(robot: RecordedRobot) -> Tuple[str, str]:
    return robot.encoder.left_joint, robot.encoder.right_joint


def _ticks_ppr(options: argparse.Namespace, robot: RecordedRobot) -> Optional[PerWheel]:
    """Return the ticks per revolution of counts: as given, else the robot's; None for other units."""
    given = options.ticks_per_revolution
    if (options.unit or TICKS) not in COUNTED:
        if given:
            raise ConfigError(
                f'--ticks-per-revolution: given with --unit {options.unit}; allowed: with {" and ".join(COUNTED)}'
            )
        return None
    if given:
        return ppr_of_text('--ticks-per-revolution', given)
    if 'ppr' not in robot.sources:
        raise ConfigError('--ticks-per-revolution: missing; expected the ticks of a whole turn of a wheel, or --robot')
    return robot.encoder.ppr


def _moduli(
    options: argparse.Namespace, left: Optional[MessageField], right: Optional[MessageField]
) -> Tuple[int, int]:
    """Return after how many counts each counter wraps: as given, else by the width of its field; 0 for never."""
    if options.unit not in ('', TICKS):
        if options.ticks_modulus is not None:
            raise ConfigError(f'--ticks-modulus: given with --unit {options.unit}; allowed: with {TICKS}')
        return (0, 0)
    if options.ticks_modulus is not None:
        return (options.ticks_modulus, options.ticks_modulus)
    bits = [field.bits if field else None for field in (left, right)]
    return (2 ** bits[0] if bits[0] else 0, 2 ** bits[1] if bits[1] else 0)


def _units(
    options: argparse.Namespace, robot: RecordedRobot, ppr: Optional[PerWheel], moduli: Tuple[int, int]
) -> Tuple[WheelUnit, WheelUnit]:
    radius_m, unit = 0.5 * robot.odometry.wheel_diameter, options.unit or TICKS
    left_ppr, right_ppr = (ppr.left, ppr.right) if ppr else (None, None)
    return (
        WheelUnit(unit, radius_m, left_ppr, moduli[0], 'left' in options.reversed),
        WheelUnit(unit, radius_m, right_ppr, moduli[1], 'right' in options.reversed),
    )


def _about(options: argparse.Namespace, ppr: Optional[PerWheel], moduli: Tuple[int, int]) -> str:
    parts = [options.unit or TICKS]
    if ppr is not None:
        parts.append(f'{ppr_label(ppr)} a revolution')
    if any(moduli):
        parts.append(f'the counter wraps at {" and ".join(str(modulus) for modulus in sorted(set(moduli)))}')
    parts.extend(f'{side} reversed' for side in options.reversed)
    return ', '.join(parts)


def _option(name: str) -> str:
    return f'--{name.replace("_", "-")}'
