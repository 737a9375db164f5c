"""reencode: what a recorded drive's odometry would have been with other encoders. Its help is in reencode_arguments."""

from __future__ import annotations

import argparse
import contextlib
import logging
import sys
import time
from pathlib import Path
from typing import Mapping, NamedTuple, Optional, Sequence, Set

from diff_encoder_sim.base.command_line import run_tool
from diff_encoder_sim.base.command_name import as_called
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.reencode_arguments import CSV_NAME, output_files, parse, ppr_of_text, pprs_of_texts
from diff_encoder_sim.cli.reencode_robot import RecordedRobot, recorded_robot
from diff_encoder_sim.encoders.pulses import PerWheel, ppr_label
from diff_encoder_sim.encoders.wheel_encoder import EncoderParams
from diff_encoder_sim.recording.bag_source import BagSource, open_source
from diff_encoder_sim.recording.trial_metadata import trial_of_source
from diff_encoder_sim.reencoding.bag_output import ReencodedBag
from diff_encoder_sim.reencoding.reencoder import DriveSummary, Reencoder
from diff_encoder_sim.reencoding.reference import Reference, find_reference
from diff_encoder_sim.reencoding.result_table import csv_table, text_table
from diff_encoder_sim.reencoding.wheels import WheelOptions, WheelTopic, find_wheels
from diff_encoder_sim.reencoding.wheels_at_ppr import WheelsAtPpr
from diff_encoder_sim.trials.trial_definition import Trial

LEGEND = """\
Odometry minus reference, both seen from their first common stamp, nothing fitted. ATE, max:
distance over the whole path, root mean square and largest. yaw: root mean square. end: along (x)
and across (y) the start heading. RPE: error of the motion over segments of the reference's path,
root mean square of so many segments: consecutive ones lie end to end, all pairs have one from each
pose on. evo gives the same numbers: docs/trajectory_errors.md."""


class RecordedDrive(NamedTuple):
    """A bag's wheels and reference, and the parameters that they are read with."""

    path: Path
    trial: Optional[Trial]
    wheels: WheelTopic
    reference: Optional[Reference]
    robot: RecordedRobot


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    handler = logging.StreamHandler()
    handler.addFilter(_OnceFilter())
    logging.basicConfig(format=f'{as_called("reencode")}: %(message)s', handlers=[handler])
    run_tool('reencode', lambda: _reencode(parse(arguments)))


def _reencode(options: argparse.Namespace) -> None:
    pprs = pprs_of_texts(options.ppr)
    files = output_files(options.out, options.bag, pprs)
    begin_s = time.perf_counter()
    with open_source(options.bag) as source:
        drive = _recorded_drive(options, source)
        _check_coarser(pprs, drive.wheels)
        runs = [WheelsAtPpr(ppr, drive.robot.encoder, drive.robot.odometry) for ppr in pprs]
        try:
            summary = _run_and_write(drive, runs, source, files)
        except OSError as error:
            where = error.filename or options.out or options.bag
            raise ConfigError(f'{where}: {error.strerror}') from None
        _warn(source, drive, runs, summary)
    _print(drive, runs, summary, time.perf_counter() - begin_s)
    for path in files.values():
        print(path)


def _recorded_drive(options: argparse.Namespace, source: BagSource) -> RecordedDrive:
    trial = trial_of_source(options.bag, source)
    robot = recorded_robot(options, trial)
    encoder, sources = robot.encoder, dict(robot.sources)
    wheels = _wheels(options, source, trial, encoder)
    reference = find_reference(options.bag, source, options.reference)
    for side, joint in zip(('left', 'right'), wheels.joints):
        if joint != getattr(encoder, f'{side}_joint'):
            sources[f'{side}_joint'] = f'--{side}' if getattr(options, side) else f"the bag's {wheels.topic}"
    encoder = encoder.model_copy(update={'left_joint': wheels.joints[0], 'right_joint': wheels.joints[1]})
    if wheels.ppr is not None:  # the encoder that counted knew which way is forward
        encoder = encoder.model_copy(update={'left_reversed': False, 'right_reversed': False})
    return RecordedDrive(options.bag, trial, wheels, reference, robot._replace(encoder=encoder, sources=sources))


