"""The advise command on real worker processes."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from diff_encoder_sim.cli.advise import main
from urdf_texts import ball, base, pair, robot

HERE = Path(__file__).resolve().parent
CANDIDATES = ['--tests', 'SL', '--ppr', '1024', '40', '90', '360', '--workers', '1']

pytestmark = pytest.mark.timeout(120)


def advise(*arguments, cwd):
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join([str(HERE), *filter(None, sys.path)])}
    command = [sys.executable, str(HERE / 'advise_trials.py'), *map(str, arguments)]
    return subprocess.run(command, cwd=str(cwd), env=environment, capture_output=True, text=True)


def answers(done):
    """The last of the answers that were printed, by their beginnings."""
    unfilled = re.sub(r'\n {4}(?=\S)', ' ', done.stdout)
    return dict(re.findall(r'^  (\w[\w ,.%]+): (.*)$', unfilled, re.MULTILINE))


@pytest.fixture(scope='module')
def first(tmp_path_factory):
    folder = tmp_path_factory.mktemp('advise')
    return folder, advise(*CANDIDATES, '--json', 'advice.json', cwd=folder)


def test_odometry_is_answered_first_and_then_what_trials_show(first):
    _, done = first
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0] == 'alto: at least 80 % of the trials within 0.05 m in x and y and 3 degrees'
    assert lines[1].startswith('  odometry with exact wheels: at least 3')
    assert "\n  assumes exact wheels; no slip; SL on the simulator's level floor, with its grip;" in done.stdout
    assert '  the same in closed form, for quantisation only: SL 347' in lines
    assert 'advise: first answer after' in done.stderr
    found = answers(done)
    assert found['true pose at the goal'] == 'at least 90 counts per wheel turn; 40 do not suffice'
    assert found['pose estimate at the goal'] == 'at least 40 counts per wheel turn, the coarsest candidate'
    assert 'Error budget' in done.stdout and 'Encoders on these wheels' in done.stdout
    assert "The robot's own encoder has 90 counts per wheel turn." in done.stdout


def test_all_of_it_is_in_the_json_and_on_the_page(first):
    folder, done = first
    content = json.loads((folder / 'advice.json').read_text())
    assert content['answers']['odometry']['encoder'] == '360'
    assert content['answers']['truth']['smallest_ppr'] == 90.0
    assert 'Which encoder for alto?' in (folder / 'results' / 'advice' / 'advice.html').read_text()
    assert done.stdout.splitlines()[-2:] == ['Page: results/advice/advice.html', 'JSON: advice.json']


def test_the_same_command_again_runs_nothing(first):
    folder, done = first
    rows = (folder / 'results' / 'advice' / 'trials.csv').read_text()
    again = advise(*CANDIDATES, '--json', 'advice.json', cwd=folder)
    assert (again.returncode, again.stdout) == (0, done.stdout) and 'trials,' not in again.stderr
    assert (folder / 'results' / 'advice' / 'trials.csv').read_text() == rows


def test_another_tolerance_goes_on_with_the_same_trials_and_names_what_limits(first):
    folder, _ = first
    finer = answers(advise(*CANDIDATES, '--tolerance', '0.015', cwd=folder))
    limit = 'the encoder is not the limit: stopping makes 20 mm sideways in SL, 15 mm allowed; '
    assert finer['pose estimate at the goal'].startswith(limit)


def test_trials_have_the_wheels_that_are_asked_for(tmp_path):
    done = advise(*CANDIDATES, '--wheels', 'calibrated', '--json', 'advice.json', cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    content = json.loads((tmp_path / 'advice.json').read_text())
    assert content['wheels'] == 'calibrated' and content['answers_by_wheels']['calibrated'] == content['answers']
    assert content['answers']['truth']['kind'] == 'from' and list(content['answers_by_wheels']['exact']) == ['odometry']
    manifest = json.loads((tmp_path / 'results' / 'advice' / 'manifest.json').read_text())
    errors = manifest['configuration']['parameters'][0]['simulator']['wheel_errors']
    assert (errors['radius_spread'], errors['wheel_separation_spread']) == pytest.approx((0.000707, 0.001), abs=1e-6)


def test_without_trials_there_is_odometry_alone(tmp_path):
    done = advise('--no-trials', '--distance', '10', '--share', '0.95', '--ppr', '90', cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = answers(done)
    assert found['odometry with exact wheels'].endswith('; no candidate suffices')
    assert ' hold for ' in found['odometry with wheels calibrated to 0.1 %'] and 'true pose at the goal' not in found
    assert found['the same in closed form, for quantisation only'] == '10 m straight 244'
    files = {path.name for path in (tmp_path / 'results' / 'advice').iterdir()}
    assert files == {'advice.html', 'advice.json', 'ros1.yaml', 'ros2.yaml'}


def test_without_trials_no_laser_is_needed(tmp_path):
    """A drive that can only be navigated takes a laser that a warning proposes; trials need one of the user."""
    (tmp_path / 'blind.urdf').write_text(robot(base(), pair(), ball('caster', 0.12)))
    blind = ['--robot', 'blind.urdf', '--no-trials', '--json', 'advice.json']
    done = advise('--tests', 'SL', *blind, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    answer = json.loads((tmp_path / 'advice.json').read_text())['answers']['odometry']
    assert answer['kind'] == 'from'
    assert answer['smallest_ppr'] == pytest.approx(232.0, rel=0.05)  # in closed form, of quantisation
    done = advise('--tests', 'SL', '--robot', 'blind.urdf', cwd=tmp_path)
    (line,) = done.stderr.splitlines()
    assert done.returncode == 1 and line.startswith('advise: blind.urdf: ') and 'laser: {parent: ' in line


def encoder_file(path, lines, **errors):
    """An encoder of four times as many counts, with its own errors."""
    model = {'lines': lines, 'decoding': 'x4', **errors}
    about = {'manufacturer': 'a', 'part': path.stem, 'type': 'kit', 'price': 'hobby', 'source': ['a test']}
    path.write_text(json.dumps({**about, 'encoder': model}))
    return path.name


@pytest.mark.long
def test_errors_of_a_given_encoder_are_named(tmp_path):
    poor = encoder_file(tmp_path / 'poor.yaml', 512, faults={'missed': 0.02})
    files = ['--encoders', poor, encoder_file(tmp_path / 'few.yaml', 20)]
    done = advise('--no-trials', '--tests', 'SL', *files, '--json', 'advice.json', cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    content = json.loads((tmp_path / 'advice.json').read_text())
    answer, listed = content['answers']['odometry'], {each['name']: each for each in content['encoders']}
    assert (answer['kind'], answer['errors_of'], answer['encoder']) == ('not_the_limit', '2048 poor', None)
    for limited in (answer, listed['poor']):
        assert [limit['cause'] for limit in limited['limit']] == ['missed counts']
    (budget,) = [each for each in content['budgets']['SL'] if each['ppr'] == 2048.0]
    assert 'missed counts' in budget['parts']
    assert listed['poor']['meets']['odometry'] is False and listed['few']['limit'] == []


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        ('--trials 0', "given '0'; allowed: a whole number, 1 to 1000000"),
        ('--trials 20', '--trials: given 20; allowed: at least 21'),
        ('--distance 10', '--distance: given 10, but trials drive the tests; allowed: --no-trials'),
        ('--json missing/a.json', "--json: given 'missing/a.json'; allowed: a file in a folder that exists"),
        ('--candidates nothing', "given 'nothing'; allowed: accurate, faults, paper, paper_tb3, quick, sweep, or"),
        ('--robot nothing.yaml', 'nothing.yaml'),
        ('--config burger', '--config: given without --drive; expected --drive BAG|TABLE'),
    ],
)
def test_a_bad_argument_is_one_line_and_leaves_nothing(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main([*CANDIDATES, *arguments.split()])
    printed = capsys.readouterr()
    assert printed.out == '' and ended.value.code not in (0, None)
    assert message in (printed.err.splitlines()[-1] if ended.value.code == 2 else ended.value.code)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
def test_real_encoders_are_ordered_by_what_they_are_worth(tmp_path):
    real = ['--tests', 'SL', '--encoders', 'amt102', 'hoverboard_hub', '--workers', '1']
    done = advise(*real, '--json', 'advice.json', cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    content = json.loads((tmp_path / 'advice.json').read_text())
    assert content['answers']['odometry']['encoder'] == '8192 amt102'
    assert content['answers']['truth']['encoder'] == '90 hoverboard_hub'
    assert 'advise: amt102 (CUI Devices AMT102-V, at 2048 lines): 2048 lines x 4 = 8192 counts' in done.stderr
