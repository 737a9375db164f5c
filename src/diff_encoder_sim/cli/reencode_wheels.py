"""The source of a drive's wheel angles, as reencode's options choose it."""

from __future__ import annotations

import argparse
from typing import List, Optional, Tuple

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.reencode_encoders import ppr_of_text
from diff_encoder_sim.cli.reencode_robot import RecordedRobot
from diff_encoder_sim.cli.reencode_units import wheel_numbers
from diff_encoder_sim.drives.bag_source import BagSource
from diff_encoder_sim.drives.csv_stream import CsvStream
from diff_encoder_sim.drives.csv_wheels import CsvWheels
from diff_encoder_sim.drives.field_wheels import FieldWheels, Wheel
from diff_encoder_sim.drives.joint_wheels import JointWheels
from diff_encoder_sim.drives.message_fields import find_field
from diff_encoder_sim.drives.odometry_wheels import OdometryWheels
from diff_encoder_sim.drives.reference import find_poses
from diff_encoder_sim.drives.serving_topics import serving_options
from diff_encoder_sim.drives.start_angles import DEFAULT_SEED
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.drives.wheel_source import WheelSource
from diff_encoder_sim.drives.wheels import JOINT_TYPES, WheelOptions, find_wheels, has_joints
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER


def bag_wheels(
    options: argparse.Namespace, source: BagSource, trial: Optional[Trial], robot: RecordedRobot
) -> WheelSource:
    """Return the wheels of a bag.

    Raises:
        ConfigError: there are none; it lists what the bag has.
    """
    if options.odom:
        poses = find_poses(options.bag, source, '--odom', options.odom)
        seed = DEFAULT_SEED if options.seed is None else options.seed
        return OdometryWheels(poses, _joints(robot), robot.odometry, seed)
    if options.ticks:
        return _field_wheels(options, source, robot)
    return _joint_wheels(options, source, trial, robot)


def csv_wheels(options: argparse.Namespace, stream: CsvStream, robot: RecordedRobot) -> CsvWheels:
    """Return the wheels of a CSV file.

    Raises:
        ConfigError: the unit needs a number of ticks per revolution.
    """
    numbers = wheel_numbers(options, robot, (None, None))
    return CsvWheels(
        stream.topic, _joints(robot), (numbers.left, numbers.right), numbers.ppr, numbers.about, numbers.notes
    )


def _field_wheels(options: argparse.Namespace, source: BagSource, robot: RecordedRobot) -> FieldWheels:
    left, right = (find_field(options.bag, source, '--ticks', given) for given in options.ticks)
    if left.name == right.name:
        raise ConfigError(f'{options.bag}: --ticks: given {left.name} for both wheels; allowed: two that differ')
    numbers = wheel_numbers(options, robot, (left.bits, right.bits))
    joints = _joints(robot)
    wheels = Wheel(joints[0], left, numbers.left), Wheel(joints[1], right, numbers.right)
    return FieldWheels(*wheels, numbers.ppr, numbers.about, numbers.notes)


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
    if wheels.ppr is None:
        return JointWheels(wheels, source.is_cdr, robot.odometry)
    counting = {'ppr': wheels.ppr, 'counter_modulus': robot.counts_modulus, 'encoder': IDEAL_ENCODER}
    odometry, notes = robot.odometry.model_copy(update=counting), [] if given_ppr else _notes_on_counts(trial, robot)
    return JointWheels(wheels, source.is_cdr, odometry, robot.counter_text(), notes)


def _notes_on_counts(trial: Optional[Trial], robot: RecordedRobot) -> List[str]:
    """List what /trial says of the encoder that counted: its errors, and a counter other than the one assumed."""
    notes = []
    if trial and (trial.encoder or trial.variant):
        variant = f', variant {trial.variant}' if trial.variant else ''
        notes.append(f'the angles are counts of {trial.encoder_label}{variant}, with its errors')
    if trial and trial.counter_modulus and robot.counts_modulus != trial.counter_modulus:
        notes.append(f'{robot.counter_text()}; they did at {trial.counter_modulus} in the recorded trial')
    return notes


def _serving(options: argparse.Namespace, source: BagSource) -> str:
    return ' | '.join(serving_options(options.bag, source))


def _joints(robot: RecordedRobot) -> Tuple[str, str]:
    return robot.encoder.left_joint, robot.encoder.right_joint
