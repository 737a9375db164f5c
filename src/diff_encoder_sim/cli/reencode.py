"""reencode: what a recorded drive's odometry would have been with other encoders. Its help is in reencode_arguments."""

from __future__ import annotations

import argparse
import collections
import contextlib
import logging
import sys
import time
from pathlib import Path
from typing import Counter, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Type, TypeVar

from diff_encoder_sim.base.command_line import as_called, run_tool
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.encoder_notes import name_encoders
from diff_encoder_sim.cli.reencode_arguments import CSV_NAME, parse
from diff_encoder_sim.cli.reencode_encoders import chosen_encoders, given_encoders, parameters_with
from diff_encoder_sim.cli.reencode_outputs import output_files
from diff_encoder_sim.cli.reencode_robot import RecordedRobot, recorded_robot
from diff_encoder_sim.cli.reencode_sources import check_seed, check_wheel_options
from diff_encoder_sim.cli.reencode_wheels import bag_wheels, csv_wheels
from diff_encoder_sim.drives.bag_output import ReencodedBag
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.csv_stream import CsvStream
from diff_encoder_sim.drives.reencoder import DriveSummary, Reencoder, has_commands
from diff_encoder_sim.drives.reference import Reference, find_reference
from diff_encoder_sim.drives.result_table import csv_table, text_table
from diff_encoder_sim.drives.topics import CMD_VEL
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.drives.trial_recording import trial_of_source
from diff_encoder_sim.drives.wheel_source import DriveStream, WheelSource
from diff_encoder_sim.drives.wheels_at_ppr import WheelsAtPpr
from diff_encoder_sim.wheels.catalogue import ChosenEncoder
from diff_encoder_sim.wheels.diagnostics import encoder_lateral_std, hidden_encoder
from diff_encoder_sim.wheels.encoder_params import PerWheel, ppr_label

LEGEND = """\
Odometry minus reference, both seen from their first common stamp, nothing fitted. ATE, max:
distance over the whole path, root mean square and largest. yaw: root mean square. end: along (x)
and across (y) the start heading. RPE: error of the motion over segments of the reference's path,
root mean square of so many segments: consecutive ones lie end to end, all pairs have one from each
pose on. evo gives the same numbers: docs/trajectory_errors.md."""


AnyWheels = TypeVar('AnyWheels', bound=WheelsAtPpr)


class RecordedDrive(NamedTuple):
    """A bag or a table with its wheels and reference, and the parameters that it is read with."""

    path: Path
    stream: DriveStream
    trial: Optional[Trial]
    wheels: WheelSource
    reference: Optional[Reference]
    robot: RecordedRobot


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    handler, once = logging.StreamHandler(), _OnceFilter()
    handler.addFilter(once)
    logging.basicConfig(format=f'{as_called("reencode")}: %(message)s', handlers=[handler])
    run_tool('reencode', lambda: _reencode(parse(arguments), once))


def _reencode(options: argparse.Namespace, once: _OnceFilter) -> None:
    path = options.csv or options.bag
    begin_s = time.perf_counter()
    given = given_encoders(options)
    with opened_drive(options) as drive:
        encoders = chosen_encoders(given, drive.robot.encoder)
        files = output_files(options.out, path, encoders)
        name_encoders(as_called('reencode'), encoders, drive.robot.odometry.wheel_diameter)
        runs = [wheels_with(encoder, drive.robot, WheelsAtPpr) for encoder in encoders]
        try:
            summary = run_drive(drive, runs, files)
        except OSError as error:
            where = error.filename or options.out or path
            raise ConfigError(f'{where}: {error.strerror}') from None
        hidden = _hidden_encoder(encoders, drive.robot) if files else []
        for note in (*once.left_out(), *notes_on(drive, runs, summary), *hidden):
            print(f'{as_called("reencode")}: {path}: {note}', file=sys.stderr)
    _print(drive, runs, summary, time.perf_counter() - begin_s)
    for file in files.values():
        print(file)


