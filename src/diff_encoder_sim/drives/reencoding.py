"""What a recorded drive's odometry would have been with another encoder: reading, computing, bags and tables."""

from __future__ import annotations

import csv
import io
import math
from array import array
from collections import Counter, deque
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence, Union

import numpy as np
from tabulate import tabulate

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import PoseSeries
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.csv_wheels import DriveStream
from diff_encoder_sim.drives.pose_messages import encode_odometry, encode_planar_tf
from diff_encoder_sim.drives.reference import Reference
from diff_encoder_sim.drives.ros1_stream import Message
from diff_encoder_sim.drives.sensor_messages import (
    decode_command,
    encode_encoder_pulse,
    encode_string,
    encode_wheel_speeds,
)
from diff_encoder_sim.drives.trajectory_error import (
    RPE_DISTANCES_M,
    Alignment,
    PathError,
    RpePairs,
    common_poses,
    pairs_error,
    rpe_name,
)
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.drives.trial_definition import Trial, with_encoder
from diff_encoder_sim.drives.typestore import to_ros1
from diff_encoder_sim.drives.wheel_source import TimedDrive, WheelSource, ascending_runs
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.encoder_params import PerWheel, encoder_label
from diff_encoder_sim.wheels.odometry import OdometryEstimate, wheel_speeds_mps
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import EncoderSample
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

# The truth, and how a trial ended: copied as they are, with the node that published them.
COPIED = {topics.WORLD_POSE: topics.WORLD_POSE_NODE, topics.TRIAL_RESULT: topics.NAVIGATION_TRIAL_NODE}

# Importing numba takes as long as the odometry of this many reports without it.
FEW_REPORTS = 5000

# A reference pose that is older than the newest by no more than this was overtaken by another message: it is dropped.
OVERTAKEN_NS = NANOSECONDS_PER_SECOND


def copied_topics(source: DriveStream) -> List[str]:
    """List the topics of `COPIED` that a bag has with a trial's types."""
    known = topics.recorded_topics('full')
    return [topic for topic in COPIED if source.topics.get(topic) == known[topic].message_type]


def has_commands(source: DriveStream) -> bool:
    """Return whether a drive has the commands that encoders may count by."""
    return source.topics.get(topics.CMD_VEL) == topics.TWIST_TYPE


class RecordedCommand(NamedTuple):
    """A commanded twist, by the recorder's clock."""

    time_ns: int
    linear_mps: float
    angular_radps: float


class ReadDrive(NamedTuple):
    """What was read of a recorded drive."""

    drives: List[TimedDrive]  # several if the stamps go back
    references: List[PoseSeries]  # likewise
    commands: List[RecordedCommand]
    copies: List[Message]  # in ROS 1's encoding
    messages: int  # of the wheels
    duration_s: float  # between the first and the last of them, by the recorder's clock
    notes: List[str]  # what could not be used, one line each


