"""What a recorded drive's odometry would have been with another encoder: reading, computing, bags and tables."""

from __future__ import annotations

import csv
import io
import itertools
import math
from array import array
from collections import defaultdict, deque
from typing import Any, DefaultDict, Dict, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from tabulate import tabulate

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.base.se2 import Pose2D, PoseSeries
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives import message_encoders as encoders
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.comparison import ERROR_NAMES, Comparison, DrawnPaths, Errors, Spread, drawn_paths
from diff_encoder_sim.drives.drive_stream import DriveStream, Message
from diff_encoder_sim.drives.message_decoders import decode_command, decode_imu
from diff_encoder_sim.drives.recorded_poses import RecordedPoses
from diff_encoder_sim.drives.reference import Reference, read_reference
from diff_encoder_sim.drives.trajectory_error import RPE_DISTANCES_M, RpePairs, rpe_name
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.drives.trial_definition import Trial, with_encoder
from diff_encoder_sim.drives.typestore import to_ros1
from diff_encoder_sim.drives.wheel_source import TimedDrive, WheelSource
from diff_encoder_sim.localization.fused_odometry import FusedOdometry, ImuReading
from diff_encoder_sim.localization.fusion import FusionParams
from diff_encoder_sim.wheels.catalogue import ChosenEncoder
from diff_encoder_sim.wheels.chain import Chain, ChainRun
from diff_encoder_sim.wheels.odometry import OdometryEstimate, wheel_speeds_mps
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import EncoderSample
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

# The truth, and how a trial ended: copied as they are, with the node that published them.
COPIED = {topics.WORLD_POSE: topics.WORLD_POSE_NODE, topics.TRIAL_RESULT: topics.NAVIGATION_TRIAL_NODE}

FUSED_RATE_HZ = 1000.0  # each report
MOST_FUSED_DRAWS = 20
FEW_REPORTS = 5000  # importing numba takes as long as the odometry of this many reports without it


def copied_topics(source: DriveStream) -> List[str]:
    """List the topics of `COPIED` that a bag has with a trial's types."""
    return [topic for topic in COPIED if source.topics.get(topic) == topics.recorded_topics('full')[topic].message_type]


def has_commands(source: DriveStream) -> bool:
    """Return whether a drive has commands, by which encoders without direction count."""
    return source.topics.get(topics.CMD_VEL) == topics.TWIST_TYPE


class ReadDrive(NamedTuple):
    """Contents of a recorded drive."""

    drives: List[TimedDrive]  # several if the stamps go back
    references: List[Reference]  # likewise
    commands: List[Tuple[int, float, float]]  # time of recording [ns], linear [m/s], angular [rad/s]
    copies: List[Message]  # in ROS 1's encoding
    messages: int  # of the wheels
    duration_s: float  # between the first and the last of them, by the recorder's clock
    notes: List[str]  # unusable messages, one line each
    imu: List[Tuple[int, ImuReading]]  # with times of recording [ns]


