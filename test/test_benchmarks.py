"""Benchmarks run, small; --against compares ratios with those of an earlier run."""

import json
import subprocess
import sys

import numpy as np
import pytest

from calibration_drives import TrueRobot, referenced_drive
from places import ROOT

pytestmark = pytest.mark.long

BENCHMARKS = ROOT / 'test' / 'benchmark'


def run(script, *arguments):
    command = [sys.executable, str(BENCHMARKS / script), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    ('script', 'option'),
    [('encoder_errors.py', '--seeds'), ('advice_error_rates.py', '--searches'), ('dld_offset.py', '--trials')],
)
def test_a_benchmark_prints_its_table_with_host_and_commit(script, option):
    done = run(script, option, 3)
    assert done.returncode == 0, done.stderr
    assert 'machine: ' in done.stdout and 'commit: ' in done.stdout and '---' in done.stdout


def test_a_slower_ratio_than_before_fails(tmp_path):
    written = tmp_path / 'now.json'
    assert run('kernels.py', '--repeats', 1, '--json', written).returncode == 0
    ratios = json.loads(written.read_text())
    written.write_text(
        json.dumps([[name, of, [0.01 * each for each in rounds], most] for name, of, rounds, most in ratios])
    )
    done = run('kernels.py', '--repeats', 1, '--against', written)
    assert done.returncode == 1 and 'slower' in done.stderr


def test_the_tables_of_real_robots_are_of_any_folder_with_drives(tmp_path):
    robot = TrueRobot()
    made = referenced_drive(robot, np.random.default_rng(3), 30.0)
    stamps_ns, drive = made.reference.stamps_ns, made.drive
    angles_rad = np.array([np.interp(stamps_ns, drive.stamps_ns, angles) for angles in drive.wheel_angles_rad.T])
    counts = np.floor(angles_rad * robot.counts / (2.0 * np.pi))
    np.savetxt(str(tmp_path / 'drive.csv'), np.column_stack((1e-9 * stamps_ns, *counts, made.reference.poses)))
    options = {
        '--pattern': ['*.csv'],
        '--wheels': [f'--columns 1 2 3 --ticks-per-revolution {robot.counts}'],
        '--reference': ['--reference-columns 1 4 5 6'],
        '--counts': [20, 90],
        '--tolerances': [0.1],
        '--draws': [5],
        '--out': [tmp_path / 'out'],
    }
    done = run('real_drives.py', tmp_path, *(word for name, words in options.items() for word in (name, *words)))
    assert done.returncode == 0, done.stderr
    for text in ('right / left radius', 'second half', 'observed [%]', 'ATE [mm]', 'NEES / 3', 'drive, 0.1 m: '):
        assert text in done.stdout
