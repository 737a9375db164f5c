"""Re-encode recorded drives: odometry of the same drive with other encoders."""

from __future__ import annotations

import contextlib
import logging
import time
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Union

import numpy as np

from diff_encoder_sim.api import wheel_options
from diff_encoder_sim.api.options import DriveOptions
from diff_encoder_sim.api.recorded_sources import open_drive
from diff_encoder_sim.api.wheel_options import RecordedRobot, parameters_with
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import PoseSeries
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.drives import reencoding as encoding
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.drive_stream import DriveStream
from diff_encoder_sim.drives.recorded_poses import find_poses
from diff_encoder_sim.drives.reencoding import EncodedDrive, Encoder, ReadDrive
from diff_encoder_sim.drives.topics import CMD_VEL, TRIAL
from diff_encoder_sim.drives.trajectory_error import PathError
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.drives.wheel_source import WheelSource
from diff_encoder_sim.wheels.catalogue import ChosenEncoder, encoder_lines
from diff_encoder_sim.wheels.diagnostics import encoder_lateral_std, hidden_encoder
from diff_encoder_sim.wheels.encoder_params import file_label, ppr_label

log = logging.getLogger(__name__)

CSV_NAME = 'reencode.csv'
LEGEND = """\
Odometry minus reference, aligned at the first common stamp, no fit. ATE, max:
distance over the whole path, root mean square and largest. yaw: root mean square. end: along (x)
and across (y) the start heading. RPE: error of the motion over segments of the reference's path,
root mean square over the given number of segments (consecutive: end to end; all pairs: one from
each pose). evo gives the same numbers: docs/recorded_drives.md."""


class ReencodedDrive(NamedTuple):
    """Recorded drive with one encoder."""

    ppr: str  # label of the encoder
    odometry: PoseSeries  # base in odom
    error: Optional[PathError]  # against the reference; None if no stamps are common


class Reencoding(NamedTuple):
    """Recorded drive with each encoder, and a text report."""

    drives: List[ReencodedDrive]
    notes: List[str]  # on unreadable or missing data and on encoders
    text: str
    files: List[Path]  # written files


def reencode(bag: Union[str, Path, None] = None, **options: Any) -> List[ReencodedDrive]:
    """Compute the odometry of a recorded drive with other encoders; return one result per encoder.

    Args:
        bag: ROS 1 or ROS 2 bag; None if the option csv is given.
        options: options of the command `reencode`, see `DriveOptions`: ppr, encoder, out, robot, reference, ...

    Raises:
        ConfigError: an option or a file is invalid, a file cannot be written, or the bag contains no drive.
    """
    paths = {key: Path(options[key]) for key in ('csv', 'out', 'config') if options.get(key) is not None}
    done = reencoding(DriveOptions(**{**options, **paths, 'bag': None if bag is None else Path(bag)}))
    for note in done.notes:
        log.warning('%s', note)
    return done.drives


def reencoding(options: DriveOptions) -> Reencoding:
    """Compute a recorded drive with each encoder; errors as in `reencode`."""
    begin_s = time.perf_counter()
    wheel_options.check_wheel_options(options, options.bag, options.csv)
    path, table = options.csv or options.bag or Path(), next(iter(options.reference_csv), None)
    has_encoders = bool(options.ppr or options.encoder)
    source, trial, robot, wheels, reference = open_drive(
        options, path, bool(options.csv), table, options.seed, has_encoders
    )
    phases_rad = None
    if not (wheels.is_start_known or wheels.ppr):
        phases_rad = generator(1 if options.seed is None else options.seed, 'wheel_phase').uniform(
            0.0, 2.0 * np.pi, (1, 2)
        )
    robot = _with_joints(options, wheels, robot)
    chosen = wheel_options.chosen_encoders(options, robot.encoder)
    files = output_files(options.out, path, chosen)
    encoders = [Encoder(each, *parameters_with(each, robot.encoder, robot.odometry)) for each in chosen]
    copied = [*encoding.copied_topics(source), *([TRIAL] if trial else [])] if files else []
    read = encoding.read_drive(source, wheels, reference, copied)
    why = '; '.join(read.notes[-1:]) or source.fault or 'too short'
    no_drive = f'no drive in {read.messages} {wheels.text}: {why}; expected two reports of the encoder'
    encoded = _encoded(path, read, encoders, trial, files, f'{path}: {no_drive}', phases_rad)
    notes = [*read.notes, *_notes(source, robot, encoders, bool(files))]
    errors = encoding.drive_errors(read, encoded, reference is not None)
    if reference and not any(errors):
        notes.append(f'no pose of {reference.name} has the stamp of an odometry message: no errors computed')
    rows = encoding.error_rows(encoded, errors)
    if files:
        try:
            with open(files[CSV_NAME], 'x', encoding='utf-8') as file:
                file.write(encoding.csv_table(rows))
        except OSError as error:
            raise ConfigError(f'{files[CSV_NAME]}: {error.strerror}') from None
    compared = reference.name if reference else 'the odometry of the finest PPR'
    about = f'{read.messages} {wheels.text} in {read.duration_s:.1f} s, read in {time.perf_counter() - begin_s:.1f} s'
    lines, recorded = [f'{path}: {about}; compared with {compared}', robot.text()], wheels.ppr
    if recorded:
        is_finer = [each.ppr.left > recorded.left or each.ppr.right > recorded.right for each in chosen]
        finer = ', '.join(each.label for each, is_limited in zip(chosen, is_finer) if is_limited)
        if finer:
            lines.append(f'recorded with {ppr_label(recorded)} PPR: {finer} limited by the recorded resolution')
    drives = [
        ReencodedDrive(encoder.label, PoseSeries(*(np.concatenate(parts) for parts in zip(*one.paths))), error)
        for encoder, one, error in zip(chosen, encoded, errors)
    ]
    return Reencoding(
        drives,
        [*encoder_lines(chosen, robot.odometry.wheel_diameter), *(f'{path}: {note}' for note in notes)],
        '\n'.join([*lines, '', encoding.text_table(rows), '', LEGEND]),
        list(files.values()),
    )


