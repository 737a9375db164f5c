"""Robot, encoders and wheels of a recorded drive, selected by options."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.params import merged, nested, shared_params, with_changes
from diff_encoder_sim.base.yaml_files import load_yaml, yaml_value
from diff_encoder_sim.drives.bag_source import BagSource
from diff_encoder_sim.drives.csv_wheels import CsvStream, CsvWheels
from diff_encoder_sim.drives.field_wheels import FieldWheels, Wheel, find_field, serving_options
from diff_encoder_sim.drives.joint_wheels import (
    JOINT_TYPES,
    JointWheels,
    PulseWheels,
    WheelOptions,
    find_wheels,
    joint_topics,
)
from diff_encoder_sim.drives.number_units import COUNTED, SPEEDS, TICKS, TIME_UNITS, UNITS
from diff_encoder_sim.drives.odometry_wheels import OdometryWheels
from diff_encoder_sim.drives.reference import find_poses
from diff_encoder_sim.drives.topics import TRIAL
from diff_encoder_sim.drives.trial_definition import OF_ENCODER, OF_ODOMETRY, Trial
from diff_encoder_sim.drives.wheel_source import (
    DEFAULT_SEED,
    SPEEDS_NOTE,
    WheelSource,
    WheelUnit,
    start_angles_note,
    start_angles_rad,
)
from diff_encoder_sim.robots.xacro_expansion import xacro_arguments
from diff_encoder_sim.trials.robot_params import load_robot, uncertainty_of_robot
from diff_encoder_sim.wheels.catalogue import RESOLUTION_KEYS, ChosenEncoder, chosen, load_encoders, own_encoder
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER, PerWheel, ppr_label
from diff_encoder_sim.wheels.odometry_params import UNCERTAINTY_KEYS, OdometryParams
from diff_encoder_sim.wheels.report_link import PROMPT
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams


def given_encoders(options: DriveOptions) -> List[ChosenEncoder]:
    """Return the encoders of the command line in their order.

    Raises:
        ConfigError: an encoder is invalid, or given twice.
    """
    ideal = _ideal(options.ppr or ())
    real = [chosen(each) for each in load_encoders(options.encoder or (), package_folder() / 'config', Path())]
    for option, encoders in (('--ppr', ideal), ('--encoder', real)):
        labels = [encoder.label for encoder in encoders]
        twice = next((label for label in labels if labels.count(label) > 1), None)
        if twice is not None:
            raise ConfigError(f'{option}: given {twice} twice; allowed: each once')
    return [*ideal, *real]


def chosen_encoders(given: Sequence[ChosenEncoder], own: EncoderParams) -> List[ChosenEncoder]:
    """Return the given encoders; by default the robot's own if it has a resolution, otherwise those of the paper.

    Raises:
        ConfigError: a PPR is given, but the robot's own encoder has a resolution.
    """
    resolution = own_encoder(own).resolution
    if not given:
        return [own_encoder(own)] if resolution else _ideal(PAPER_PPR)
    ideal = [encoder.label for encoder in given if encoder.real is None]
    if ideal and resolution:
        raise ConfigError(f'--ppr: given {" ".join(ideal)} with encoder: {resolution}; allowed: one of them')
    return list(given)


def _ideal(given: Union[float, Sequence[Any]]) -> List[ChosenEncoder]:
    texts = given if isinstance(given, (list, tuple)) else [given]
    return [ChosenEncoder(ppr_of_text('--ppr', text)) for text in texts]


def ppr_of_text(option: str, text: Any) -> PerWheel:
    """Parse a PPR: a number, or a YAML mapping with a number per wheel.

    Raises:
        ConfigError: the text has a different form.
    """
    return EncoderParams.from_mapping({'ppr': yaml_value(str(text), option)}, option).ppr


def parameters_with(
    encoder: ChosenEncoder, of_robot: EncoderParams, odometry: OdometryParams
) -> Tuple[EncoderParams, OdometryParams]:
    """Return the parameters of a robot with another encoder.

    Raises:
        ConfigError: the parameters contradict each other.
    """
    changes: Dict[str, Any] = {'ppr': encoder.ppr}
    if encoder.real:
        params = encoder.real.params
        changes.update({**params.model_dump(exclude_unset=True), 'encoder': params.encoder.model_dump()})
    shared = {key: value for key, value in changes.items() if key in OdometryParams.model_fields}
    source = f'encoder {encoder.label}'
    return with_changes(of_robot, changes, source), with_changes(odometry, shared, source)


USUAL = 'config/config.yaml'
PAPER_PPR = (40, 90, 1024, 4096)


@dataclass(frozen=True)
class DriveOptions:
    """Options of the command reencode; only the bag or the table is required."""

    bag: Optional[Path] = None
    csv: Optional[Path] = None  # table that replaces the bag
    ppr: Union[float, Sequence[Any]] = ()  # ideal encoders: numbers, or mappings by wheel
    encoder: Sequence[str] = ()  # real encoders
    out: Optional[Path] = None
    joint_states: str = ''
    left: str = ''
    right: str = ''
    pulses: str = ''
    pulses_ppr: str = ''
    ticks: Sequence[str] = ()
    columns: Sequence[str] = ()
    time_unit: str = ''
    unit: str = ''
    ticks_per_revolution: Any = ''
    ticks_modulus: Optional[int] = None
    reversed: Sequence[str] = ()
    odom: str = ''
    seed: Optional[int] = None
    reference: str = ''
    config: Optional[Path] = None
    robot: Optional[str] = None
    robot_args: Sequence[str] = ()
    packages: Sequence[Path] = ()

    @property
    def path(self) -> Path:
        """Return the path of the bag or the table."""
        return self.csv or self.bag or Path()


class RecordedRobot(NamedTuple):
    """Parameters of a recorded drive."""

    encoder: EncoderParams
    odometry: OdometryParams
    counts_modulus: int  # of recorded counts, not of computed encoders
    sources: Dict[str, str]  # by parameter name; ppr only if a file sets it

    def is_guessed(self) -> bool:
        """Return whether neither the user nor the bag specifies the wheels."""
        return all(self.sources[name] == USUAL for name in OF_ODOMETRY)

    @property
    def draws_errors(self) -> bool:
        """Return whether the robot's own encoder has random errors."""
        return self.encoder.encoder != IDEAL_ENCODER or self.encoder.report != PROMPT

    def counter_text(self) -> str:
        """Return the modulus of recorded counts, with its source."""
        wraps = f'wrap at {self.counts_modulus}' if self.counts_modulus else 'do not wrap'
        return f'counts {wraps}: {self.sources["counter_modulus"]}'

    def text(self) -> str:
        """Return the wheel parameters with their sources, in one line."""
        odometry = self.odometry
        values = {
            'wheel_diameter': f'diameter {odometry.wheel_diameter:g} m',
            'wheel_separation': f'separation {odometry.wheel_separation:g} m',
            'axle_x': f'axle at x = {odometry.axle_x:g} m',
            'left_joint': f'left joint {self.encoder.left_joint}',
            'right_joint': f'right joint {self.encoder.right_joint}',
        }
        by_source: Dict[str, List[str]] = {}
        for name, value in values.items():
            by_source.setdefault(self.sources[name], []).append(value)
        return 'wheels: ' + '; '.join(f'{", ".join(parts)} ({source})' for source, parts in by_source.items())


