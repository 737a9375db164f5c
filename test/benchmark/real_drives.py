#!/usr/bin/env python3
"""The tables of docs/real_robots.md: calibrate, reencode and advise on a folder of drives of one robot.

Needs one or more tables of counts with a reference. The robot is calibrated by each drive and by all of them; each
drive is predicted by the others. The defaults are the columns of the wheelchair; other tables have options of the
commands, such as --wheels '--columns t left right --ticks-per-revolution 4096' --reference '--reference-columns t x y'.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import os
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any, Dict, Sequence

import numpy as np
from bench import ROOT, in_processes, package_environment, parser, print_header, print_table

from diff_encoder_sim.api.options import CalibrateOptions
from diff_encoder_sim.api.recorded_sources import read_recorded
from diff_encoder_sim.api.wheel_options import parameters_with
from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.per_wheel import PerWheel
from diff_encoder_sim.cli import calibrate
from diff_encoder_sim.wheels.catalogue import ChosenEncoder
from diff_encoder_sim.wheels.odometry_params import UNCERTAINTY_KEYS
from phase_drives import nees_of_phases

WHEELS = '--columns n_time tick_L tick_R --time-unit ms --ticks-per-revolution 409600'
REFERENCE = (
    '--reference-columns n_time pose_x pose_y pose_theta --length-unit cm '
    '--reference-covariance cov_11 cov_12 cov_13 cov_22 cov_23 cov_33'
)
NOMINAL = """\
# What a tape measures: the geometry before the calibration.
set:
  config.wheel_diameter: 0.316
  config.wheel_separation: 0.56
"""
DEG = math.degrees(1.0)
AXES = {'along': ('mm', 1e3), 'across': ('mm', 1e3), 'heading': ('deg', DEG)}
VALUES = {  # of a calibration: text, unit (of a standard deviation if it is a variance) and digits
    'left_wheel_diameter_m': ('left diameter [m]', 1.0, 4),
    'right_wheel_diameter_m': ('right diameter [m]', 1.0, 4),
    'wheel_separation_m': ('separation [m]', 1.0, 4),
    'radius_ratio': ('right / left radius', 1.0, 4),
    'radius_per_separation': ('left radius / separation', 1.0, 4),
    'reference_x_m': ('reference ahead of the base [m]', 1.0, 3),
    'reference_y_m': ('reference to the left [m]', 1.0, 3),
    'reference_yaw_rad': ('reference turned left [deg]', DEG, 2),
    'reference_delay_s': ('delay of the reference [s]', 1.0, 3),
    'slip_m2_per_m': ('slip of a wheel [mm after 1 m]', 1e3, 2),
    'slip_rad2_per_rad': ('slip of turns [deg after 1 rad]', DEG, 2),
}
ERRORS = {'ate_m': (1e3, 0), 'end_position_m': (1e3, 0), 'end_yaw_rad': (DEG, 2)}  # of reencode: unit and digits
EXACT = {'axle_x': 0.0, **dict.fromkeys(UNCERTAINTY_KEYS, 0.0)}
ENDS = 20  # of a drive


class Folder:
    """The drives, the options of their tables, and where results are."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.drives = sorted(options.folder.glob(options.pattern))
        if not self.drives:
            sys.exit(f'{options.folder}: no file matches {options.pattern}; expected tables of drives')
        self.out, self.counts = options.out, [f'{count:g}' for count in options.counts]
        self.wheels, self.reference = shlex.split(options.wheels), shlex.split(options.reference)
        self.out.mkdir(parents=True, exist_ok=True)
        self.nominal, self.robot = options.robot or self.out / 'nominal.yaml', self.out / 'all.yaml'
        if options.robot is None:
            self.nominal.write_text(NOMINAL)

    def run(self, command: str, name: str, *arguments: object) -> Any:
        """Run a command of the package, print it as a user types it, and return what it wrote as JSON."""
        file = self.out / f'{name}.json'
        typed = [str(each) for each in (*arguments, '--json', file)]
        print(f'$ rosrun diff_encoder_sim {command} {" ".join(map(shlex.quote, typed))}', flush=True)
        started = [sys.executable, str(ROOT / 'scripts' / command), *typed]
        done = subprocess.run(started, capture_output=True, text=True, check=False, env=package_environment())
        if done.returncode:
            sys.exit(done.stderr)
        return json.loads(file.read_text())

    def calibrate(self, drives: Sequence[Path], name: str) -> Any:
        table = ['--csv', *drives, *self.wheels, *self.reference]
        table += ['--robot', self.nominal, '--out', self.out / f'{name}.yaml']
        return self.run('calibrate', name, *table)

    def advise(self, drive: Path, robot: Path, name: str, *options: object) -> Any:
        of_drive = ['--drive', drive, *self.wheels, '--robot', robot, *options, '--out', self.out / name]
        return self.run('advise', name, *of_drive)