def read_path(bag: Union[str, Path], reference: str = '/odom') -> PoseSeries:
    """Read the poses of a topic, such as /odom or /world_pose, or of a transform, such as 'map->base_link'.

    Raises:
        ConfigError: the bag cannot be read, or contains no such poses.
        InputFault: a message is truncated.
    """
    source = open_source(Path(bag))
    poses = find_poses(source, '--reference', reference)
    for message in source.messages(poses.topics):
        poses.add(message)
    return poses.series()


def output_files(folder: Optional[Path], bag: Path, encoders: Sequence[ChosenEncoder]) -> Dict[str, Path]:
    """Return the paths of the bags by encoder label and of the CSV file, {} for None; ConfigError if one exists."""
    if folder is None:
        return {}
    stem = bag.resolve().stem  # resolved: the bag may be given as `.`
    files = {each.label: folder / f'{stem}_{file_label(each.ppr, each.name)}.bag' for each in encoders}
    files[CSV_NAME] = folder / CSV_NAME
    for path in files.values():
        if path.exists():
            raise ConfigError(f'--out: {path} exists; allowed: a folder without it')
    return files


def _with_joints(options: DriveOptions, wheels: WheelSource, robot: RecordedRobot) -> RecordedRobot:
    """Set the names of the joints to those of the wheel source."""
    sources = dict(robot.sources)
    for side, joint in zip(('left', 'right'), wheels.joints):
        if joint != getattr(robot.encoder, f'{side}_joint'):
            sources[f'{side}_joint'] = f'--{side}' if getattr(options, side) else f"the bag's {wheels.topics[0]}"
    encoder = robot.encoder.model_copy(update={'left_joint': wheels.joints[0], 'right_joint': wheels.joints[1]})
    if not wheels.are_joint_angles:  # counts and computed angles are positive forward
        encoder = encoder.model_copy(update={'left_reversed': False, 'right_reversed': False})
    return robot._replace(encoder=encoder, sources=sources)


def _encoded(
    path: Path,
    read: ReadDrive,
    encoders: Sequence[Encoder],
    trial: Optional[Trial],
    files: Mapping[str, Path],
    no_drive: str,
    phases_rad: Optional[np.ndarray],
) -> List[EncodedDrive]:
    """Compute the drive with each encoder, and write its bag if there are files; `no_drive`: error without one."""
    encoded = []
    try:
        with contextlib.ExitStack() as bags:  # removes the bags after an error
            for encoder in encoders:
                bag = bags.enter_context(TrialBag(files[encoder.chosen.label], 'full')) if files else None
                encoded.append(encoding.encode_drive(read, encoder, trial, bag, phases_rad))
            if not any(one.reports > 1 for one in encoded):
                raise ConfigError(no_drive)
    except OSError as error:
        raise ConfigError(f'{error.filename or path}: {error.strerror}') from None
    return encoded


def _notes(source: DriveStream, robot: RecordedRobot, encoders: Sequence[Encoder], has_bags: bool) -> Iterator[str]:
    """Yield notes on assumed or missing data."""
    if robot.is_guessed():
        yield 'neither the bag nor --robot contains wheel parameters; using config/config.yaml'
    if any(each.params.encoder.counts_by_command for each in encoders) and not encoding.has_commands(source):
        yield f'no {CMD_VEL} (geometry_msgs/Twist) for the direction of counts: all counts are forward'
    if source.fault:
        yield f'{source.fault}; using all readable messages'
    if has_bags and robot.odometry.motion_noise is None:
        hidden = hidden_encoder(min((each.odometry for each in encoders), key=encoder_lateral_std))
        yield from [hidden] if hidden else []
