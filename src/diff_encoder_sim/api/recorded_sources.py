"""Opens and reads recorded drives, bags and tables, for commands that have `SourceOptions`."""

from __future__ import annotations

from pathlib import Path
from typing import List, NamedTuple, Optional, Tuple

from diff_encoder_sim.api import wheel_options
from diff_encoder_sim.api.options import SourceOptions, WheelOptions
from diff_encoder_sim.api.wheel_options import RecordedRobot
from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.per_wheel import PerWheel
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.csv_table import CsvStream
from diff_encoder_sim.drives.drive_stream import DriveStream
from diff_encoder_sim.drives.recorded_poses import RecordedPoses
from diff_encoder_sim.drives.reencoding import overlap_fault, read_drive
from diff_encoder_sim.drives.reference import Reference
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.drives.trial_recording import trial_of_source
from diff_encoder_sim.drives.wheel_source import WheelSource


class OpenedDrive(NamedTuple):
    """A recorded drive, ready to be read."""

    source: DriveStream
    trial: Optional[Trial]
    robot: RecordedRobot
    wheels: WheelSource
    poses: Optional[RecordedPoses]  # of the reference


def open_drive(
    options: WheelOptions,
    path: Path,
    is_table: bool,
    reference_csv: Optional[Path] = None,
    seed: Optional[int] = None,
    has_encoders: bool = False,
) -> OpenedDrive:
    """Open a bag or a table; `seed` and `has_encoders` are for `recorded_robot`. ConfigError if it cannot be read."""
    source = CsvStream(path, options.columns, options.time_unit or 's') if is_table else open_source(path)
    trial = trial_of_source(source)
    robot = wheel_options.recorded_robot(options, trial, seed, has_encoders)
    wheels = wheel_options.drive_wheels(options, source, trial, robot)
    poses = None
    if isinstance(options, SourceOptions):
        poses = wheel_options.drive_reference(options, source, reference_csv)
    return OpenedDrive(source, trial, robot, wheels, poses)


class RecordedDrive(NamedTuple):
    """A drive with its reference."""

    path: Path
    parts: List[Tuple[Drive, Reference]]  # several if the stamps go back
    ppr: Optional[PerWheel]  # counts per wheel revolution of the encoder that counted; None if angles were recorded
    robot: RecordedRobot
    notes: List[str]  # on unreadable, unusable and repeated data, one line each


def read_recorded(
    options: SourceOptions, path: Path, is_table: bool, reference_csv: Optional[Path] = None
) -> RecordedDrive:
    """Read one drive with its reference, for estimators. Call `wheel_options.check_wheel_options` before.

    Wheel angles [rad] are accumulated, positive forward by `--reversed`, and of counts to half a count. Stamps of both
    increase strictly: rows that repeat a stamp, or that others have overtaken, are left out and counted in the notes.

    Args:
        options: sources and units, common to all drives of a command.
        path: bag of ROS 1 or ROS 2, or a table with the columns of `--columns`.
        is_table: it is a table.
        reference_csv: table of the reference (`--reference-columns`); None: the reference is in the drive's own file.

    Raises:
        ConfigError: the file cannot be read, has no such topic or column, fewer than two samples of the wheels, or no
            reference at their stamps.
    """
    source, _, robot, wheels, poses = open_drive(options, path, is_table, reference_csv)
    if poses is None:
        allowed = '--reference-columns TIME X Y [YAW]' if is_table else '--reference TOPIC|FRAMES, or --reference-csv'
        raise ConfigError(f'{path}: no reference; expected {allowed}')
    read = read_drive(source, wheels, poses)
    fault = overlap_fault(read)
    if fault:
        raise ConfigError(f'{path}: {fault}')
    parts = [(timed.drive, reference) for timed, reference in zip(read.drives, read.references)]
    notes = [*read.notes, *([source.fault] if source.fault else [])]
    return RecordedDrive(path, parts, wheels.ppr, robot, notes)