def read_drive(
    source: DriveStream,
    wheels: WheelSource,
    reference: Optional[RecordedPoses],
    copied: Sequence[str] = (),
    imu_topic: str = '',
) -> ReadDrive:
    """Read wheels, poses, an IMU and topics to copy, of ROS's own types; ConfigError if a wrap or topic is unknown."""
    if imu_topic and source.topics.get(imu_topic) != topics.IMU_TYPE:
        raise ConfigError(f'--imu-topic: {imu_topic} is not in {source.path}; allowed: a topic of sensor_msgs/Imu')
    imu: List[Tuple[int, ImuReading]] = []
    reference_topics = reference.topics if reference else ()
    commanded = (topics.CMD_VEL,) if has_commands(source) else ()
    commands: List[Tuple[int, float, float]] = []
    copies: List[Message] = []
    times_ns = array('q')  # of the wheels' messages
    faults: DefaultDict[str, List[str]] = defaultdict(list)  # by topic
    for message in source.messages({*wheels.topics, *reference_topics, *commanded, *copied, imu_topic}):
        topic = message.topic
        try:
            if topic in wheels.topics:
                times_ns.append(message.time_ns)
                wheels.add(message)
            if reference and topic in reference_topics:
                reference.add(message)
            if topic in commanded:
                commands.append((message.time_ns, *decode_command(message.raw, source.is_cdr)))
            if topic == imu_topic:
                imu.append((message.time_ns, decode_imu(message.raw, source.is_cdr)))
            if topic in copied:
                raw = to_ros1(message.raw, source.topics[topic]) if source.is_cdr else message.raw
                copies.append(message._replace(raw=raw))
        except InputFault as fault:
            faults[topic].append(str(fault))
    drives = wheels.drives()
    if wheels.wrap_fault:
        raise ConfigError(f'{source.path}: {wheels.wrap_fault}')
    references, notes = read_reference(reference) if reference else ([], [])
    notes = [*notes, *wheels.notes()]
    notes += [f'{topic}: {len(lost)} messages dropped; the first: {lost[0]}' for topic, lost in faults.items()]
    turned_rad = sum((np.ptp(each.drive.wheel_angles_rad, axis=0) for each in drives if len(each.drive)), np.zeros(2))
    if turned_rad.any() and not turned_rad.all():
        notes.append(f'the {"left" if turned_rad[1] else "right"} wheel never turns')
    starts_s = [f'{each.drive.stamps_ns[0] / NANOSECONDS_PER_SECOND:.3f} s' for each in drives if len(each.drive)]
    used = len(times_ns) - sum(len(faults[topic]) for topic in wheels.topics)
    if sum(len(each.drive) for each in drives) == 1 and used > 1:
        expected = 'expected header.stamp to be the time of each sample'
        notes.append(f'stamps do not advance: {starts_s[0]} in {used} messages; {expected}')
    if len(drives) > 1:
        times = f'{len(drives) - 1} times, to {", ".join(starts_s[1:4])}'
        notes.append(f'joint stamps went back {times}: encoders and odometry restarted')
    duration_s = (max(times_ns, default=0) - min(times_ns, default=0)) / NANOSECONDS_PER_SECOND
    return ReadDrive(drives, references, commands, copies, len(times_ns), duration_s, notes, imu)


def overlap_fault(read: ReadDrive) -> str:
    """Return why no part of a drive can be compared with a reference; empty if one can."""
    fault = f'no drive with a reference in {read.messages} messages of the wheels; expected two samples or more'
    for timed, reference in zip(read.drives, read.references):
        if len(timed.drive) > 1 and len(reference.stamps_ns):
            begins_s, ends_s = np.array([timed.drive.stamps_ns[[0, -1]], reference.stamps_ns[[0, -1]]]).T * 1e-9
            if begins_s.max() < ends_s.min():
                return ''
            of_wheels, of_reference = (f'{begin:.3f} to {end:.3f} s' for begin, end in zip(begins_s, ends_s))
            fault = f'{reference.name} is at {of_reference}, the wheels at {of_wheels}; expected stamps of one clock'
    return fault


class Encoder(NamedTuple):
    """An encoder, and the odometry that its counts are for."""

    chosen: ChosenEncoder
    params: EncoderParams
    odometry: OdometryParams
    imu: Optional[ImuParams] = None  # with which odometry is fused

    @property
    def label(self) -> str:
        """Return the name in tables."""
        return f'{self.chosen.label} fused' if self.imu else self.chosen.label

    def fused(self, read: ReadDrive, times_ns: List[int], run: ChainRun) -> List[Tuple[int, OdometryEstimate]]:
        """Return the fused odometry of reports with times of recording, with the times at which it is due."""
        if self.imu is None or not times_ns:
            return []
        params = FusionParams(frequency=FUSED_RATE_HZ, base_link_frame=self.odometry.base_frame)
        fusion = FusedOdometry(params, self.odometry, self.imu)
        within = ((time_ns, each) for time_ns, each in read.imu if times_ns[0] <= time_ns <= times_ns[-1])
        return list(fusion.run(within, zip(times_ns, (sample[:3] for sample in run.samples()))))