def recorded_robot(options: DriveOptions, trial: Optional[Trial]) -> RecordedRobot:
    """Collect the parameters of a recorded drive.

    Raises:
        ConfigError: a file is missing or invalid, or a value is not allowed.
    """
    usual = load_yaml(package_folder() / 'config' / 'config.yaml')
    values, sources = dict(usual), dict.fromkeys([*OF_ODOMETRY, *OF_ENCODER], USUAL)

    def add(layer: Dict[str, Any], source: str) -> None:
        values.update(merged(values, layer))
        sources.update(dict.fromkeys(layer, source))

    if trial is not None:
        of_trial = {name: getattr(trial, name) for name in (*OF_ODOMETRY, *UNCERTAINTY_KEYS, *OF_ENCODER)}
        add({**of_trial, 'seed': trial.number}, f"the bag's {TRIAL}")
    if options.robot:
        arguments = xacro_arguments(options.robot_args)
        robot = load_robot(options.robot, Path(), package_folder(), arguments, options.packages)
        add(nested(_encoder_and_odometry(robot.settings, options)), robot.file.where)
        if robot.file.ppr is not None:
            add({'ppr': robot.file.ppr}, robot.file.where)
    if options.config:
        given = load_yaml(options.config)
        add(
            {key: value for key, value in given.items() if not options.robot or usual.get(key) != value},
            str(options.config),
        )
    if options.seed is not None:
        add({'seed': options.seed}, '--seed')
    name = str(options.config or options.robot or USUAL)
    encoder = shared_params(values, name, EncoderParams, OdometryParams)
    odometry = shared_params(values, name, OdometryParams, EncoderParams)
    return RecordedRobot(encoder, odometry, _counts_modulus(encoder, trial, options.config, sources), sources)


