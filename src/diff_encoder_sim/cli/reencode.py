"""reencode: what a recorded drive would have looked like with other encoders.

From the wheel angles of a bag (sensor_msgs/JointState), or from the counts of a finer encoder
(diff_encoder_sim/EncoderPulse): /encoder_pulse, /odom and /tf as the live nodes would have
published them at each PPR, and how far that odometry is from a reference.
"""

from __future__ import annotations

import argparse
import contextlib
import logging
import sys
import time
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Sequence, Set

import yaml

from diff_encoder_sim.base.console import run_tool
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.paths import package_folder
from diff_encoder_sim.base.typed_params import load_yaml, split_params
from diff_encoder_sim.encoders.pulses import PerWheel, ppr_label
from diff_encoder_sim.encoders.wheel_encoder import EncoderParams
from diff_encoder_sim.odometry.wheel_odometry import OdometryParams
from diff_encoder_sim.recording.bag_source import BagSource, open_source
from diff_encoder_sim.reencoding.bag_output import ReencodedBag
from diff_encoder_sim.reencoding.recorded_trial import recorded_trial
from diff_encoder_sim.reencoding.reencoder import DriveSummary, Reencoder, WheelsAtPpr
from diff_encoder_sim.reencoding.reference import Reference, find_reference
from diff_encoder_sim.reencoding.result_table import csv_table, text_table
from diff_encoder_sim.reencoding.wheels import WheelOptions, WheelTopic, find_wheels
from diff_encoder_sim.trials.trial_definition import Trial

PAPER_PPR = ('40', '90', '1024', '4096')
CSV_NAME = 'reencode.csv'

LEGEND = """\
Odometry minus reference, both seen from their first common stamp, nothing fitted. ATE, max:
distance over the whole path, root mean square and largest. yaw: root mean square. end: along (x)
and across (y) the start heading. RPE: root mean square over all stretches of that length."""

EXACTNESS = """\
Counts tell the angle to half a pulse. At a PPR that divides the recorded encoder's the result is
exact; at another, a count is one off in a quarter of PPR / recorded PPR of the samples. Counts
that wrap need their counter_modulus in --config."""