def main() -> None:
    made = parser(__doc__, draws=1000, workers=os.cpu_count())
    made.add_argument('folder', type=Path, metavar='FOLDER', help='with the tables')
    made.add_argument('--pattern', default='*.txt', help='of the names of tables (default: %(default)s)')
    made.add_argument('--wheels', default=WHEELS, metavar='OPTIONS', help='of the tables (default: %(default)s)')
    made.add_argument('--reference', default=REFERENCE, metavar='OPTIONS', help='likewise (default: %(default)s)')
    made.add_argument('--robot', type=Path, metavar='FILE', help='before the calibration (default: the wheelchair)')
    made.add_argument('--counts', nargs='+', type=float, default=[20.0, 40.0, 90.0, 250.0, 1024.0], metavar='N')
    made.add_argument('--tolerances', nargs='+', type=float, default=[0.05, 0.1], metavar='M', help='of advise')
    made.add_argument('--out', type=Path, default=Path('results/real_drives'), metavar='DIR', help='robot files, JSON')
    options = made.parse_args()
    folder = Folder(options)
    print_header(f'{len(folder.drives)} drives of {options.folder}')
    together = print_calibration(folder)
    print_prediction(together['predictions'])
    print_quantisation(folder, together['predictions'])
    print_reencoded(folder)
    print_nees(folder, options.draws, options.workers)
    print_advice(folder, options.tolerances)


def print_calibration(folder: Folder) -> Any:
    """Calibrate by each drive and by all; return the latter."""
    alone = folder.drives if len(folder.drives) > 1 else []
    found = {drive.stem: folder.calibrate([drive], drive.stem) for drive in alone}
    found['all'] = folder.calibrate(folder.drives, 'all')
    rows = [
        [text, *(_interval(each.get(name), unit, digits, '2_per' in name) for each in found.values())]
        for name, (text, unit, digits) in VALUES.items()
    ]
    print()
    print_table(rows, ['value and interval of 95 %', *found])
    return found['all']


def _interval(estimate: Any, unit: float, digits: int, is_variance: bool) -> str:
    if estimate is None:
        return ''
    values = np.array([estimate['value'], *estimate['interval']])
    value, low, high = (f'{each:.{digits}f}' for each in unit * (np.sqrt(values) if is_variance else values))
    return f'{value} [{low}, {high}]'


def print_prediction(predictions: Sequence[Dict[str, Any]]) -> None:
    rows = [
        [
            f'{each["drive"]}, {each["length_m"]:.1f} m' if not place else '',
            f'{axis} [{name}]',
            f'{unit * each["nominal_error"][place]:.1f}',
            f'{unit * each["error"][place]:.1f}',
            f'±{unit * each["interval"][place][1]:.1f}',
            'yes' if each['is_inside'][place] else 'no',
        ]
        for each in predictions
        for place, (axis, (name, unit)) in enumerate(AXES.items())
        if each['error'][place] is not None
    ]
    heads = ['predicted by the others', 'end error', 'nominal', 'calibrated', 'interval of 90 %', 'inside']
    print_table(rows, heads, 2)