def _counts_modulus(
    encoder: EncoderParams, trial: Optional[Trial], config: Optional[Path], sources: Dict[str, str]
) -> int:
    """Return the modulus of recorded counts; /trial overrides --robot, whose encoder may differ from the recorded one.

    Encoders to compute have their own modulus.
    """
    given = sources.setdefault('counter_modulus', USUAL)
    if trial is None or given == str(config) or (given != USUAL and not trial.counter_modulus):
        return encoder.counter_modulus
    sources['counter_modulus'] = f"the bag's {TRIAL}"
    return trial.counter_modulus


def _encoder_and_odometry(of_robot: Mapping[str, Any], options: DriveOptions) -> Dict[str, Any]:
    """Return the robot's values of config.yaml, by dotted keys; --ppr and --encoder override its resolution."""
    gives_way = RESOLUTION_KEYS if options.ppr or options.encoder else ()
    values = {key: value for key, value in of_robot.items() if key not in gives_way}
    of_config = {key.partition('.')[2]: value for key, value in values.items() if key.startswith('config.')}
    return {**uncertainty_of_robot(of_robot), **of_config}


# Wheel sources, and the options that belong to them.
_SOURCES = ('joint_states', 'pulses', 'ticks', 'odom', 'csv')
_BELONGS_TO = {
    'left': ('joint_states', 'pulses'),
    'right': ('joint_states', 'pulses'),
    'pulses_ppr': ('pulses', 'joint_states'),  # joint states may contain counts
    'unit': ('ticks', 'csv'),
    'ticks_per_revolution': ('ticks', 'csv'),
    'ticks_modulus': ('ticks', 'csv'),
    'reversed': ('ticks', 'csv'),
    'columns': ('csv',),
    'time_unit': ('csv',),
}


def check_wheel_options(options: DriveOptions) -> None:
    """Refuse contradictory options.

    Raises:
        ConfigError: there is more than one source, or an option of another source.
    """
    given = [name for name in _SOURCES if getattr(options, name)]
    if len(given) > 1:
        all_of_them = 'both' if len(given) == 2 else 'all'
        raise ConfigError(f'{", ".join(map(_option, given))}: given {all_of_them}; allowed: one of them')
    if bool(options.bag) == bool(options.csv):
        raise ConfigError(f'BAG, --csv: given {"both" if options.csv else "neither"}; allowed: one of them')
    for name, units in (('unit', UNITS), ('time_unit', TIME_UNITS)):
        if getattr(options, name) not in ('', *units):
            raise ConfigError(f'{_option(name)}: given {getattr(options, name)}; allowed: {", ".join(units)}')
    if options.csv and not options.columns:
        raise ConfigError('--csv: given without --columns; expected --columns TIME LEFT RIGHT, as names or numbers')
    for name, sources in _BELONGS_TO.items():
        if getattr(options, name) not in (None, '', ()) and (given or ['joint_states'])[0] not in sources:
            used = _option(given[0]) if given else 'wheel angles of joints'
            allowed = ' or '.join(map(_option, sources))
            raise ConfigError(f'{_option(name)}: given with {used}; allowed: with {allowed}')