class Inputs(NamedTuple):
    """What is read, and with which parameters."""

    path: Path
    trial: Optional[Trial]
    wheels: WheelTopic
    reference: Optional[Reference]
    encoder: EncoderParams
    odometry: OdometryParams


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Entry point of the executable."""
    handler = logging.StreamHandler()
    handler.addFilter(_OnceFilter())
    logging.basicConfig(format='reencode: %(message)s', handlers=[handler])
    run_tool('reencode', lambda: _reencode(_parse(arguments)))


def _reencode(options: argparse.Namespace) -> None:
    pprs = _pprs(options.ppr)
    files = _output_files(options.out, options.bag, pprs)
    begin_s = time.perf_counter()
    with open_source(options.bag) as source:
        inputs = _inputs(options, source)
        _check_coarser(pprs, inputs.wheels)
        runs = [WheelsAtPpr(ppr, inputs.encoder, inputs.odometry) for ppr in pprs]
        try:
            with contextlib.ExitStack() as stack:
                for run in runs:
                    if files:
                        run.bag = stack.enter_context(
                            ReencodedBag(files[ppr_label(run.ppr)], inputs.wheels.joints, inputs.odometry)
                        )
                summary = _run(inputs, runs, source)
            if files:
                _write_new(files[CSV_NAME], csv_table(runs))
        except OSError as error:
            where = error.filename or options.out or options.bag
            raise ConfigError(f'{where}: {error.strerror}') from None
        _warn(options.bag, source, inputs, runs, summary)
    _print(inputs, runs, summary, time.perf_counter() - begin_s)
    for path in files.values():
        print(path)


def _inputs(options: argparse.Namespace, source: BagSource) -> Inputs:
    encoder, odometry = split_params(load_yaml(options.config), options.config, EncoderParams, OdometryParams)
    trial = recorded_trial(options.bag, source)
    pulses_ppr = _ppr('--pulses-ppr', options.pulses_ppr) if options.pulses_ppr else None
    wheels = find_wheels(
        options.bag,
        source,
        WheelOptions(
            options.joint_states, options.pulses, pulses_ppr or (trial and trial.ppr), options.left, options.right
        ),
        encoder,
    )
    if pulses_ppr is not None and wheels.ppr is None:
        raise ConfigError(
            f'--pulses-ppr: given, but {wheels.topic} has wheel angles; expected --pulses TOPIC with it, or neither'
        )
    joints = {'left_joint': wheels.joints[0], 'right_joint': wheels.joints[1]}
    return Inputs(
        options.bag,
        trial,
        wheels,
        find_reference(options.bag, source, options.reference),
        encoder.model_copy(update=joints),
        odometry,
    )


def _run(inputs: Inputs, runs: Sequence[WheelsAtPpr], source: BagSource) -> DriveSummary:
    reencoder = Reencoder(inputs.wheels, inputs.reference, runs, source.is_cdr, inputs.encoder.counter_modulus)
    summary = reencoder.run(source, inputs.trial)
    if not any(run.reports > 1 for run in runs):
        why = '; '.join(summary.faults) or source.fault or 'too short'
        raise ConfigError(
            f'{inputs.path}: no drive in {summary.messages} messages of '
            f'{inputs.wheels.topic}: {why}; expected two reports of the encoder'
        )
    return summary


def _check_coarser(pprs: Sequence[PerWheel], wheels: WheelTopic) -> None:
    for ppr in pprs if wheels.ppr else ():
        if ppr.left > wheels.ppr.left or ppr.right > wheels.ppr.right:
            raise ConfigError(
                f'--ppr: given {ppr_label(ppr)}; allowed: at most '
                f'{ppr_label(wheels.ppr)}, which {wheels.topic} was counted with'
            )


def _warn(path: Path, source: BagSource, inputs: Inputs, runs: Sequence[WheelsAtPpr], summary: DriveSummary) -> None:
    """What could not be read or compared: one line each."""
    notes = list(summary.faults)
    if source.fault:
        notes.append(f'{source.fault}; read as far as it goes')
    if inputs.reference and not any(run.comparison.error.result() for run in runs):
        notes.append(f'no pose of {inputs.reference.name} at a time of the odometry: nothing to compare with')
    for note in notes:
        print(f'reencode: {path}: {note}', file=sys.stderr)


def _print(inputs: Inputs, runs: Sequence[WheelsAtPpr], summary: DriveSummary, took_s: float) -> None:
    wheels = inputs.wheels
    reference = inputs.reference.name if inputs.reference else 'the finest PPR'
    print(
        f'{inputs.path}: {summary.messages} messages of {wheels.topic} '
        f'({", ".join(wheels.joints)}) in {summary.duration_s:.1f} s, read in {took_s:.1f} s; '
        f'against {reference}:\n'
    )
    print(text_table(runs))
    print(f'\n{LEGEND}')


def _pprs(texts: Sequence[str]) -> List[PerWheel]:
    """As they were given, each once.

    Raises:
        ConfigError: one is no PPR, or given twice.
    """
    by_label: Dict[str, PerWheel] = {}
    for text in texts:
        ppr = _ppr('--ppr', text)
        if ppr_label(ppr) in by_label:
            raise ConfigError(f'--ppr: given {ppr_label(ppr)} twice; allowed: each once')
        by_label[ppr_label(ppr)] = ppr
    return list(by_label.values())


def _ppr(option: str, text: str) -> PerWheel:
    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError:
        value = text
    return EncoderParams.from_mapping({'ppr': value}, option).ppr


def _output_files(folder: Optional[Path], bag: Path, pprs: Sequence[PerWheel]) -> Dict[str, Path]:
    """By PPR's label, and the CSV file; none without a folder.

    Raises:
        ConfigError: one exists.
    """
    if folder is None:
        return {}
    stem = bag.resolve().stem  # of `.`, too
    files = {ppr_label(ppr): folder / f'{stem}_{ppr_label(ppr)}ppr.bag' for ppr in pprs}
    files[CSV_NAME] = folder / CSV_NAME
    for path in files.values():
        if path.exists():
            raise ConfigError(f'--out: {path} exists; allowed: a folder without it')
    return files


def _write_new(path: Path, text: str) -> None:
    with open(path, 'x', encoding='utf-8') as file:
        file.write(text)


class _OnceFilter(logging.Filter):
    """Every PPR says the same of a clock that jumps."""

    def __init__(self) -> None:
        super().__init__()
        self._said: Set[str] = set()

    def filter(self, record: logging.LogRecord) -> bool:
        text = record.getMessage()
        is_new = text not in self._said
        self._said.add(text)
        return is_new


def _parse(arguments: Optional[Sequence[str]]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='reencode',
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog=f'{EXACTNESS}\n\nexample: reencode drive.bag --ppr 40 90 1024 4096 --out what_if/',
    )
    parser.add_argument('bag', type=Path, help='of ROS 1 (a file, whole or torn) or of ROS 2')
    parser.add_argument(
        '--ppr',
        nargs='+',
        default=PAPER_PPR,
        metavar='PPR',
        help=f'pulses per revolution: 90, or "{{left: 90, right: 1024}}" (default: {" ".join(PAPER_PPR)})',
    )
    parser.add_argument(
        '--out', type=Path, metavar='DIR', help=f'writes a bag for each PPR, and {CSV_NAME} (default: the table alone)'
    )
    parser.add_argument(
        '--joint-states', default='', metavar='TOPIC', help='of wheel angles (default: the only one of its type)'
    )
    parser.add_argument('--left', default='', metavar='JOINT', help="default: the config's, or the only left wheel")
    parser.add_argument('--right', default='', metavar='JOINT', help='likewise')
    parser.add_argument('--pulses', default='', metavar='TOPIC', help='of counts, instead of wheel angles')
    parser.add_argument(
        '--pulses-ppr',
        default='',
        metavar='PPR',
        help='that they were counted with (default: that of the recorded trial)',
    )
    parser.add_argument(
        '--reference',
        default='',
        metavar='TOPIC|FRAMES',
        help='poses to compare with: a topic, or two frames of /tf as '
        '"map->base_link" (default: /world_pose, or the finest PPR)',
    )
    parser.add_argument(
        '--config',
        type=Path,
        default=package_folder() / 'config' / 'config.yaml',
        help='robot and encoder (default: config/config.yaml)',
    )
    return parser.parse_args(arguments)
