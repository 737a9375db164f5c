"""Robot, encoders and wheels of a recorded drive, selected by options."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.api.options import DriveOptions, SourceOptions, WheelOptions
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.params import merged, nested, shared_params, with_changes
from diff_encoder_sim.base.per_wheel import PerWheel
from diff_encoder_sim.base.yaml_files import load_yaml, yaml_value
from diff_encoder_sim.drives import joint_wheels
from diff_encoder_sim.drives.csv_table import CsvStream, CsvWheels
from diff_encoder_sim.drives.drive_stream import DriveStream
from diff_encoder_sim.drives.field_wheels import FieldWheels, find_field, serving_options
from diff_encoder_sim.drives.number_units import ANGLE_UNITS, COUNTED, LENGTH_UNITS, TICKS, TIME_UNITS, UNITS
from diff_encoder_sim.drives.odometry_wheels import OdometryWheels
from diff_encoder_sim.drives.recorded_poses import RecordedPoses, find_poses, find_reference
from diff_encoder_sim.drives.reference import TablePoses
from diff_encoder_sim.drives.topics import JOINT_STATE_TYPE, TRIAL
from diff_encoder_sim.drives.trial_definition import OF_ENCODER, OF_ODOMETRY, Trial
from diff_encoder_sim.drives.wheel_source import WheelNumbers, WheelSource
from diff_encoder_sim.robots.robot_file import NO_ROBOT, RobotFile
from diff_encoder_sim.robots.xacro_expansion import xacro_arguments
from diff_encoder_sim.trials.robot_params import load_numbers, uncertainty_of_robot
from diff_encoder_sim.wheels.catalogue import RESOLUTION_KEYS, ChosenEncoder, load_encoders, own_encoder
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER
from diff_encoder_sim.wheels.odometry_params import UNCERTAINTY_KEYS, OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

USUAL, OF_TRIAL = 'config/config.yaml', f"the bag's {TRIAL}"
PAPER_PPR = (40, 90, 1024, 4096)

_BELONGS_TO = {  # options that belong to some sources of wheels
    **dict.fromkeys(('left', 'right'), ('joint_states', 'pulses')),
    'pulses_ppr': ('pulses', 'joint_states'),  # joint states may contain counts
    **dict.fromkeys(('unit', 'ticks_per_revolution', 'ticks_modulus', 'reversed'), ('ticks', 'csv')),
    'columns': ('csv',),
    'time_unit': ('csv', 'reference_csv'),
}
_UNITS = {'unit': UNITS, 'time_unit': TIME_UNITS, 'length_unit': LENGTH_UNITS, 'angle_unit': ANGLE_UNITS}


def check_wheel_options(options: WheelOptions, bag: Any, csv: Any) -> None:
    """Refuse contradictory options, given these bags or tables; ConfigError for an option of another source."""
    given = [name for name in ('joint_states', 'pulses', 'ticks', 'odom') if getattr(options, name)]
    given += ['csv'] if csv else []
    if len(given) > 1:
        count = 'both' if len(given) == 2 else 'all'
        raise ConfigError(f'{", ".join(map(_option, given))}: given {count}; allowed: one of them')
    if bool(bag) == bool(csv):
        raise ConfigError(f'BAG, --csv: given {"both" if csv else "neither"}; allowed: one of them')
    for name, units in _UNITS.items():
        if getattr(options, name, '') not in ('', *units):
            raise ConfigError(f'{_option(name)}: given {getattr(options, name)}; allowed: {", ".join(units)}')
    if csv and not options.columns:
        raise ConfigError('--csv: given without --columns; expected --columns TIME LEFT RIGHT, as names or numbers')
    read = {*(given or ['joint_states'])}
    if isinstance(options, SourceOptions):
        _check_reference_options(options, bag, csv)
        read.update(['reference_csv'] if options.reference_csv else [])
    for name, sources in _BELONGS_TO.items():
        if getattr(options, name) not in (None, '', ()) and not read.intersection(sources):
            used = _option(given[0]) if given else 'wheel angles of joints'
            raise ConfigError(f'{_option(name)}: given with {used}; allowed: with {" or ".join(map(_option, sources))}')


def _check_reference_options(options: SourceOptions, bag: Any, csv: Any) -> None:
    columns, tables = options.reference_columns, options.reference_csv
    if options.reference and (csv or columns):
        given = '--reference-columns' if columns else '--csv'
        raise ConfigError(f'--reference: given with {given}; allowed: with a bag; a table has --reference-columns')
    if columns and bag and not tables:
        raise ConfigError('--reference-columns: given with a bag; allowed: with --csv or --reference-csv')
    for name in ('reference_csv', 'reference_covariance', 'length_unit', 'angle_unit'):
        if getattr(options, name) and not columns:
            raise ConfigError(f'{_option(name)}: given without --reference-columns; expected TIME X Y [YAW] there')
    if len(columns) not in (0, 3, 4):
        raise ConfigError(f'--reference-columns: given {len(columns)} columns; allowed: TIME X Y, or TIME X Y YAW')
    covariance = 'XX XY XYAW YY YYAW YAWYAW' if len(columns) == 4 else 'XX XY YY'
    if len(options.reference_covariance) not in (0, len(covariance.split())):
        given = f'given {len(options.reference_covariance)} columns'
        raise ConfigError(f'--reference-covariance: {given}; allowed: {covariance}')
    drives = len(csv or bag) if isinstance(csv or bag, (list, tuple)) else 1
    if len(tables) not in (0, drives):
        raise ConfigError(f'--reference-csv: given {len(tables)} tables for {drives} drives; allowed: one for each')


def _option(name: str) -> str:
    return f'--{name.replace("_", "-")}'


def chosen_encoders(options: DriveOptions, own: EncoderParams) -> List[ChosenEncoder]:
    """Return the given encoders, else the robot's, else the paper's; ConfigError if invalid, repeated, in conflict."""
    pprs = options.ppr if isinstance(options.ppr, (list, tuple)) else [options.ppr]
    ideal = [ChosenEncoder(ppr_of_text('--ppr', ppr)) for ppr in pprs]
    real = load_encoders(options.encoder or (), package_folder() / 'config', Path())
    for option, encoders in (('--ppr', ideal), ('--encoder', real)):
        labels = [encoder.label for encoder in encoders]
        twice = next((label for label in labels if labels.count(label) > 1), None)
        if twice is not None:
            raise ConfigError(f'{option}: given {twice} twice; allowed: each once')
    resolution = own_encoder(own).resolution
    if ideal and resolution:
        given = ' '.join(encoder.label for encoder in ideal)
        raise ConfigError(f'--ppr: given {given} with encoder: {resolution}; allowed: one of them')
    if ideal or real:
        return [*ideal, *real]
    return [own_encoder(own)] if resolution else [ChosenEncoder(ppr_of_text('', ppr)) for ppr in PAPER_PPR]


def ppr_of_text(option: str, text: Any) -> PerWheel:
    """Parse a PPR: a number, or a YAML mapping with a number per wheel; otherwise ConfigError."""
    return EncoderParams.from_mapping({'ppr': yaml_value(str(text), option)}, option).ppr


def parameters_with(
    encoder: ChosenEncoder, of_robot: EncoderParams, odometry: OdometryParams
) -> Tuple[EncoderParams, OdometryParams]:
    """Return the parameters of a robot with another encoder; ConfigError if the parameters contradict each other."""
    changes: Dict[str, Any] = {'ppr': encoder.ppr}
    if encoder.real and encoder.params:
        of_encoder = encoder.params.encoder.model_dump()
        changes.update({**encoder.params.model_dump(exclude_unset=True), 'encoder': of_encoder})
    shared = {key: value for key, value in changes.items() if key in OdometryParams.model_fields}
    source = f'encoder {encoder.label}'
    return with_changes(of_robot, changes, source), with_changes(odometry, shared, source)


class RecordedRobot(NamedTuple):
    """Parameters of a recorded drive."""

    encoder: EncoderParams
    odometry: OdometryParams
    counts_modulus: int  # of recorded counts, not of computed encoders
    sources: Dict[str, str]  # by parameter name; ppr only if a file sets it
    file: RobotFile = NO_ROBOT  # of --robot, with its calibration

    @property
    def joints(self) -> Tuple[str, str]:
        """Return the names of the left and the right joint."""
        return self.encoder.left_joint, self.encoder.right_joint

    def is_guessed(self) -> bool:
        """Return whether neither the user nor the bag specifies the wheels."""
        return all(self.sources[name] == USUAL for name in OF_ODOMETRY)

    def counter_text(self) -> str:
        """Return the modulus of recorded counts, with its source."""
        wraps = f'wrap at {self.counts_modulus}' if self.counts_modulus else 'do not wrap'
        return f'counts {wraps}: {self.sources["counter_modulus"]}'

    def text(self) -> str:
        """Return the wheel parameters with their sources, in one line."""
        odometry = self.odometry
        values = {
            'wheel_diameter': f'diameter {odometry.wheel_diameter} m',
            'wheel_separation': f'separation {odometry.wheel_separation:g} m',
            'axle_x': f'axle at x = {odometry.axle_x:g} m',
            'left_joint': f'left joint {self.joints[0]}',
            'right_joint': f'right joint {self.joints[1]}',
        }
        by_source: Dict[str, List[str]] = {}
        for name, value in values.items():
            by_source.setdefault(self.sources[name], []).append(value)
        return 'wheels: ' + '; '.join(f'{", ".join(parts)} ({source})' for source, parts in by_source.items())


def recorded_robot(
    options: WheelOptions, trial: Optional[Trial], seed: Optional[int] = None, has_encoders: bool = False
) -> RecordedRobot:
    """Collect parameters: config.yaml, the bag's trial, --robot, --config, --seed, in this order.

    The resolution of the robot's encoder gives way if the user `has_encoders`. ConfigError if a parameter is bad.
    """
    usual = load_yaml(package_folder() / 'config' / 'config.yaml')
    values, sources = dict(usual), dict.fromkeys([*OF_ODOMETRY, *OF_ENCODER, 'counter_modulus'], USUAL)

    def add(layer: Dict[str, Any], source: str) -> None:
        values.update(merged(values, layer))
        sources.update(dict.fromkeys(layer, source))

    if trial is not None:
        of_trial = {name: getattr(trial, name) for name in (*OF_ODOMETRY, *UNCERTAINTY_KEYS, *OF_ENCODER)}
        add({**of_trial, 'seed': trial.number}, OF_TRIAL)
    file = NO_ROBOT
    if options.robot:
        arguments = xacro_arguments(options.robot_args)
        file, settings = load_numbers(options.robot, Path(), package_folder(), arguments, options.packages)
        gives_way = RESOLUTION_KEYS if has_encoders else ()
        own = {key[7:]: value for key, value in settings.items() if key[:7] == 'config.' and key not in gives_way}
        add(nested({**uncertainty_of_robot(settings), **own}), file.where)
        if file.ppr is not None:
            add({'ppr': file.ppr}, file.where)
    if options.config:
        given = load_yaml(options.config).items()
        add({key: value for key, value in given if not options.robot or usual.get(key) != value}, str(options.config))
    if seed is not None:
        add({'seed': seed}, '--seed')
    name = str(options.config or options.robot or USUAL)
    encoder = shared_params(values, name, EncoderParams, OdometryParams)
    odometry = shared_params(values, name, OdometryParams, EncoderParams)
    # The bag overrides --robot, whose encoder may differ from the recorded one.
    modulus, source = encoder.counter_modulus, sources['counter_modulus']
    if trial is not None and source != str(options.config) and (source == USUAL or trial.counter_modulus):
        modulus, sources['counter_modulus'] = trial.counter_modulus, OF_TRIAL
    return RecordedRobot(encoder, odometry, modulus, sources, file)


def wheel_numbers(
    options: WheelOptions, robot: RecordedRobot, bits: Sequence[Optional[int]] = (None, None)
) -> WheelNumbers:
    """Return how to read wheel numbers, by counters of `bits` (None: no wrap); ConfigError if options do not fit."""
    unit, given_ppr, given_modulus = options.unit or TICKS, options.ticks_per_revolution, options.ticks_modulus
    if given_ppr and unit not in COUNTED:
        raise ConfigError(f'--ticks-per-revolution: given with --unit {unit}; allowed: with {" and ".join(COUNTED)}')
    if unit in COUNTED and not given_ppr and 'ppr' not in robot.sources:
        raise ConfigError('--ticks-per-revolution: missing; expected the ticks per wheel revolution, or --robot')
    if given_modulus is not None and unit != TICKS:
        raise ConfigError(f'--ticks-modulus: given with --unit {unit}; allowed: with {TICKS}')
    ppr, moduli = None, (0, 0)
    if unit in COUNTED:
        ppr = ppr_of_text('--ticks-per-revolution', given_ppr) if given_ppr else robot.encoder.ppr
    if unit == TICKS:
        left, right = ((2**width if width else 0) if given_modulus is None else given_modulus for width in bits)
        moduli = left, right
    may_wrap = unit == TICKS and given_modulus is None
    return WheelNumbers(unit, robot.odometry.wheel_diameter.radii_m, ppr, moduli, options.reversed, may_wrap)


def drive_wheels(
    options: WheelOptions, source: DriveStream, trial: Optional[Trial], robot: RecordedRobot
) -> WheelSource:
    """Return the wheels of a bag or a table; ConfigError if there are none; the message lists the alternatives."""
    if isinstance(source, CsvStream):
        return CsvWheels(source.topic, robot.joints, wheel_numbers(options, robot))
    if options.odom:
        poses = find_poses(source, '--odom', options.odom)
        return OdometryWheels(poses, robot.joints, robot.odometry)
    if not options.ticks:
        return _joint_wheels(options, source, trial, robot)
    left, right = (find_field(source, '--ticks', given) for given in options.ticks)
    if left.name == right.name:
        raise ConfigError(f'{source.path}: --ticks: given {left.name} for both wheels; allowed: two different fields')
    return FieldWheels((left, right), robot.joints, wheel_numbers(options, robot, (left.bits, right.bits)))


def _joint_wheels(
    options: WheelOptions, source: DriveStream, trial: Optional[Trial], robot: RecordedRobot
) -> WheelSource:
    is_given = bool(options.joint_states or options.pulses)
    if not (is_given or any(joint_wheels.joint_topics(source, kind) for kind in joint_wheels.JOINT_TYPES)):
        listed = ' | '.join(serving_options(source)) or f'nothing in its topics {", ".join(sorted(source.topics))}'
        raise ConfigError(f'{source.path}: no topic of {" or ".join(joint_wheels.JOINT_TYPES)}; alternatives: {listed}')
    ppr = ppr_of_text('--pulses-ppr', options.pulses_ppr) if options.pulses_ppr else None
    pulses_ppr = ppr if ppr or trial is None else trial.ppr
    given = options.joint_states, options.pulses, options.left, options.right
    try:
        topic, kind, joints = joint_wheels.find_wheels(source, robot.encoder, *given)
        if kind != JOINT_STATE_TYPE and pulses_ppr is None:
            missing = 'expected --pulses-ppr, the pulses per revolution of their encoder'
            raise ConfigError(f'{source.path}: {topic} has counts; {missing}')
    except ConfigError as error:
        alternatives = '' if is_given else ' | '.join(serving_options(source))
        raise ConfigError(f'{error}; alternatives: {alternatives}' if alternatives else str(error)) from None
    if kind == JOINT_STATE_TYPE:
        if ppr is not None:
            expected = 'expected --pulses TOPIC with it, or neither'
            raise ConfigError(f'--pulses-ppr: given, but {topic} has wheel angles; {expected}')
        return joint_wheels.JointWheels(topic, joints, source.is_cdr)
    counting = {'ppr': pulses_ppr, 'counter_modulus': robot.counts_modulus, 'encoder': IDEAL_ENCODER}
    odometry, notes = robot.odometry.model_copy(update=counting), []
    if trial and ppr is None and (trial.encoder or trial.variant):
        variant = f', variant {trial.variant}' if trial.variant else ''
        notes.append(f'the angles are counts of {trial.encoder_label}{variant}, with its errors')
    if trial and ppr is None and trial.counter_modulus not in (0, robot.counts_modulus):
        notes.append(f'{robot.counter_text()}; the recorded trial has {trial.counter_modulus}')
    return joint_wheels.PulseWheels(topic, joints, source.is_cdr, odometry, robot.counter_text(), notes)


def drive_reference(
    options: SourceOptions, source: DriveStream, table: Optional[Path] = None
) -> Optional[RecordedPoses]:
    """Return the reference: columns of a `table` or of the drive's own, or poses of its bag; ConfigError without."""
    if not options.reference_columns:
        return None if isinstance(source, CsvStream) else find_reference(source, options.reference)
    columns = [*options.reference_columns, *options.reference_covariance]
    unit, option = options.time_unit or 's', '--reference-columns'
    stream = CsvStream(table or source.path, columns, unit, option, is_ordered=False)
    units = LENGTH_UNITS[options.length_unit or 'm'], ANGLE_UNITS[options.angle_unit or 'rad']
    poses = TablePoses(stream, len(options.reference_columns) == 4, *units)
    if not poses.stamps_ns:
        raise ConfigError(f'{stream.path}: {option}: no row has all numbers: {poses.fault or "it is empty"}')
    return poses