def read_drive(
    source: DriveStream, wheels: WheelSource, reference: Optional[Reference], copied: Sequence[str] = ()
) -> ReadDrive:
    """Read a drive to its end: a bag is streamed, of the drive itself some numbers of each sample are kept.

    Args:
        source: the drive.
        wheels: takes the messages of the wheels.
        reference: takes those of the poses to compare with; None if there are none.
        copied: topics whose messages are kept, of types of ROS's own.
    """
    reference_topics = reference.topics if reference else ()
    commanded = (topics.CMD_VEL,) if has_commands(source) else ()
    pose_stamps_ns, poses = array('q'), array('d')
    commands, copies = [], []  # type: List[RecordedCommand], List[Message]
    count, first_ns, last_ns = 0, 0, 0
    dropped, first_faults = Counter(), {}  # type: Counter[str], Dict[str, str]
    for message in source.messages({*wheels.topics, *reference_topics, *commanded, *copied}):
        topic = message.topic
        try:
            if topic in wheels.topics:
                first_ns = min(first_ns, message.time_ns) if count else message.time_ns
                last_ns = max(last_ns, message.time_ns)
                count += 1
                wheels.add(message)
            if reference and topic in reference_topics:
                for stamped in reference.poses(message):
                    pose_stamps_ns.append(stamped.stamp_ns)
                    poses.extend(stamped.pose)
            if topic in commanded:
                commands.append(RecordedCommand(message.time_ns, *decode_command(message.raw, source.is_cdr)))
            if topic in copied:
                raw = to_ros1(message.raw, source.topics[topic]) if source.is_cdr else message.raw
                copies.append(message._replace(raw=raw))
        except InputFault as fault:
            dropped[topic] += 1
            first_faults.setdefault(topic, str(fault))
    drives = wheels.drives()
    stamps_ns, x_y_yaw = np.array(pose_stamps_ns), np.array(poses).reshape(-1, 3)
    references = [PoseSeries(stamps_ns[rows], x_y_yaw[rows]) for rows in ascending_runs(stamps_ns, OVERTAKEN_NS)]
    notes = [
        *wheels.notes(),
        *(f'{topic}: {lost} messages dropped; the first: {first_faults[topic]}' for topic, lost in dropped.items()),
        *_notes_on_stamps(drives, count - sum(dropped[topic] for topic in wheels.topics)),
    ]
    return ReadDrive(drives, references, commands, copies, count, (last_ns - first_ns) / NANOSECONDS_PER_SECOND, notes)


def _notes_on_stamps(drives: Sequence[TimedDrive], messages: int) -> Iterator[str]:
    samples = sum(len(each.drive) for each in drives)
    if samples == 1 and messages > 1:
        stamp_s = drives[0].drive.stamps_ns[0] / NANOSECONDS_PER_SECOND
        yield (
            f'stamps do not advance: {stamp_s:.3f} s in {messages} messages; expected header.stamp to be the time of '
            f'each sample'
        )
    if len(drives) > 1:
        back_s = ', '.join(f'{each.drive.stamps_ns[0] / NANOSECONDS_PER_SECOND:.3f} s' for each in drives[1:4])
        yield f'joint stamps went back {len(drives) - 1} times, to {back_s}: encoders and odometry restarted'


class Encoder(NamedTuple):
    """An encoder, ideal or real, and the odometry that its counts are for."""

    ppr: PerWheel
    name: str  # of a real encoder
    params: EncoderParams
    odometry: OdometryParams

    @property
    def label(self) -> str:
        """Return the name of the encoder in tables."""
        return encoder_label(self.ppr, self.name)


class EncodedDrive(NamedTuple):
    """A recorded drive as an encoder would have measured it."""

    encoder: Encoder
    reports: int
    paths: List[PoseSeries]  # base in odom, for each drive


def encode_drive(read: ReadDrive, encoder: Encoder, bag: Optional[ReencodedBag] = None) -> EncodedDrive:
    """Compute what the nodes would have published with an encoder, and write it into a bag, if one is given.

    Raises:
        OSError: the bag cannot be written.
    """
    chain = Chain(encoder.params, encoder.odometry)
    paths, count = [], 0
    copies = deque(read.copies if bag else ())
    for timed in read.drives:
        run = chain.run(timed.drive, commands=_newest_commands(timed.times_ns, read.commands, encoder))
        count += len(run.rows[0])
        if not bag and len(run.rows[0]) > FEW_REPORTS:
            stamps_ns, poses = run.stamps_ns[0], run.poses[0]
            is_new = np.diff(np.maximum.accumulate(stamps_ns), prepend=-1) > 0  # odometry ignores the others
            paths.append(PoseSeries(stamps_ns[is_new], poses[is_new]))
            continue
        estimates = run.estimates()
        used = [estimate for estimate in estimates if estimate is not None]
        poses = np.array([each.base_pose_in_odom for each in used]).reshape(-1, 3)
        paths.append(PoseSeries(np.array([each.stamp_ns for each in used], np.int64), poses))
        if bag:
            for time_ns, sample, estimate in zip(timed.times_ns[run.rows[0]].tolist(), run.samples(), estimates):
                while copies and copies[0].time_ns < time_ns:
                    bag.copy(copies.popleft())
                bag.report(time_ns, sample, estimate)
    for copy in copies:
        assert bag
        bag.copy(copy)
    return EncodedDrive(encoder, count, paths)


