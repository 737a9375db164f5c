"""Re-encode recorded drives: odometry of the same drive with other encoders."""

from __future__ import annotations

import contextlib
import json
import logging
import math
import os
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence, Union

import numpy as np

from diff_encoder_sim.api import wheel_options
from diff_encoder_sim.api.drive_pages import write_drive_page
from diff_encoder_sim.api.options import DriveOptions
from diff_encoder_sim.api.recorded_sources import OpenedDrive, open_drive, recorded_encoder
from diff_encoder_sim.api.wheel_options import RecordedRobot, parameters_with
from diff_encoder_sim.base.atomic_files import write_file
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.imu import ImuParams, load_imu
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.se2 import Pose2D, PoseSeries
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.drives import reencoding as encoding
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.comparison import Comparison, SensorPlace, Spread, of_reference
from diff_encoder_sim.drives.drive_stream import DriveStream
from diff_encoder_sim.drives.joint_wheels import PulseWheels
from diff_encoder_sim.drives.recorded_poses import find_poses
from diff_encoder_sim.drives.reencoding import EncodedDrive, Encoder, ReadDrive
from diff_encoder_sim.drives.topics import CMD_VEL, TRIAL
from diff_encoder_sim.drives.trajectory_error import Alignment, PathError
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.drives.wheel_source import WheelSource
from diff_encoder_sim.wheels.catalogue import ChosenEncoder, encoder_lines
from diff_encoder_sim.wheels.diagnostics import encoder_lateral_std, hidden_encoder
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER, file_label, ppr_label
from diff_encoder_sim.wheels.report_link import PROMPT

log = logging.getLogger(__name__)

CSV_NAME, PAGE = 'reencode.csv', 'drive.html'
_PATHS = ('csv', 'out', 'config', 'json', 'page')
DRAWS = 200  # of start angles, if these are unknown
ALIGNED = {
    Alignment.ORIGIN: 'aligned at the first common stamp, no fit',
    Alignment.FIT: 'rotated and moved onto the reference by least squares, as this has no yaw',
}
LEGEND = """\
Odometry minus reference, {}. ATE, max:
distance over the whole path, root mean square and largest. yaw: root mean square. end: along (x)
and across (y) the start heading. RPE: error of the motion over segments of the reference's path,
root mean square over the given number of segments (consecutive: end to end; all pairs: one from
each pose). evo gives the same numbers: docs/recorded_drives.md."""
LEGEND_OF_DRAWS = """\
Odometry minus reference, {}. ATE: distance
over the whole path, root mean square. end: distance and heading error of the last pose."""


class ReencodedDrive(NamedTuple):
    """Recorded drive with one encoder."""

    ppr: str  # label of the encoder
    odometry: PoseSeries  # base in odom
    error: Optional[PathError]  # against the reference, of the first draw; None if no stamps are common
    spreads: Dict[str, Spread]  # of ate_m, end_position_m and end_yaw_rad over all draws; {} if no stamps are common


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
    paths: Dict[str, Any] = {key: Path(options[key]) for key in _PATHS if options.get(key) is not None}
    paths['reference_csv'] = [Path(each) for each in options.get('reference_csv', ())]
    done = reencoding(DriveOptions(**{**options, **paths, 'bag': None if bag is None else Path(bag)}))
    for note in done.notes:
        log.warning('%s', note)
    return done.drives


def reencoding(options: DriveOptions, command: str = 'reencode') -> Reencoding:
    """Compute a recorded drive with each encoder for a `command`; errors as in `reencode`."""
    begin_s = time.perf_counter()
    wheel_options.check_wheel_options(options, options.bag, options.csv)
    path, table = options.csv or options.bag or Path(), next(iter(options.reference_csv), None)
    has_encoders = bool(options.ppr or options.encoder)
    opened = open_drive(options, path, bool(options.csv), table, options.seed, has_encoders)
    source, trial, robot, wheels, poses = opened
    phases_rad = _start_phases(options, opened)
    robot = _with_joints(options, wheels, robot)
    opened = opened._replace(robot=robot)
    chosen, imus = wheel_options.chosen_encoders(options, robot.encoder), _imus(options)
    files = output_files(options.out, path, chosen)
    encoders = [
        Encoder(each, *parameters_with(each, robot.encoder, robot.odometry), imu) for each in chosen for imu in imus
    ]
    copied = [*encoding.copied_topics(source), *([TRIAL] if trial else [])] if files else []
    read = encoding.read_drive(source, wheels, poses, copied, options.imu_topic if imus[1:] else '')
    read_s = time.perf_counter() - begin_s
    comparison = _comparison(options, read, opened)
    why = f'{"; ".join(read.notes[-1:]) or source.fault or "too short"}; expected two reports of the encoder'
    encode = partial(encoding.encode_drive, read, comparison=comparison, phases_rad=phases_rad, trial=trial)
    workers, draws = (1, 1) if phases_rad is None else (os.cpu_count() or 1, len(phases_rad))
    encoded = _encoded(encode, encoders, files, workers, f'{path}: no drive in {read.messages} {wheels.text}: {why}')
    notes = [*read.notes, *_notes(source, robot, encoders, bool(files))]
    if poses and not any(one.errors for one in encoded):
        notes.append(f'no errors computed: {encoding.overlap_fault(read) or "no poses at the stamps of odometry"}')
    if files and draws > 1:
        notes.append(f'the bags contain the first of {draws} draws')
    rows = encoding.error_rows(encoded)
    about = {'source': str(path), 'reference': comparison.name, 'draws': draws, 'seed': robot.encoder.seed}
    about.update({'repeated_rows': wheels.repeated, 'encoders': encoding.errors_json(encoded)})
    page, cells = options.page or files.get(PAGE), encoding.error_cells(rows, draws)
    try:
        if files:
            with open(files[CSV_NAME], 'x', encoding='utf-8') as file:
                file.write(encoding.csv_table(rows))
        conclusion = write_drive_page(page, command, read, opened, comparison, encoded, cells) if page else []
        if options.json:
            write_file(options.json, json.dumps(about, indent=1, allow_nan=False).encode('utf-8'))
    except OSError as error:
        raise ConfigError(f'{error.filename}: {error.strerror}') from None
    compared = ' '.join(filter(None, [comparison.name, comparison.place.text()]))
    counted = f'{read.messages} {wheels.text} in {read.duration_s:.1f} s, read in {read_s:.1f} s; compared with'
    lines, recorded = [f'{path}: {counted} {compared}', robot.text()], wheels.ppr
    is_finer = [recorded and (each.ppr.left > recorded.left or each.ppr.right > recorded.right) for each in chosen]
    if recorded and any(is_finer):
        limited = ', '.join(each.label for each, is_one in zip(chosen, is_finer) if is_one)
        lines.append(f'recorded with {ppr_label(recorded)} counts: {limited} limited by the recorded resolution')
    if phases_rad is not None:
        lines.append(f'start angles of the wheels: {draws} sampled by --seed {robot.encoder.seed}')
    drives = [
        ReencodedDrive(
            one.encoder.label, PoseSeries(*map(np.concatenate, zip(*one.paths))), *(one.errors or (None, {}))[:2]
        )
        for one in encoded
    ]
    legend = (LEGEND if draws == 1 else LEGEND_OF_DRAWS).format(ALIGNED[comparison.alignment])
    return Reencoding(
        drives,
        [*encoder_lines(chosen, robot.odometry.wheel_diameter), *(f'{path}: {note}' for note in notes)],
        '\n'.join([*lines, '', encoding.text_table(rows, draws), '', legend, *conclusion]),
        [*files.values(), *filter(None, [options.page, options.json])],
    )


