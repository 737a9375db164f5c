"""Recorded drives: what their odometry would have been with other encoders."""

from __future__ import annotations

import contextlib
import logging
import time
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from diff_encoder_sim.api.notes import encoder_lines
from diff_encoder_sim.api.wheel_options import (
    DriveOptions,
    RecordedRobot,
    bag_wheels,
    check_seed,
    check_wheel_options,
    chosen_encoders,
    csv_wheels,
    given_encoders,
    parameters_with,
    recorded_robot,
)
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D, PoseSeries
from diff_encoder_sim.drives.bag_output import ReencodedBag
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.csv_wheels import CsvStream
from diff_encoder_sim.drives.reencoder import DriveSummary, Reencoder, has_commands
from diff_encoder_sim.drives.reference import Reference, find_reference
from diff_encoder_sim.drives.result_table import csv_table, text_table
from diff_encoder_sim.drives.sensor_messages import JointValues
from diff_encoder_sim.drives.topics import CMD_VEL
from diff_encoder_sim.drives.trajectory_error import PathError
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.drives.trial_recording import trial_of_source
from diff_encoder_sim.drives.wheel_source import DriveStream, WheelSource
from diff_encoder_sim.drives.wheels_at_ppr import WheelsAtPpr
from diff_encoder_sim.wheels.catalogue import ChosenEncoder
from diff_encoder_sim.wheels.diagnostics import encoder_lateral_std, hidden_encoder
from diff_encoder_sim.wheels.encoder_params import PerWheel, file_label, ppr_label
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

log = logging.getLogger(__name__)

CSV_NAME = 'reencode.csv'
LEGEND = """\
Odometry minus reference, aligned at the first common stamp, no fit. ATE, max:
distance over the whole path, root mean square and largest. yaw: root mean square. end: along (x)
and across (y) the start heading. RPE: error of the motion over segments of the reference's path,
root mean square of so many segments: consecutive ones lie end to end, all pairs have one from each
pose on. evo gives the same numbers: docs/recorded_drives.md."""


class ReencodedDrive(NamedTuple):
    """A recorded drive as an encoder would have measured it."""

    ppr: str  # label of the encoder
    odometry: PoseSeries  # base in odom
    error: Optional[PathError]  # against the reference; None if no stamps are common


class Reencoding(NamedTuple):
    """A recorded drive with each encoder, and the same as text."""

    drives: List[ReencodedDrive]
    notes: List[str]  # on what could not be read or compared, and on the encoders
    text: str
    files: List[Path]  # that were written


def reencode(bag: Union[str, Path, None] = None, **options: Any) -> List[ReencodedDrive]:
    """Compute what the odometry of a recorded drive would have been with other encoders, one result for each.

    Args:
        bag: of ROS 1 or ROS 2; None if the option csv names a table.
        options: of the command `reencode`, see `DriveOptions`: ppr, encoder, out, robot, reference, ...

    Raises:
        ConfigError: an option or a file is bad, a file cannot be written, or there is no drive in the bag.
    """
    paths = {key: Path(options[key]) for key in ('csv', 'out', 'config') if options.get(key) is not None}
    done = reencoding(DriveOptions(**{**options, **paths, 'bag': None if bag is None else Path(bag)}))
    for note in done.notes:
        log.warning('%s', note)
    return done.drives


def reencoding(options: DriveOptions) -> Reencoding:
    """Compute a recorded drive with each encoder.

    Raises:
        ConfigError: as `reencode`.
    """
    begin_s = time.perf_counter()
    given = given_encoders(options)
    with opened_drive(options) as drive:
        encoders = chosen_encoders(given, drive.robot.encoder)
        files = output_files(options.out, drive.path, encoders)
        notes = list(encoder_lines(encoders, drive.robot.odometry.wheel_diameter))
        runs = [_run_with(encoder, drive.robot) for encoder in encoders]
        try:
            summary = run_drive(drive, runs, files)
        except OSError as error:
            raise ConfigError(f'{error.filename or options.out or drive.path}: {error.strerror}') from None
        others = [*notes_on(drive, runs, summary), *(_hidden_encoder(encoders, drive.robot) if files else [])]
        notes += [f'{drive.path}: {note}' for note in others]
        text = _text(drive, runs, summary, time.perf_counter() - begin_s)
    drives = [ReencodedDrive(run.label, _series(run.path), run.comparison.result()) for run in runs]
    return Reencoding(drives, notes, text, list(files.values()))


