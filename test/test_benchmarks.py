"""Benchmarks run, small; --against compares ratios with those of an earlier run."""

import json
import subprocess
import sys

import pytest

from places import ROOT

BENCHMARKS = ROOT / 'test' / 'benchmark'


def run(script, *arguments):
    command = [sys.executable, str(BENCHMARKS / script), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    ('script', 'option'), [('encoder_errors.py', '--seeds'), ('advice_error_rates.py', '--searches')]
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