class EncodedDrive(NamedTuple):
    """A recorded drive as an encoder would have measured it."""

    encoder: Encoder
    reports: int
    paths: List[PoseSeries]  # base in odom, for each drive, of the first draw
    errors: Optional[Errors]  # None if nothing is to be compared, or without common stamps


def encode_drive(
    read: ReadDrive,
    encoder: Encoder,
    comparison: Optional[Comparison] = None,
    phases_rad: Optional[np.ndarray] = None,
    trial: Optional[Trial] = None,
    bag: Optional[TrialBag] = None,
) -> EncodedDrive:
    """Compute the messages of the nodes with an encoder; OSError if they cannot be written into the bag.

    `phases_rad` (draws, 2) are added to the angles of each draw. The bag gets each message of the first draw at the
    time of the message that led to it, and the recorded trial as if it had been driven with the encoder.
    """
    if encoder.imu is not None and phases_rad is not None:
        phases_rad = phases_rad[:MOST_FUSED_DRAWS]
    chain, draws = Chain(encoder.params, encoder.odometry), 1 if phases_rad is None else len(phases_rad)
    paths: List[PoseSeries] = []
    drawn, reports, copies = [], 0, deque(read.copies)
    separation_m, speeds_mps = encoder.odometry.wheel_separation, [(0.0, 0.0)]  # of both wheels before any command
    speeds_mps += [wheel_speeds_mps(linear, angular, separation_m) for _, linear, angular in read.commands]
    for timed in read.drives:
        commands = None
        if read.commands and encoder.params.encoder.counts_by_command:
            newest = np.searchsorted([command_ns for command_ns, *_ in read.commands], timed.times_ns, 'right')
            commands = np.array(speeds_mps)[newest]
        run = chain.run(timed.drive, None if phases_rad is None else phases_rad[:1], commands)
        reports += len(run.rows[0])
        times_ns = timed.times_ns[run.rows[0]].tolist()
        fused = encoder.fused(read, times_ns, run)
        if phases_rad is not None and draws > 1 and encoder.imu is None:
            drawn.append(drawn_paths(encoder.params, encoder.odometry, timed.drive, phases_rad, commands, run.rows[0]))
        elif phases_rad is not None and draws > 1:
            runs = (chain.run(timed.drive, phase_rad[None], commands) for phase_rad in phases_rad)
            paths_of_draws = (_path([each for _, each in encoder.fused(read, times_ns, one)]) for one in runs)
            drawn.append(DrawnPaths(draw, path[0], path[1][None]) for draw, path in enumerate(paths_of_draws))
        if not bag and not fused and len(run.rows[0]) > FEW_REPORTS:
            stamps_ns, poses = run.stamps_ns[0], run.poses[0]
            is_new = np.diff(np.maximum.accumulate(stamps_ns), prepend=-1) > 0  # odometry ignores the others
            paths.append(PoseSeries(stamps_ns[is_new], poses[is_new]))
            continue
        estimates = run.estimates()
        paths.append(_path([each for _, each in fused] or [each for each in estimates if each is not None]))
        if bag:
            due = deque(fused)
            for time_ns, sample, estimate in zip(times_ns, run.samples(), estimates):
                while copies and copies[0].time_ns < time_ns:
                    _copy(bag, copies.popleft(), encoder, trial)
                _report(bag, time_ns, sample, estimate, encoder)
                while due and due[0][0] <= time_ns:
                    _publish(bag, time_ns, due.popleft()[1], encoder, True)
    if bag:
        for message in copies:
            _copy(bag, message, encoder, trial)
    return EncodedDrive(encoder, reports, paths, comparison.errors(paths, draws, drawn) if comparison else None)


def _path(estimates: Sequence[OdometryEstimate]) -> PoseSeries:
    poses = np.array([each.base_pose_in_odom for each in estimates]).reshape(-1, 3)
    return PoseSeries(np.array([each.stamp_ns for each in estimates], np.int64), poses)