def read_path(bag: Union[str, Path], reference: str = '/odom') -> PoseSeries:
    """Read the poses of a topic, such as /odom or /world_pose, or of a frame in another, as 'map->base_link'.

    Raises:
        ConfigError: the bag cannot be read, or has no such poses.
        InputFault: a message is torn.
    """
    path = Path(bag)
    with open_source(path) as source:
        poses = find_reference(path, source, reference)
        found = [pose for message in source.messages(poses.topics) for pose in poses.poses(message)] if poses else []
    if not found:
        raise ConfigError(f'{path}: no poses of {reference}')
    return _series([(pose.stamp_ns, pose.pose) for pose in found])


class RecordedDrive(NamedTuple):
    """A bag or a table with its wheels and reference, and the parameters that it is read with."""

    path: Path
    stream: DriveStream
    trial: Optional[Trial]
    wheels: WheelSource
    reference: Optional[Reference]
    robot: RecordedRobot


class _WheelsWithPath(WheelsAtPpr):
    """Keeps the whole path."""

    def __init__(self, ppr: PerWheel, encoder: EncoderParams, odometry: OdometryParams, name: str = '') -> None:
        super().__init__(ppr, encoder, odometry, name)
        self.path: List[Tuple[int, Pose2D]] = []

    def update(self, time_ns: int, joints: JointValues) -> bool:
        """Take a joint message, as `WheelsAtPpr` does."""
        has_moved = super().update(time_ns, joints)
        if has_moved:
            self.path.append(self.stamped_pose)
        return has_moved


def _run_with(encoder: ChosenEncoder, robot: RecordedRobot) -> _WheelsWithPath:
    """Return the wheels of a recorded robot with another encoder.

    Raises:
        ConfigError: they do not go together.
    """
    params, odometry = parameters_with(encoder, robot.encoder, robot.odometry)
    return _WheelsWithPath(encoder.ppr, params, odometry, encoder.name)


def _hidden_encoder(encoders: Sequence[ChosenEncoder], robot: RecordedRobot) -> List[str]:
    """Return a note on the finest encoder that the default motion noise hides in the covariance of the bags."""
    if robot.odometry.motion_noise is not None:
        return []
    all_params = [parameters_with(encoder, robot.encoder, robot.odometry)[1] for encoder in encoders]
    return [line for line in [hidden_encoder(min(all_params, key=encoder_lateral_std))] if line]


def _series(path: Sequence[Tuple[int, Pose2D]]) -> PoseSeries:
    stamps_ns = np.array([stamp_ns for stamp_ns, _ in path], dtype=np.int64)
    return PoseSeries(stamps_ns, np.array([(pose.x_m, pose.y_m, pose.yaw_rad) for _, pose in path]).reshape(-1, 3))


def output_files(folder: Optional[Path], bag: Path, encoders: Sequence[ChosenEncoder]) -> Dict[str, Path]:
    """Return the path of each encoder's bag, by its label, and that of the CSV file; none without a folder.

    Raises:
        ConfigError: one of the files exists.
    """
    if folder is None:
        return {}
    stem = bag.resolve().stem  # also where the bag is given as `.`
    files = {each.label: folder / f'{stem}_{file_label(each.ppr, each.name)}.bag' for each in encoders}
    files[CSV_NAME] = folder / CSV_NAME
    for path in files.values():
        if path.exists():
            raise ConfigError(f'--out: {path} exists; allowed: a folder without it')
    return files


@contextlib.contextmanager
def opened_drive(options: DriveOptions) -> Iterator[RecordedDrive]:
    """Open the drive that the options name, for as long as the context lasts.

    Raises:
        ConfigError: a file or an option is bad.
    """
    check_wheel_options(options)
    if options.csv:
        if options.reference:
            raise ConfigError('--reference: given with --csv; allowed: with a bag, which may have poses')
        stream = CsvStream(options.csv, options.columns, options.time_unit or 's')
        robot = recorded_robot(options, None)
        check_seed(options, robot)
        yield RecordedDrive(options.csv, stream, None, csv_wheels(options, stream, robot), None, robot)
        return
    with open_source(options.path) as source:
        trial = trial_of_source(options.path, source)
        robot = recorded_robot(options, trial)
        check_seed(options, robot)
        wheels = bag_wheels(options, source, trial, robot)
        reference = find_reference(options.path, source, options.reference)
        yield RecordedDrive(options.path, source, trial, wheels, reference, _with_joints(options, wheels, robot))


