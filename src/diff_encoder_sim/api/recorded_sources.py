"""Opens and reads recorded drives, bags and tables, for commands that have `SourceOptions`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import List, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.api import wheel_options
from diff_encoder_sim.api.options import SourceOptions, WheelOptions
from diff_encoder_sim.api.wheel_options import RecordedRobot
from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.per_wheel import PerWheel
from diff_encoder_sim.base.se2 import PoseSeries, poses_of_wheels
from diff_encoder_sim.calibration.scan_reference import scan_reference
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.csv_table import CsvStream
from diff_encoder_sim.drives.drive_stream import DriveStream
from diff_encoder_sim.drives.recorded_poses import RecordedPoses
from diff_encoder_sim.drives.reencoding import Encoder, ReadDrive, overlap_fault, read_drive
from diff_encoder_sim.drives.reference import Reference
from diff_encoder_sim.drives.scan_bag import read_laser_pose, read_scans
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.drives.trial_recording import trial_of_source
from diff_encoder_sim.drives.wheel_source import WheelSource
from diff_encoder_sim.wheels.catalogue import ChosenEncoder
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER
from diff_encoder_sim.wheels.report_link import PROMPT

RECORDED_PPR = 1e7  # for wheel angles that are not counts
SCANS = 'scan'  # as a reference: the laser, by matching its scans


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
    trial: Optional[Trial]
    notes: List[str]  # on unreadable, unusable and repeated data, one line each


def read_recorded(
    options: SourceOptions, path: Path, is_table: bool, reference_csv: Optional[Path] = None
) -> RecordedDrive:
    """Read one drive with its reference, for estimators; call `wheel_options.check_wheel_options` before.

    Angles [rad] are positive forward, of counts to half a count. Stamps of both increase strictly: other rows are left
    out and counted in the notes. `reference_csv` has the columns of the reference; None: the drive's own file has them.
    ConfigError if the file cannot be read, or has too few samples or no reference at their stamps.
    """
    is_scan = options.reference == SCANS
    of_poses = replace(options, reference='') if is_scan else options
    source, trial, robot, wheels, poses = open_drive(of_poses, path, is_table, reference_csv)
    if poses is None and not is_scan:
        of_bag, of_table = '--reference TOPIC|FRAMES|scan, or --reference-csv', '--reference-columns TIME X Y [YAW]'
        raise ConfigError(f'{path}: no reference; expected {of_table if is_table else of_bag}')
    read = read_drive(source, wheels, None if is_scan else poses)
    drives = forward_drives(read, wheels, robot)
    if is_scan and drives:
        read = read._replace(references=[_poses_of_laser(source, robot, drives[0])])
    fault = overlap_fault(read)
    if fault:
        raise ConfigError(f'{path}: {fault}')
    notes = [*read.notes, *([source.fault] if source.fault else [])]
    return RecordedDrive(path, list(zip(drives, read.references)), wheels.ppr, robot, trial, notes)


def forward_drives(read: ReadDrive, wheels: WheelSource, robot: RecordedRobot) -> List[Drive]:
    """Return the parts of a drive with angles that are positive forward."""
    joints = [wheels.are_joint_angles and flag for flag in (robot.encoder.left_reversed, robot.encoder.right_reversed)]
    forward = np.where(joints, -1.0, 1.0)
    return [replace(each.drive, wheel_angles_rad=each.drive.wheel_angles_rad * forward) for each in read.drives]


def recorded_encoder(opened: OpenedDrive, coarser: float = 1.0) -> Encoder:
    """Return an ideal encoder with the recorded counts or angles, or a coarser one."""
    recorded, of_robot = opened.wheels.ppr or PerWheel(left=RECORDED_PPR, right=RECORDED_PPR), opened.robot.encoder
    ppr = PerWheel(left=recorded.left / coarser, right=recorded.right / coarser)
    ideal = {'ppr': ppr, 'counter_modulus': 0, 'encoder': IDEAL_ENCODER}
    odometry = opened.robot.odometry.model_copy(update=ideal)
    params = of_robot.model_copy(update={**ideal, 'report': PROMPT, 'velocity_method': 'M'})
    return Encoder(ChosenEncoder(ppr), params, odometry)


def _poses_of_laser(source: DriveStream, robot: RecordedRobot, drive: Drive) -> Reference:
    """Return the poses of the laser by its scans, and by the wheels as the start of the search."""
    odometry = robot.odometry
    if robot.is_guessed():
        raise ConfigError(f'{source.path}: --reference {SCANS} needs the nominal geometry of the wheels: give --robot')
    geometry = *odometry.wheel_diameter.radii_m, odometry.wheel_separation, odometry.axle_x
    poses = poses_of_wheels(drive.wheel_angles_rad[np.newaxis], *geometry, False)[0]
    laser_pose_in_base = read_laser_pose(source, odometry.base_frame)
    return scan_reference(read_scans(source), PoseSeries(drive.stamps_ns, poses), laser_pose_in_base)