def _newest_commands(
    times_ns: np.ndarray, commands: Sequence[RecordedCommand], encoder: Encoder
) -> Optional[np.ndarray]:
    """Return the commanded speeds of both wheels at each sample (n, 2), 0 before the first; None if not needed."""
    if not commands or not encoder.params.encoder.counts_by_command:
        return None
    separation_m = encoder.odometry.wheel_separation
    speeds_mps = [wheel_speeds_mps(each.linear_mps, each.angular_radps, separation_m) for each in commands]
    newest = np.searchsorted([each.time_ns for each in commands], times_ns, 'right')
    return np.array([(0.0, 0.0), *speeds_mps])[newest]


def drive_errors(read: ReadDrive, encoded: Sequence[EncodedDrive], has_reference: bool) -> List[Optional[PathError]]:
    """Compare the odometry of each encoder with the reference, or with that of the finest, of an ideal one if any."""
    if has_reference:
        references, finest = read.references, None
    else:
        finest = max(encoded, key=lambda one: (not one.encoder.name, min(one.encoder.ppr.left, one.encoder.ppr.right)))
        references = finest.paths
    return [
        None if one is finest else pairs_error([common_poses(*pair) for pair in zip(one.paths, references)], _ORIGIN)
        for one in encoded
    ]


_ORIGIN = Alignment.ORIGIN


class ReencodedBag(TrialBag):
    """Writes what the nodes would have published, at the time of the message that led to it."""

    def __init__(self, path: Path, encoder: Encoder, trial: Optional[Trial]) -> None:
        """Prepare a bag; the `trial` that was recorded is written as if it had been driven with the encoder."""
        super().__init__(path, 'full')
        self._encoder, self._trial = encoder, trial
        self._joints = encoder.params.left_joint, encoder.params.right_joint

    def report(self, time_ns: int, sample: EncoderSample, estimate: Optional[OdometryEstimate]) -> None:
        """Write /encoder_pulse, /encoder_velocity if speeds are measured, /odom and /tf."""
        if sample.wheel_rates_radps is not None:
            speeds = sample.stamp_ns, sample.wheel_rates_radps, self._joints
            self.publish(topics.ENCODER_VELOCITY, topics.ENCODER_NODE, time_ns, encode_wheel_speeds, *speeds)
        self.publish(topics.ENCODER_PULSE, topics.ENCODER_NODE, time_ns, encode_encoder_pulse, sample, self._joints)
        if estimate is None:
            return
        frames = self._encoder.odometry.odom_frame, self._encoder.odometry.base_frame
        if self._encoder.odometry.publish_tf:
            transform = estimate.base_pose_in_odom, estimate.stamp_ns, *frames
            self.publish(topics.TF, topics.ODOM_NODE, time_ns, encode_planar_tf, *transform)
        self.publish(topics.ODOM, topics.ODOM_NODE, time_ns, encode_odometry, estimate, *frames)

    def copy(self, message: Message) -> None:
        """Write a message of `COPIED` as it is, or the trial."""
        if message.topic != topics.TRIAL:
            self.publish(message.topic, COPIED[message.topic], message.time_ns, bytes, message.raw)
        elif self._trial is not None:
            encoder = self._encoder
            trial = with_encoder(self._trial, encoder.params, encoder.odometry, encoder.name)
            text = trial.model_dump_json()
            self.publish(topics.TRIAL, topics.NAVIGATION_TRIAL_NODE, message.time_ns, encode_string, text)