def _report(
    bag: TrialBag, time_ns: int, sample: EncoderSample, estimate: Optional[OdometryEstimate], encoder: Encoder
) -> None:
    """Write /encoder_pulse, /encoder_velocity if speeds are measured, /odom and /tf."""
    joints = encoder.params.left_joint, encoder.params.right_joint
    if sample.wheel_rates_radps is not None:
        speeds = sample.stamp_ns, sample.wheel_rates_radps, joints
        bag.publish(topics.ENCODER_VELOCITY, topics.ENCODER_NODE, time_ns, encoders.encode_wheel_speeds, *speeds)
    bag.publish(topics.ENCODER_PULSE, topics.ENCODER_NODE, time_ns, encoders.encode_encoder_pulse, sample, joints)
    if estimate is not None:
        _publish(bag, time_ns, estimate, encoder, False)


def _publish(bag: TrialBag, time_ns: int, estimate: OdometryEstimate, encoder: Encoder, is_fused: bool) -> None:
    """Write /odom or /odometry/filtered, of which the latter is on /tf if there is an IMU."""
    frames = encoder.odometry.odom_frame, encoder.odometry.base_frame
    topic, node = (topics.FILTERED, topics.FUSION_NODE) if is_fused else (topics.ODOM, topics.ODOM_NODE)
    if encoder.odometry.publish_tf and is_fused == (encoder.imu is not None):
        transform = estimate.base_pose_in_odom, estimate.stamp_ns, *frames
        bag.publish(topics.TF, node, time_ns, encoders.encode_planar_tf, *transform)
    bag.publish(topic, node, time_ns, encoders.encode_odometry, estimate, *frames)


def _copy(bag: TrialBag, message: Message, encoder: Encoder, trial: Optional[Trial]) -> None:
    """Write a message of `COPIED`, or the trial with the encoder."""
    if message.topic != topics.TRIAL:
        bag.publish(message.topic, COPIED[message.topic], message.time_ns, bytes, message.raw)
    elif trial is not None:
        fusion = {'fusion': 'none' if encoder.imu is None else 'embedded'}
        driven = with_encoder(trial, encoder.params, encoder.odometry, encoder.chosen.name)
        text = driven.model_copy(update=fusion).model_dump_json()
        bag.publish(topics.TRIAL, topics.NAVIGATION_TRIAL_NODE, message.time_ns, encoders.encode_string, text)


Value = Union[str, int, float, None]


def error_rows(encoded: Sequence[EncodedDrive]) -> List[Dict[str, Value]]:
    """Return the errors by name with unit, in SI units, of the first draw except median, p5 and p95; None: missing."""
    rows = []
    for one in encoded:
        error = one.errors and one.errors.first
        row: Dict[str, Value] = {'ppr': one.encoder.label, 'reports': one.reports}
        row['common_stamps'] = error and error.poses
        for name in ('ate_rmse_m', 'ate_max_m', 'yaw_rmse_rad'):
            row[name] = error and getattr(error, name)
        for name in Pose2D._fields:
            row[f'end_{name}'] = error and getattr(error.end, name)
        row['reference_length_m'] = error and error.length_m
        for distance_m in RPE_DISTANCES_M:
            for pairs in RpePairs:
                name, relative = rpe_name(pairs, distance_m), error and error.rpe[pairs][distance_m]
                known = relative if relative and relative.segments else None
                row[f'{name}_position_rmse_m'] = known and known.translation_rmse_m
                row[f'{name}_yaw_rmse_rad'] = known and known.rotation_rmse_rad
                row[f'{name}_segments'] = relative and relative.segments
        for name in ERROR_NAMES:
            for quantile in Spread._fields:
                row[spread_column(name, quantile)] = one.errors and getattr(one.errors.spreads[name], quantile)
        unknown = [key for key, value in row.items() if isinstance(value, float) and math.isnan(value)]
        rows.append({**row, **dict.fromkeys(unknown)})
    return rows


def spread_column(name: str, quantile: str) -> str:
    """Return the column of a quantile: ate_p95_m of ate_m."""
    stem, _, unit = name.rpartition('_')
    return f'{stem}_{quantile}_{unit}'