def _imus(options: DriveOptions) -> List[Optional[ImuParams]]:
    """Return none, for odometry of wheels only, and with fusion the IMU."""
    if options.fusion == 'none':
        if options.imu:
            raise ConfigError(f'--imu: given {options.imu} without fusion; allowed: with --fusion embedded')
        return [None]
    if not options.imu:
        raise ConfigError(f'--fusion: given {options.fusion} without an IMU; allowed: with --imu, such as mpu6050')
    return [None, load_imu(options.imu, package_folder() / 'config', Path()).imu]


def _start_phases(options: DriveOptions, opened: OpenedDrive) -> Optional[np.ndarray]:
    """Sample start angles (draws, 2), as equal ones would cancel errors on straights; None if they are recorded."""
    encoder, wheels = opened.robot.encoder, opened.wheels
    is_known = wheels.is_start_known or (opened.trial is not None and isinstance(wheels, PulseWheels))
    draws = (0 if is_known else DRAWS) if options.draws is None else options.draws
    if draws:
        return generator(encoder.seed, 'start_angles').uniform(0.0, 2.0 * math.pi, (draws, 2))
    has_errors = options.encoder or (encoder.encoder, encoder.report) != (IDEAL_ENCODER, PROMPT)
    if options.seed is not None and not has_errors:
        allowed = 'with --draws, with --encoder, or with errors of an encoder in --config or --robot'
        raise ConfigError(f'--seed: given {options.seed}, but nothing is random; allowed: {allowed}')
    return None


def _comparison(options: DriveOptions, read: ReadDrive, opened: OpenedDrive) -> Comparison:
    """Return the reference or, without one, the recorded wheels at their own resolution."""
    if opened.poses:
        place, calibration = SensorPlace(), opened.robot.file.calibration
        if calibration:
            yaw = calibration.reference_yaw_rad
            pose = calibration.reference_x_m.value, calibration.reference_y_m.value, yaw.value if yaw else 0.0
            place = SensorPlace(Pose2D(*pose), calibration.reference_delay_s.value)
        if options.reference_pose:
            place = place._replace(pose=Pose2D(*options.reference_pose))
        if options.reference_delay is not None:
            place = place._replace(delay_s=options.reference_delay)
        return of_reference(read.references, place, bool(options.reference_columns))
    if options.reference_pose or options.reference_delay is not None:
        raise ConfigError('--reference-pose, --reference-delay: given without a reference; expected one')
    name = 'the recorded counts' if opened.wheels.ppr else 'the recorded wheel angles'
    return Comparison(name, encoding.encode_drive(read, recorded_encoder(opened)).paths)


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
    files.update({name: folder / name for name in (CSV_NAME, PAGE)})
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
    encode: Callable[..., EncodedDrive], encoders: Sequence[Encoder], files: Dict[str, Path], workers: int, fault: str
) -> List[EncodedDrive]:
    """Compute the drive with each encoder, and write its bag if there are files; `fault`: error without a drive."""
    try:
        with contextlib.ExitStack() as bags:  # removes the bags after an error
            if files:
                # One for each encoder: that of fusion has the odometry of the wheels, too.
                recorded = [each for each in encoders if each.imu or not encoders[-1].imu]
                written = {
                    each.label: bags.enter_context(TrialBag(files[each.chosen.label], 'full')) for each in recorded
                }
                encoded = [encode(encoder, bag=written.get(encoder.label)) for encoder in encoders]
            else:
                pool = bags.enter_context(ThreadPoolExecutor(workers))
                encoded = list(pool.map(encode, encoders))  # the kernels of draws release the interpreter
            if not any(one.reports > 1 for one in encoded):
                raise ConfigError(fault)
    except OSError as error:
        raise ConfigError(f'{error.filename or "--out"}: {error.strerror}') from None
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