Value = Union[str, int, float, None]


def error_rows(encoded: Sequence[EncodedDrive], errors: Sequence[Optional[PathError]]) -> List[Dict[str, Value]]:
    """Return the errors of each encoder by name with its unit, in SI units; None for a value that there is not."""
    return [_error_row(one, error) for one, error in zip(encoded, errors)]


def _error_row(one: EncodedDrive, error: Optional[PathError]) -> Dict[str, Value]:
    values: Dict[str, Value] = {'ppr': one.encoder.label, 'reports': one.reports}
    values['common_stamps'] = error and error.poses
    for name in ('ate_rmse_m', 'ate_max_m', 'yaw_rmse_rad'):
        values[name] = error and getattr(error, name)
    for name in ('x_m', 'y_m', 'yaw_rad'):
        values[f'end_{name}'] = error and getattr(error.end, name)
    values['reference_length_m'] = error and error.length_m
    for distance_m in RPE_DISTANCES_M:
        for pairs in RpePairs:
            name, relative = rpe_name(pairs, distance_m), error and error.rpe[pairs][distance_m]
            known = relative if relative and relative.segments else None
            values[f'{name}_position_rmse_m'] = known and known.translation_rmse_m
            values[f'{name}_yaw_rmse_rad'] = known and known.rotation_rmse_rad
            values[f'{name}_segments'] = relative and relative.segments
    return values


def csv_table(rows: Sequence[Dict[str, Value]]) -> str:
    """Format `error_rows` at full precision; cells without a value are empty."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator='\n')
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


# Heads of the tables for the terminal, with the column of `error_rows` and how it is shown.
_SHOWN: Dict[str, Callable[[Any], str]] = {
    '[m]': lambda value: f'{value:.4f}',
    '[deg]': lambda value: f'{math.degrees(value):.3f}',
    '': str,
}
_PATH_COLUMNS = {
    'PPR': 'ppr',
    'reports': 'reports',
    'common\nstamps': 'common_stamps',
    'ATE\n[m]': 'ate_rmse_m',
    'max\n[m]': 'ate_max_m',
    'yaw\n[deg]': 'yaw_rmse_rad',
    'end x\n[m]': 'end_x_m',
    'end y\n[m]': 'end_y_m',
    'end yaw\n[deg]': 'end_yaw_rad',
}
_RPE_COLUMNS = {'segments': 'segments', 'RPE\n[m]': 'position_rmse_m', 'RPE\n[deg]': 'yaw_rmse_rad'}


def text_table(rows: Sequence[Dict[str, Value]]) -> str:
    """Format `error_rows`: one line for each encoder, and one for each encoder and length of RPE's segments."""
    paths = [[_cell(head, row[column]) for head, column in _PATH_COLUMNS.items()] for row in rows]
    rpe_heads = ['PPR', 'segment\nlength']
    for pairs in RpePairs:
        rpe_heads += [f'{pairs.text}\n{head}' if head == 'segments' else head for head in _RPE_COLUMNS]
    relative = [
        [str(row['ppr']), f'{distance_m:g} m']
        + [
            _cell(head, row[f'{rpe_name(pairs, distance_m)}_{column}'])
            for pairs in RpePairs
            for head, column in _RPE_COLUMNS.items()
        ]
        for row in rows
        if row['common_stamps']
        for distance_m in RPE_DISTANCES_M
    ]
    tables = ((paths, list(_PATH_COLUMNS)), (relative, rpe_heads))
    return '\n\n'.join(
        tabulate(cells, heads, disable_numparse=True, colalign=['right'] * len(heads))
        for cells, heads in tables
        if cells
    )


def _cell(head: str, value: Value) -> str:
    return '-' if value is None else _SHOWN[head.partition('\n')[2] if '[' in head else ''](value)
