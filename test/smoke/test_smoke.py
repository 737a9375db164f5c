"""Every module and every command runs: these are the tests on Python 3.8; on others, the same is in the other tests."""

import compileall
import importlib
import json
import math
import pkgutil
import subprocess
import sys

import pytest

import diff_encoder_sim
from places import ROOT, SOURCE

SHORT_LINE = ROOT / 'test' / 'rostest' / 'data' / 'short_line.yaml'  # 2 m
ENCODERS = ['amt102', 'hoverboard_hub', 'sen_speed', 'as5600', 'pololu_25d']  # each kind of sensor, and one with a gear


def command(name, *arguments):
    """Run a command as pip installs it; return what it prints."""
    code = f'from diff_encoder_sim.cli.console import main; main({[name, *map(str, arguments)]})'
    done = subprocess.run(
        [sys.executable, '-c', code], env={'PYTHONPATH': str(SOURCE), 'PATH': ''}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(name='results', scope='module')
def fixture_results(tmp_path_factory):
    """A scripted campaign of two encoders with full bags."""
    out = tmp_path_factory.mktemp('smoke') / 'results'
    cells = ['--tests', SHORT_LINE, '--nav', 'scripted', '--ppr', '40', '1024', '--trials', '1', '--record', 'full']
    command('campaign', '--config', 'quick', *cells, '--out', out)
    return out


@pytest.fixture(name='bag', scope='module')
def fixture_bag(results):
    """The bag of its first trial."""
    return results / 'bags' / 'short_line_40_001.bag'


def test_all_files_compile():
    assert all(compileall.compile_dir(str(ROOT / folder), quiet=1, force=True) for folder in ('src', 'test'))


def test_all_modules_but_those_of_nodes_are_imported():
    names = [
        module.name
        for module in pkgutil.walk_packages(diff_encoder_sim.__path__, 'diff_encoder_sim.', onerror=lambda name: None)
        if module.name.split('.')[1] not in ('ros', 'msg', 'cfg')
    ]
    assert len(names) > 100
    for name in names:
        importlib.import_module(name)


def test_campaign(results):
    rows = (results / 'trials.csv').read_text().splitlines()
    assert len(rows) == 3
    assert all('succeeded' in row for row in rows[1:])


def test_analyze(results, tmp_path):
    assert 'short_line' in command('analyze', results, '--out', tmp_path / 'analysis')
    assert (tmp_path / 'analysis' / 'report.html').stat().st_size > 10_000


def test_reencode(bag, tmp_path):
    printed = command('reencode', bag, '--ppr', '40', '4096', '--out', tmp_path / 'out')
    assert '4096' in printed
    assert len(list((tmp_path / 'out').glob('*.bag'))) == 2


@pytest.mark.parametrize('encoder', ENCODERS)
def test_the_chain_of_each_sensor(encoder, bag):
    assert encoder in command('reencode', bag, '--encoder', encoder)


def test_calibrate(tmp_path):
    times_s = [0.1 * row for row in range(300)]
    rows = [f'{time_s},{2.0 * time_s - math.cos(time_s)},{2.0 * time_s},{0.2 * time_s},0.0' for time_s in times_s]
    (tmp_path / 'drive.csv').write_text('\n'.join(['t,left,right,x,y', *rows]))
    columns = ['--columns', 't', 'left', 'right', '--unit', 'rad', '--reference-columns', 't', 'x', 'y']
    command('calibrate', '--csv', tmp_path / 'drive.csv', *columns, '--out', tmp_path / 'robot.yaml')
    assert (tmp_path / 'calibration.html').stat().st_size > 10_000


def test_advise(tmp_path):
    printed = tmp_path / 'advice.json'
    command('advise', '--robot', 'alto', '--no-trials', '--tests', 'SL', '--ppr', '90', '1024', '--json', printed)
    assert json.loads(printed.read_text())


def test_check_robot():
    assert 'all checks are ok' in command('check-robot', 'burger')


def test_rasterise_world(tmp_path):
    command('rasterise-world', ROOT / 'worlds' / 'hallway.world', '--free', '-10', '0', '--out', tmp_path / 'map')
    assert (tmp_path / 'map.yaml').exists()


def test_map_bag(bag, tmp_path):
    command('map-bag', bag, '-f', tmp_path / 'map')
    assert (tmp_path / 'map.yaml').exists()