def _with_joints(options: DriveOptions, wheels: WheelSource, robot: RecordedRobot) -> RecordedRobot:
    """Take the names of the joints from where the wheels are read."""
    sources = dict(robot.sources)
    for side, joint in zip(('left', 'right'), wheels.joints):
        if joint != getattr(robot.encoder, f'{side}_joint'):
            sources[f'{side}_joint'] = f'--{side}' if getattr(options, side) else f"the bag's {wheels.topics[0]}"
    encoder = robot.encoder.model_copy(update={'left_joint': wheels.joints[0], 'right_joint': wheels.joints[1]})
    if not wheels.are_joint_angles:  # whoever counted or computed them knew which way is forward
        encoder = encoder.model_copy(update={'left_reversed': False, 'right_reversed': False})
    return robot._replace(encoder=encoder, sources=sources)


def run_drive(drive: RecordedDrive, runs: Sequence[WheelsAtPpr], files: Mapping[str, Path]) -> DriveSummary:
    """Read the drive for each encoder, and write `files`, which may be none.

    Raises:
        ConfigError: there is no drive in it.
        OSError: a file cannot be written.
    """
    if not files:
        return _run(drive, runs)
    with contextlib.ExitStack() as stack:
        for run in runs:
            run.bag = ReencodedBag(files[run.label], drive.wheels.joints, drive.robot.odometry)
            stack.enter_context(run.bag)
        summary = _run(drive, runs)
    with open(files[CSV_NAME], 'x', encoding='utf-8') as file:
        file.write(csv_table(runs))
    return summary


def _run(drive: RecordedDrive, runs: Sequence[WheelsAtPpr]) -> DriveSummary:
    summary = Reencoder(drive.wheels, drive.reference, runs).run(drive.stream, drive.trial)
    if not any(run.reports > 1 for run in runs):
        why = '; '.join(summary.faults) or drive.stream.fault or 'too short'
        raise ConfigError(
            f'{drive.path}: no drive in {summary.messages} {drive.wheels.text}: {why}; '
            f'expected two reports of the encoder'
        )
    return summary


def notes_on(drive: RecordedDrive, runs: Sequence[WheelsAtPpr], summary: DriveSummary) -> List[str]:
    """List what could not be read or compared, one line each."""
    notes = [*drive.wheels.notes(), *summary.faults]
    if drive.robot.is_guessed():
        notes.append('neither the bag nor --robot has wheel parameters; using config/config.yaml')
    if any(run.counts_by_command for run in runs) and not has_commands(drive.stream):
        notes.append(f'no {CMD_VEL} (geometry_msgs/Twist), by which the encoder counts: all counts are forward')
    if drive.stream.fault:
        notes.append(f'{drive.stream.fault}; what can be read is used')
    if drive.reference and not any(run.comparison.result() for run in runs):
        notes.append(
            f'no pose of {drive.reference.name} has the time of an odometry message: errors cannot be computed'
        )
    return notes


def _text(drive: RecordedDrive, runs: Sequence[WheelsAtPpr], summary: DriveSummary, took_s: float) -> str:
    """Return the drive, its wheels and the errors of each encoder as text for the terminal."""
    reference = drive.reference.name if drive.reference else 'the odometry of the finest PPR'
    read = f'{summary.messages} {drive.wheels.text} in {summary.duration_s:.1f} s, read in {took_s:.1f} s'
    lines = [f'{drive.path}: {read}; compared with {reference}', drive.robot.text()]
    recorded = drive.wheels.ppr
    if recorded is not None:
        finer = [run.label for run in runs if run.ppr.left > recorded.left or run.ppr.right > recorded.right]
        if finer:
            lines.append(
                f'recorded with {ppr_label(recorded)} PPR: {", ".join(finer)} limited by the recorded resolution'
            )
    return '\n'.join([*lines, '', text_table(runs), '', LEGEND])