def errors_json(encoded: Sequence[EncodedDrive]) -> List[Dict[str, Any]]:
    """Return the encoders with the spreads of their errors in SI units, for JSON; None for a missing value."""
    return [
        {
            'label': one.encoder.label,
            'ppr': one.encoder.chosen.ppr.plain,
            **{name: {each: row[spread_column(name, each)] for each in Spread._fields} for name in ERROR_NAMES},
        }
        for one, row in zip(encoded, error_rows(encoded))
    ]


def csv_table(rows: Sequence[Dict[str, Value]]) -> str:
    """Format `error_rows` at full precision; cells without a value are empty."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator='\n')
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


# Columns of `error_rows` in the tables for the terminal, with their heads.
_PATH_HEADS = {
    'ppr': 'counts',
    'reports': 'reports',
    'common_stamps': 'common\nstamps',
    'ate_rmse_m': 'ATE\n[m]',
    'ate_max_m': 'max\n[m]',
    'yaw_rmse_rad': 'yaw\n[deg]',
    'end_x_m': 'end x\n[m]',
    'end_y_m': 'end y\n[m]',
    'end_yaw_rad': 'end yaw\n[deg]',
}
_RPE_HEADS = {'segments': '{}\nsegments', 'position_rmse_m': 'RPE\n[m]', 'yaw_rmse_rad': 'RPE\n[deg]'}
_SPREAD_HEADS = {'ate_m': 'ATE [m]', 'end_position_m': 'end position [m]', 'end_yaw_rad': 'end yaw [deg]'}


Table = Tuple[List[List[str]], List[str]]  # cells and heads


def text_table(rows: Sequence[Dict[str, Value]], draws: int = 1) -> str:
    """Format `error_cells` for the terminal."""
    tables = error_cells(rows, draws)
    texts = [tabulate(each, heads, disable_numparse=True, colalign=['right'] * len(heads)) for each, heads in tables]
    return '\n\n'.join(texts)


def error_cells(rows: Sequence[Dict[str, Value]], draws: int = 1) -> List[Table]:
    """Return tables of `error_rows`: a row for each encoder, and, of one draw, for each length of RPE's segments."""
    if draws > 1:
        return [_spread_cells(rows)]
    paths = [[_cell(column, row[column]) for column in _PATH_HEADS] for row in rows]
    rpe_heads = ['counts', 'segment\nlength']
    rpe_heads += [head.format(pairs.text) for pairs in RpePairs for head in _RPE_HEADS.values()]
    relative = []
    for row, distance_m in itertools.product([row for row in rows if row['end_yaw_rad'] is not None], RPE_DISTANCES_M):
        columns = [f'{rpe_name(pairs, distance_m)}_{column}' for pairs in RpePairs for column in _RPE_HEADS]
        relative.append([str(row['ppr']), f'{distance_m:g} m', *(_cell(column, row[column]) for column in columns)])
    return [each for each in ((paths, list(_PATH_HEADS.values())), (relative, rpe_heads)) if each[0]]


def _spread_cells(rows: Sequence[Dict[str, Value]]) -> Table:
    heads = [*list(_PATH_HEADS.values())[:3]]
    heads += [text for head in _SPREAD_HEADS.values() for text in (f'{head}\nmedian', '\n5 to 95 %')]
    lines = []
    for row in rows:
        line = [_cell(column, row[column]) for column in list(_PATH_HEADS)[:3]]
        for name in _SPREAD_HEADS:
            columns = (spread_column(name, quantile) for quantile in Spread._fields)
            median, low, high = (_cell(column, row[column]) for column in columns)
            line += [median, '-' if median == '-' else f'{low} to {high}']
        lines.append(line)
    return lines, heads


def _cell(column: str, value: Value) -> str:
    if value is None or isinstance(value, str):
        return value or '-'
    if column.endswith('_rad'):
        return f'{math.degrees(value):.3f}'
    return f'{value:.4f}' if column.endswith('_m') else str(value)
