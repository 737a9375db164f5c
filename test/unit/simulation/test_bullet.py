"""PyBullet is imported quietly, and only by what simulates."""

import os
import subprocess
import sys

import pytest

from places import SOURCE
from trial_bags import trial, write_bag


def test_importing_pybullet_prints_nothing_and_later_prints_are_seen():
    script = 'from diff_encoder_sim.simulation.physics import pybullet; pybullet.DIRECT; print("after")'
    environment = {'PYTHONPATH': str(SOURCE), 'PATH': ''}
    result = subprocess.run([sys.executable, '-c', script], env=environment, capture_output=True, text=True)
    assert (result.stdout, result.stderr) == ('after\n', '')


# Run a command where PyBullet cannot be imported.
BEGIN = """
import runpy, sys
sys.modules['pybullet'] = None
sys.argv[:2] = ['diff-encoder-sim']
from diff_encoder_sim.cli.console import main
main()
"""


def run(folder, *arguments):
    environment = {**os.environ, 'PYTHONPATH': str(SOURCE)}
    command = [sys.executable, '-c', BEGIN, '-', *map(str, arguments)]
    return subprocess.run(command, env=environment, cwd=str(folder), capture_output=True, text=True)


@pytest.mark.heavy
@pytest.mark.parametrize(
    'arguments',
    ['check-robot burger', 'campaign --config quick --out results', 'advise --tolerance 0.05 --out results'],
)
def test_a_command_that_simulates_says_in_one_line_what_to_install(arguments, tmp_path):
    done = run(tmp_path, *arguments.split())
    (line,) = done.stderr.splitlines()
    assert done.returncode == 1 and 'PyBullet' in line and 'pip install pybullet' in line and '[sim]' in line
    assert not (tmp_path / 'results').exists()


@pytest.mark.heavy
def test_what_does_not_simulate_works(tmp_path):
    write_bag(tmp_path / 'a.bag', trial())
    world = SOURCE.parent / 'worlds' / 'hallway.world'
    for arguments in (['analyze', 'a.bag'], ['rasterise-world', world, '--out', 'map'], ['reencode', '--help']):
        done = run(tmp_path, *arguments)
        assert (done.returncode, done.stderr) == (0, '')
    assert (tmp_path / 'analysis' / 'report.html').exists() and (tmp_path / 'map.yaml').exists()