def _hidden_encoder(encoders: Sequence[ChosenEncoder], robot: RecordedRobot) -> List[str]:
    """Say once, of the finest encoder that it hides, what the bags' covariance is for a motion noise nobody gave."""
    if robot.odometry.motion_noise is not None:
        return []
    all_params = [parameters_with(encoder, robot.encoder, robot.odometry)[1] for encoder in encoders]
    return [line for line in [hidden_encoder(min(all_params, key=encoder_lateral_std))] if line]


def wheels_with(encoder: ChosenEncoder, robot: RecordedRobot, wheels_class: Type[AnyWheels]) -> AnyWheels:
    """Return the wheels of a recorded robot with another encoder.

    Raises:
        ConfigError: they do not go together.
    """
    params, odometry = parameters_with(encoder, robot.encoder, robot.odometry)
    return wheels_class(encoder.ppr, params, odometry, encoder.name)


@contextlib.contextmanager
def opened_drive(options: argparse.Namespace) -> Iterator[RecordedDrive]:
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
    with open_source(options.bag) as source:
        trial = trial_of_source(options.bag, source)
        robot = recorded_robot(options, trial)
        check_seed(options, robot)
        wheels = bag_wheels(options, source, trial, robot)
        reference = find_reference(options.bag, source, options.reference)
        yield RecordedDrive(options.bag, source, trial, wheels, reference, _with_joints(options, wheels, robot))


def _with_joints(options: argparse.Namespace, wheels: WheelSource, robot: RecordedRobot) -> RecordedRobot:
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
        notes.append('neither the bag nor --robot says which wheels these are: those of config/config.yaml are used')
    if any(run.counts_by_command for run in runs) and not has_commands(drive.stream):
        notes.append(f'no {CMD_VEL} (geometry_msgs/Twist), by which the encoder counts: all counts are forward')
    if drive.stream.fault:
        notes.append(f'{drive.stream.fault}; what can be read is used')
    if drive.reference and not any(run.comparison.result() for run in runs):
        notes.append(
            f'no pose of {drive.reference.name} has the time of an odometry message: errors cannot be computed'
        )
    return notes


def _print(drive: RecordedDrive, runs: Sequence[WheelsAtPpr], summary: DriveSummary, took_s: float) -> None:
    reference = drive.reference.name if drive.reference else 'the odometry of the finest PPR'
    print(
        f'{drive.path}: {summary.messages} {drive.wheels.text} in {summary.duration_s:.1f} s, read in {took_s:.1f} s; '
        f'compared with {reference}'
    )
    print(f'{drive.robot.text()}')
    finer = [run.label for run in runs if _is_finer(run.ppr, drive.wheels.ppr)]
    if drive.wheels.ppr is not None and finer:
        print(
            f'recorded with {ppr_label(drive.wheels.ppr)} PPR: {", ".join(finer)} cannot show more than these counts do'
        )
    print()
    print(text_table(runs))
    print(f'\n{LEGEND}')


def _is_finer(ppr: PerWheel, recorded: Optional[PerWheel]) -> bool:
    return recorded is not None and (ppr.left > recorded.left or ppr.right > recorded.right)


class _OnceFilter(logging.Filter):
    """Lets the first warning of a kind pass, and counts the others, which have other numbers or are of other PPRs."""

    def __init__(self) -> None:
        super().__init__()
        self._first: Dict[str, str] = {}  # by kind
        self._last: Dict[str, str] = {}
        self._others: Counter[str] = collections.Counter()

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether the record is the first of its kind."""
        kind, text = record.msg, record.getMessage()
        is_first = kind not in self._first
        self._first.setdefault(kind, text)
        if not is_first and self._last[kind] != text:
            self._others[kind] += 1
        self._last[kind] = text
        return is_first

    def left_out(self) -> Iterator[str]:
        """List how many of each kind did not pass; where each PPR logs the same when stamps go back, that is one."""
        for kind, count in self._others.items():
            yield f'{count} more such as "{self._first[kind]}"'