def check_seed(options: DriveOptions, robot: RecordedRobot) -> None:
    """Refuse an unused seed.

    Raises:
        ConfigError: neither encoder errors nor start angles are random.
    """
    is_used = options.encoder or robot.draws_errors or options.odom or options.unit in SPEEDS
    if options.seed is not None and not is_used:
        raise ConfigError(
            f'--seed: given {options.seed}, but nothing is random; allowed: with --encoder, with errors of an '
            f'encoder in --config or --robot, with --odom, or with --unit {", ".join(SPEEDS)}'
        )


def _option(name: str) -> str:
    return f'--{name.replace("_", "-")}'


class WheelUnits(NamedTuple):
    """Interpretation of the numbers of both wheels."""

    left: WheelUnit
    right: WheelUnit
    ppr: Optional[PerWheel]  # of counts
    about: str  # text for the user
    notes: Tuple[str, ...]  # limits of the angles


def wheel_numbers(options: DriveOptions, robot: RecordedRobot, bits: Tuple[Optional[int], Optional[int]]) -> WheelUnits:
    """Return the interpretation of wheel numbers from options and robot.

    Args:
        options: options of the command.
        robot: source of the wheel diameter, and of the ticks per revolution if not given.
        bits: width of the left and the right counter; None if it does not wrap.

    Raises:
        ConfigError: the ticks per revolution are missing, or do not fit the unit.
    """
    unit, radius_m = options.unit or TICKS, 0.5 * robot.odometry.wheel_diameter
    ppr, moduli = _ticks_ppr(options, unit, robot), _moduli(options, unit, bits)
    pprs = (ppr.left, ppr.right) if ppr else (None, None)
    seed = DEFAULT_SEED if options.seed is None else options.seed
    left, right = (
        WheelUnit(unit, radius_m, of_side, modulus, side in options.reversed, start_rad)
        for side, of_side, modulus, start_rad in zip(('left', 'right'), pprs, moduli, start_angles_rad(seed))
    )
    notes = (SPEEDS_NOTE, start_angles_note(seed)) if unit in SPEEDS else ()
    return WheelUnits(left, right, ppr, _about(unit, ppr, moduli, options.reversed), notes)


def _ticks_ppr(options: DriveOptions, unit: str, robot: RecordedRobot) -> Optional[PerWheel]:
    """Return the ticks per revolution: as given, otherwise of the robot; None for units other than counts."""
    given = options.ticks_per_revolution
    if unit not in COUNTED:
        if given:
            raise ConfigError(
                f'--ticks-per-revolution: given with --unit {unit}; allowed: with {" and ".join(COUNTED)}'
            )
        return None
    if given:
        return ppr_of_text('--ticks-per-revolution', given)
    if 'ppr' not in robot.sources:
        raise ConfigError('--ticks-per-revolution: missing; expected the ticks per wheel revolution, or --robot')
    return robot.encoder.ppr


def _moduli(options: DriveOptions, unit: str, bits: Sequence[Optional[int]]) -> Tuple[int, ...]:
    """Return the modulus of each counter: as given, otherwise by the width of its field; 0 if it does not wrap."""
    given = options.ticks_modulus
    if unit != TICKS:
        if given is not None:
            raise ConfigError(f'--ticks-modulus: given with --unit {unit}; allowed: with {TICKS}')
        return (0, 0)
    return tuple((2**width if width else 0) if given is None else given for width in bits)


def _about(unit: str, ppr: Optional[PerWheel], moduli: Sequence[int], is_reversed: Sequence[str]) -> str:
    parts = [unit]
    if ppr is not None:
        parts.append(f'{ppr_label(ppr)} a revolution')
    if any(moduli):
        parts.append(f'the counter wraps at {" and ".join(str(modulus) for modulus in sorted(set(moduli)))}')
    parts.extend(f'{side} reversed' for side in is_reversed)
    return ', '.join(parts)