def _wheels(
    options: argparse.Namespace, source: BagSource, trial: Optional[Trial], encoder: EncoderParams
) -> WheelTopic:
    given_ppr = ppr_of_text('--pulses-ppr', options.pulses_ppr) if options.pulses_ppr else None
    trial_ppr = trial.ppr if trial else None
    selected = WheelOptions(options.joint_states, options.pulses, given_ppr or trial_ppr, options.left, options.right)
    wheels = find_wheels(options.bag, source, selected, encoder)
    if given_ppr is not None and wheels.ppr is None:
        raise ConfigError(
            f'--pulses-ppr: given, but {wheels.topic} has wheel angles; expected --pulses TOPIC with it, or neither'
        )
    return wheels


def _run_and_write(
    drive: RecordedDrive, runs: Sequence[WheelsAtPpr], source: BagSource, files: Mapping[str, Path]
) -> DriveSummary:
    if not files:
        return _run(drive, runs, source)
    with contextlib.ExitStack() as stack:
        for run in runs:
            run.bag = ReencodedBag(files[ppr_label(run.ppr)], drive.wheels.joints, drive.robot.odometry)
            stack.enter_context(run.bag)
        summary = _run(drive, runs, source)
    with open(files[CSV_NAME], 'x', encoding='utf-8') as file:
        file.write(csv_table(runs))
    return summary


def _run(drive: RecordedDrive, runs: Sequence[WheelsAtPpr], source: BagSource) -> DriveSummary:
    reencoder = Reencoder(drive.wheels, drive.reference, runs, source.is_cdr, drive.robot.encoder.counter_modulus)
    summary = reencoder.run(source, drive.trial)
    if not any(run.reports > 1 for run in runs):
        why = '; '.join(summary.faults) or source.fault or 'too short'
        raise ConfigError(
            f'{drive.path}: no drive in {summary.messages} messages of '
            f'{drive.wheels.topic}: {why}; expected two reports of the encoder'
        )
    return summary


def _check_coarser(pprs: Sequence[PerWheel], wheels: WheelTopic) -> None:
    recorded = wheels.ppr
    if recorded is None:
        return  # angles, which are exact
    for ppr in pprs:
        if ppr.left > recorded.left or ppr.right > recorded.right:
            raise ConfigError(
                f'--ppr: given {ppr_label(ppr)}; allowed: at most '
                f'{ppr_label(recorded)}, which {wheels.topic} was counted with'
            )


def _warn(source: BagSource, drive: RecordedDrive, runs: Sequence[WheelsAtPpr], summary: DriveSummary) -> None:
    """Print what could not be read or compared, one line each."""
    notes = list(summary.faults)
    if drive.robot.is_guessed():
        notes.append('neither the bag nor --robot says which wheels these are: those of config/config.yaml are used')
    if source.fault:
        notes.append(f'{source.fault}; all messages that can be read are used')
    if drive.reference and not any(run.comparison.result() for run in runs):
        notes.append(
            f'no pose of {drive.reference.name} has the time of an odometry message: errors cannot be computed'
        )
    for note in notes:
        print(f'{as_called("reencode")}: {drive.path}: {note}', file=sys.stderr)


def _print(drive: RecordedDrive, runs: Sequence[WheelsAtPpr], summary: DriveSummary, took_s: float) -> None:
    wheels = drive.wheels
    reference = drive.reference.name if drive.reference else 'the odometry of the finest PPR'
    print(
        f'{drive.path}: {summary.messages} messages of {wheels.topic} '
        f'({", ".join(wheels.joints)}) in {summary.duration_s:.1f} s, read in {took_s:.1f} s; '
        f'compared with {reference}'
    )
    print(f'{drive.robot.text()}\n')
    print(text_table(runs))
    print(f'\n{LEGEND}')


class _OnceFilter(logging.Filter):
    """Drops a warning that was logged before: each PPR logs the same one when stamps go back."""

    def __init__(self) -> None:
        super().__init__()
        self._logged: Set[str] = set()

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether the record's text is new."""
        text = record.getMessage()
        is_new = text not in self._logged
        self._logged.add(text)
        return is_new
