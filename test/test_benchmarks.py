"""Benchmarks run, small; all.py gathers their ratios and compares them with those of another run."""

import json
import subprocess
import sys

import pytest

from places import ROOT

BENCHMARKS = ROOT / 'test' / 'benchmark'
SMALL = {
    'core_costs.py': ['--calls', '20', '--repeats', '1'],
    'kernels.py': ['--repeats', '1'],
    'encoder_errors.py': ['--seeds', '3'],
    'advice_error_rates.py': ['--searches', '3'],
}


def run(script, *arguments):
    command = [sys.executable, str(BENCHMARKS / script), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize('script', SMALL)
def test_a_benchmark_prints_its_table_with_host_and_commit(script):
    done = run(script, *SMALL[script])
    assert done.returncode == 0, done.stderr
    assert 'machine: ' in done.stdout and 'commit: ' in done.stdout and '---' in done.stdout


@pytest.mark.parametrize('script', sorted(path.name for path in BENCHMARKS.glob('*.py')))
def test_every_script_can_be_compiled(script):
    compile((BENCHMARKS / script).read_text(), script, 'exec')


def test_all_reports_what_became_slower(tmp_path):
    written = tmp_path / 'now.json'
    assert run('kernels.py', '--repeats', 1, '--json', written).returncode == 0
    before = json.loads(written.read_text())
    for ratio in before['ratios']['kernels.py']:
        ratio['rounds'] = [0.01 * each for each in ratio['rounds']]
    written.write_text(json.dumps(before))
    done = run('all.py', '--only', 'kernels.py', '--against', written)
    assert done.returncode == 1 and 'slower' in done.stdout


def test_a_file_that_is_no_result_is_named(tmp_path):
    (tmp_path / 'other.json').write_text('{}')
    done = run('all.py', '--against', tmp_path / 'other.json')
    assert done.returncode == 2 and 'other.json' in done.stderr and 'host: missing' in done.stderr