def print_quantisation(folder: Folder, predictions: Sequence[Dict[str, Any]]) -> None:
    """Print quantisation at the end of drives, and its part of the variance of the position: expected and observed."""
    squares_m2, expected = [], []  # (drives, counts)
    for drive in folder.drives:
        budgets = folder.advise(drive, folder.robot, f'budget_{drive.stem}', '--ppr', *folder.counts)['budgets']
        of_counts = {f'{each["ppr"]:g}': each for each in next(iter(budgets.values()))}
        parts = [of_counts[count]['parts']['quantisation'] for count in folder.counts]
        of_axes = [[part[axis] for axis in ('along', 'across')] for part in parts]
        squares_m2.append([sum(each['bias'] ** 2 + each['variance'] for each in axes) for axes in of_axes])
        expected.append([of_counts[count]['position_fractions']['quantisation'] for count in folder.counts])
    observed_m2 = np.mean([sum(error**2 for error in each['error'][:2]) for each in predictions])
    mean_m2 = np.mean(squares_m2, axis=0)
    rows = [
        [
            count,
            *(f'{1e3 * math.sqrt(each[place]):.1f}' for each in squares_m2),
            *(f'{100.0 * each[place]:.1f}' for each in expected),
            f'{100.0 * mean_m2[place] / (mean_m2[place] + observed_m2):.1f}',
        ]
        for place, count in enumerate(folder.counts)
    ]
    heads = [f'{text}\n{drive.stem}' for text in ('rms [mm]', 'expected [%]') for drive in folder.drives]
    print()
    print_table(rows, ['counts', *heads, 'observed [%]'])
    print(f'observed: of quantisation and the {1e3 * math.sqrt(observed_m2):.0f} mm rms of the predictions above\n')


def print_reencoded(folder: Folder) -> None:
    rows = []
    for drive in folder.drives:
        table = ['--csv', drive, *folder.wheels, *folder.reference, '--robot', folder.robot, '--ppr', *folder.counts]
        for each in folder.run('reencode', f'reencode_{drive.stem}', *table)['encoders']:
            rows.append([drive.stem, each['label'], *(_spread(each[key], *shown) for key, shown in ERRORS.items())])
    print()
    print_table(rows, ['drive', 'counts', 'ATE [mm]', 'end position [mm]', 'end heading [deg]'], 2)


def _spread(spread: Dict[str, float], unit: float, digits: int) -> str:
    if spread['median'] is None:
        return ''
    median, low, high = (f'{unit * spread[key]:.{digits}f}' for key in ('median', 'p5', 'p95'))
    return f'{median} ({low} to {high})'


def print_nees(folder: Folder, draws: int, workers: int) -> None:
    """Print NEES / 3 of odometry with exact wheels: only quantisation is in error and covariance."""
    jobs = [(folder, drive, count, draws) for drive in folder.drives for count in folder.counts]
    found = iter(in_processes(_nees, jobs, workers))
    rows = [[drive.stem, *(f'{next(found):.2f}' for _ in folder.counts)] for drive in folder.drives]
    print_table(rows, ['NEES / 3 by counts', *folder.counts])


def _nees(job: Any) -> float:
    folder, path, count, draws = job
    arguments = ['--csv', path, *folder.wheels, *folder.reference, '--robot', folder.robot]
    options: CalibrateOptions = calibrate.parse([str(each) for each in arguments])
    recorded = read_recorded(options, path, is_table=True)
    drive: Drive = max((drive for drive, _ in recorded.parts), key=len)
    chosen = ChosenEncoder(PerWheel(left=float(count), right=float(count)))
    _, odometry = parameters_with(chosen, recorded.robot.encoder, recorded.robot.odometry)
    odometry = odometry.model_copy(update=EXACT)
    ends = np.linspace(0, len(drive) - 1, ENDS + 1).astype(int)[1:]
    phases_rad = np.random.default_rng(1).uniform(0.0, 2.0 * math.pi, (draws, 2))
    wheels = drive.stamps_ns, drive.wheel_angles_rad, odometry
    return float(np.mean([nees_of_phases(*wheels, phase_rad, ends) for phase_rad in phases_rad]))


def print_advice(folder: Folder, tolerances: Sequence[float]) -> None:
    answers = []
    for drive, tolerance, robot in itertools.product(folder.drives, tolerances, (folder.nominal, folder.robot)):
        name = f'advice_{drive.stem}_{tolerance:g}_{robot.stem}'
        found = folder.advise(drive, robot, name, '--tolerance', tolerance)
        answer = found['answers']['odometry']['text']
        answers.append(f'{drive.stem}, {tolerance:g} m: {answer}\n  assumes {found["assumptions"]}')
    print('', *answers, sep='\n')


if __name__ == '__main__':
    main()
