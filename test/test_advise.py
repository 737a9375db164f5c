"""The advise command on real worker processes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
CANDIDATES = ['--tests', 'SL', 'SMT', '--ppr', '1024', '40', '90', '256', '--trials', '16', '--workers', '1']

pytestmark = pytest.mark.timeout(120)


def advise(*arguments, cwd):
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join([str(HERE), *filter(None, sys.path)])}
    return subprocess.run(
        [sys.executable, str(HERE / 'advise_trials.py'), *map(str, arguments)],
        cwd=str(cwd),
        env=environment,
        capture_output=True,
        text=True,
    )


@pytest.fixture(scope='module')
def first(tmp_path_factory):
    folder = tmp_path_factory.mktemp('advise')
    return folder, advise(*CANDIDATES, cwd=folder)


def test_the_answer_names_the_smallest_encoder_by_each_question(first):
    _, done = first
    assert done.returncode == 0, done.stderr
    # 10 m / 256 is within 0.05 m, 10 m / 90 is not.
    assert done.stdout.splitlines()[-4:] == [
        'Yes in every test:',
        '  true pose at the goal: from 40 PPR on, the smallest candidate',
        '  pose estimate at the goal: from 40 PPR on, the smallest candidate',
        '  odometry at the true pose: from 256 PPR on',
    ]
    assert '0/16 no' in done.stdout and '16/16 yes' in done.stdout


def test_the_same_command_again_runs_nothing(first):
    folder, done = first
    rows = (folder / 'results' / 'advice' / 'trials.csv').read_text()
    again = advise(*CANDIDATES, cwd=folder)
    assert (again.returncode, again.stdout) == (0, done.stdout)
    assert 'trials,' not in again.stderr
    assert (folder / 'results' / 'advice' / 'trials.csv').read_text() == rows


def test_another_tolerance_goes_on_with_the_same_trials(first):
    folder, _ = first
    finer = advise(*CANDIDATES, '--tolerance', '0.015', cwd=folder)
    assert finer.stdout.splitlines()[-3:] == [
        '  true pose at the goal: with no encoder up to 1024 PPR',
        '  pose estimate at the goal: with no encoder up to 1024 PPR',
        '  odometry at the true pose: from 1024 PPR on',
    ]
    assert 'advise: stopping: precise drives up to within about 6 mm' in finer.stderr


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (['--trials', '15'], '--trials: given 15; allowed: from 16'),
        (['--tolerance', '0'], "given '0'; allowed: 1e-6 to 1000 [m]"),
        (
            ['--candidates', 'nothing'],
            "given 'nothing'; allowed: accurate, faults, paper, paper_tb3, quick, sweep, or a .yaml file",
        ),
        (['--robot', 'nothing.yaml'], 'nothing.yaml'),
    ],
)
def test_a_mistake_is_one_line_and_leaves_nothing(arguments, message, tmp_path):
    done = advise(*CANDIDATES, *arguments, cwd=tmp_path)
    assert done.returncode != 0 and done.stdout == ''
    assert message in done.stderr.splitlines()[-1]
    assert list(tmp_path.iterdir()) == []


def test_candidates_have_equal_wheels(tmp_path):
    (tmp_path / 'mixed.yaml').write_text('name: mixed\ntests: [SL]\nppr: [40, {left: 90, right: 1024}]\n')
    done = advise('--candidates', 'mixed.yaml', cwd=tmp_path)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == 'advise: ppr: given 90-1024; allowed: one number for both wheels'


def test_real_encoders_are_all_tried_and_those_that_suffice_named(tmp_path):
    real = ['--tests', 'SL', '--encoders', 'amt102', 'hoverboard_hub', '--trials', '16', '--workers', '1']
    done = advise(*real, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    # 10 m / 8192 is within 0.05 m, 10 m / 90 is not.
    assert done.stdout.splitlines()[-3:] == [
        '  true pose at the goal: with hoverboard_hub (90 counts) and amt102 (8192 counts)',
        '  pose estimate at the goal: with hoverboard_hub (90 counts) and amt102 (8192 counts)',
        '  odometry at the true pose: with amt102 (8192 counts)',
    ]
    assert 'advise: amt102 (CUI Devices AMT102-V, at 2048 PPR): 2048 lines x 4 = 8192 counts' in done.stderr
