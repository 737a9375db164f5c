"""The advice on a recorded drive: a table, a robot file without URDF, its calibration."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from diff_encoder_sim.advice import imu_answer, odometry_answer, odometry_study
from diff_encoder_sim.cli.advise import main
from diff_encoder_sim.robots.wheel_quality import QUALITIES
from drawn_drives import calibrated, rolled
from places import ROOT

TICKS = 100_000
TABLE = ['--columns', 'ms', 'left', 'right', '--time-unit', 'ms', '--ticks-per-revolution', str(TICKS)]
DIAMETER_M, SEPARATION_M = {'left': 0.198, 'right': 0.2}, 0.5
WHEELS = {'config.wheel_diameter': DIAMETER_M, 'config.wheel_separation': SEPARATION_M}


@pytest.fixture(autouse=True)
def table(tmp_path, monkeypatch):
    """A table of counts of a straight line of 20 m, on wheels of two diameters; few draws."""
    few = [(odometry_answer, 'DRAWS', 400), (odometry_answer, 'FINE_DRAWS', 2000), (odometry_study, 'LISTED_DRAWS', 50)]
    for module, name, number in few:
        monkeypatch.setattr(module, name, number)
    ways_m = rolled(('straight', 20.0), separation_m=SEPARATION_M, speed=2.0, acceleration=2.0).rolled.ways_m[::5]
    counts = np.rint(ways_m / (math.pi * np.array(list(DIAMETER_M.values()))) * TICKS).astype(int)
    rows = [f'{50 * index},{left},{right}' for index, (left, right) in enumerate(counts.tolist())]
    (tmp_path / 'line.csv').write_text('\n'.join(['ms,left,right', *rows]))
    monkeypatch.chdir(tmp_path)


def advise(robot, *arguments):
    """The JSON of an advice on the table, for the content of a robot file."""
    with open('chair.yaml', 'w', encoding='utf-8') as file:
        yaml.safe_dump(robot, file)
    main(['--drive', 'line.csv', *TABLE, '--robot', 'chair.yaml', '--json', 'advice.json', *arguments])
    with open('advice.json', encoding='utf-8') as file:
        return json.load(file)


def test_a_recorded_line_needs_the_counts_of_the_closed_form(capsys):
    advice = advise({'set': WHEELS, 'ppr': 1000.5})
    assert advice['robot'] == {'name': 'chair', 'own_ppr': 1000.5}
    counts = 347.3 * 0.4 / SEPARATION_M * 0.199 / 0.2  # ALTO's, by separation and mean diameter
    assert advice['answers']['odometry']['smallest_ppr'] == pytest.approx(counts, rel=0.06)
    assert 0.9 * counts < advice['closed_form_ppr']['line'] < counts  # of a line that ends some counts askew
    assert advice['assumptions'] == 'exact wheels; no slip; line as recorded, repeated'
    assert f'assumes {advice["assumptions"]}' in ' '.join(capsys.readouterr().out.split())
    assert any(each['name'] == 'own of chair' for each in advice['encoders']) and advice['trials'] == []


def test_a_recorded_drive_with_an_imu_from_a_file(monkeypatch):
    monkeypatch.setattr(imu_answer, 'MOST_DRAWS', 50)
    Path('mine.yaml').write_text((ROOT / 'config' / 'imu' / 'stim300.yaml').read_text(encoding='utf-8'))
    advice = advise({'set': WHEELS}, '--imu', 'mine.yaml', '--ppr', '250')
    fused = advice['answers']['odometry_with_imu']
    assert (fused['imu'], fused['smallest_ppr']) == ('mine', 10.0) and '; 250 counts equal ' in fused['text']
    assert 'as recorded, repeated; with an IMU: 10 s at rest first' in advice['assumptions']


def test_slip_by_motion_is_in_the_answer_and_wheel_spin_named_as_left_out():
    slip = 'simulator.wheel_errors.slip'
    spinning = advise({'set': {**WHEELS, f'{slip}.spin_travel': 0.01}}, '--ppr', '250')
    assert spinning['assumptions'].startswith('exact wheels; the slip of the robot file, without wheel spin; ')
    bumpy = advise({'set': {**WHEELS, f'{slip}.bump_travel': 0.01}}, '--ppr', '250')
    assert 'wheel slip' in [limit['cause'] for limit in bumpy['answers']['odometry']['limit']]


def test_a_calibration_is_in_the_answer_the_budget_and_the_assumptions():
    calibration = calibrated(scale=0.003, ratio=1e-4, turning=5e-4, slip_m2_per_m=1e-6).model_dump(exclude_none=True)
    advice = advise({'set': WHEELS, 'calibration': calibration}, '--ppr', '20', '250')
    answer = advice['answers']['odometry']
    assert answer['kind'] == 'not_the_limit' and advice['wheels'] == 'robot_file'
    by_wheels = advice['answers_by_wheels']
    assert list(by_wheels) == ['robot_file', *QUALITIES] and by_wheels['robot_file'] == advice['answers']
    assert 'wheel radius' in [limit['cause'] for limit in by_wheels['measured']['odometry']['limit']]
    causes = [limit['cause'] for limit in answer['limit']]
    assert causes == ['wheel slip', 'calibration (scale)', 'calibration (ratio of radii)']
    ratio_to = 'ratio of radii to 0.02 %, radius / separation to 0.098 %, scale to 0.59 %'
    assert advice['assumptions'].startswith(f'wheels and slip as calibrated on 1 drive: {ratio_to}; ')
    coarse, fine = (each['position_fractions'] for each in advice['budgets']['line'] if each['ppr'] in (20.0, 250.0))
    assert sum(coarse.values()) == pytest.approx(1.0, abs=0.1)
    assert coarse['quantisation'] > 0.85 and fine['quantisation'] < 0.5
    # Independent parts: quantisation falls with the square of the counts.
    of_others = (1.0 - coarse['quantisation']) / coarse['quantisation'] * (250 / 20) ** 2
    assert (1.0 - fine['quantisation']) / fine['quantisation'] == pytest.approx(of_others, rel=0.3)
    calibration['undetermined'] = ['wheel_separation_m', 'radius_per_separation']
    advice = advise({'set': WHEELS, 'calibration': calibration}, '--ppr', '20')
    assert 'ratio of radii to 0.02 %, radius / separation nominal, scale to 0.59 %; ' in advice['assumptions']


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (['--drive', 'line.csv'], 'line.csv: a table is given without --columns; expected --columns TIME LEFT RIGHT'),
        (['--ticks', '/l', '/r'], '--ticks: given without --drive; expected --drive BAG|TABLE'),
        (['--drive', 'line.csv', *TABLE, '--tests', 'SL'], '--tests: given with --drive, which has no trials'),
        (['--drive', 'line.csv', *TABLE, '--trials', '40'], '--trials: given with --drive, which has no trials'),
        (['--drive', 'line.csv', *TABLE, '--ticks', '/l', '/r'], '--ticks, --csv: given both'),
        (['--drive', 'none.bag'], 'none.bag: no such bag'),
    ],
)
def test_a_bad_option_is_one_line(arguments, message):
    with pytest.raises(SystemExit, match=message.replace('|', r'\|')):
        main(arguments)