def bag_wheels(options: DriveOptions, source: BagSource, trial: Optional[Trial], robot: RecordedRobot) -> WheelSource:
    """Return the wheels of a bag.

    Raises:
        ConfigError: there are none; the message lists the alternatives.
    """
    if options.odom:
        poses = find_poses(options.path, source, '--odom', options.odom)
        seed = DEFAULT_SEED if options.seed is None else options.seed
        return OdometryWheels(poses, _joints(robot), robot.odometry, seed)
    if options.ticks:
        return _field_wheels(options, source, robot)
    return _joint_wheels(options, source, trial, robot)


def csv_wheels(options: DriveOptions, stream: CsvStream, robot: RecordedRobot) -> CsvWheels:
    """Return the wheels of a CSV file.

    Raises:
        ConfigError: the ticks per revolution are missing.
    """
    numbers = wheel_numbers(options, robot, (None, None))
    return CsvWheels(
        stream.topic, _joints(robot), (numbers.left, numbers.right), numbers.ppr, numbers.about, numbers.notes
    )


def _field_wheels(options: DriveOptions, source: BagSource, robot: RecordedRobot) -> FieldWheels:
    left, right = (find_field(options.path, source, '--ticks', given) for given in options.ticks)
    if left.name == right.name:
        raise ConfigError(f'{options.path}: --ticks: given {left.name} for both wheels; allowed: two different fields')
    numbers = wheel_numbers(options, robot, (left.bits, right.bits))
    joints = _joints(robot)
    wheels = Wheel(joints[0], left, numbers.left), Wheel(joints[1], right, numbers.right)
    return FieldWheels(*wheels, numbers.ppr, numbers.about, numbers.notes)


def _joint_wheels(
    options: DriveOptions, source: BagSource, trial: Optional[Trial], robot: RecordedRobot
) -> WheelSource:
    has_joints = any(joint_topics(source, kind) for kind in JOINT_TYPES)
    if not (options.joint_states or options.pulses or has_joints):
        listed = _serving(options, source) or f'nothing in its topics {", ".join(sorted(source.topics))}'
        raise ConfigError(f'{options.path}: no topic of {" or ".join(JOINT_TYPES)}; alternatives: {listed}')
    given_ppr = ppr_of_text('--pulses-ppr', options.pulses_ppr) if options.pulses_ppr else None
    trial_ppr = trial.ppr if trial else None
    chosen = WheelOptions(options.joint_states, options.pulses, given_ppr or trial_ppr, options.left, options.right)
    try:
        wheels = find_wheels(options.path, source, chosen, robot.encoder)
    except ConfigError as error:
        other = '' if options.joint_states or options.pulses else _serving(options, source)
        raise ConfigError(f'{error}; alternatives: {other}' if other else str(error)) from None
    if given_ppr is not None and wheels.ppr is None:
        raise ConfigError(
            f'--pulses-ppr: given, but {wheels.topic} has wheel angles; expected --pulses TOPIC with it, or neither'
        )
    if wheels.ppr is None:
        return JointWheels(wheels, source.is_cdr)
    counting = {'ppr': wheels.ppr, 'counter_modulus': robot.counts_modulus, 'encoder': IDEAL_ENCODER}
    odometry, notes = robot.odometry.model_copy(update=counting), [] if given_ppr else _notes_on_counts(trial, robot)
    return PulseWheels(wheels.topic, wheels.joints, source.is_cdr, odometry, robot.counter_text(), notes)


def _notes_on_counts(trial: Optional[Trial], robot: RecordedRobot) -> List[str]:
    """Return notes on the recorded encoder of /trial: its errors, and a different modulus of its counter."""
    notes = []
    if trial and (trial.encoder or trial.variant):
        variant = f', variant {trial.variant}' if trial.variant else ''
        notes.append(f'the angles are counts of {trial.encoder_label}{variant}, with its errors')
    if trial and trial.counter_modulus and robot.counts_modulus != trial.counter_modulus:
        notes.append(f'{robot.counter_text()}; the recorded trial has {trial.counter_modulus}')
    return notes


def _serving(options: DriveOptions, source: BagSource) -> str:
    return ' | '.join(serving_options(source))


def _joints(robot: RecordedRobot) -> Tuple[str, str]:
    return robot.encoder.left_joint, robot.encoder.right_joint
