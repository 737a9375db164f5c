"""The advice on two numbers, diameter and separation, and on wheels of a quality: against closed forms."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from diff_encoder_sim.advice import imu_answer, odometry_answer, odometry_study
from diff_encoder_sim.advice.answers import Requirement
from diff_encoder_sim.api.options import AdviceOptions
from diff_encoder_sim.api.recorded_advice import robot_of_numbers
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.cli.advise import main
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.particles import move_particles
from diff_encoder_sim.robots.wheel_quality import QUALITIES
from drawn_drives import encoder_of

DIAMETER_M, SEPARATION_M, DISTANCE_M, TOLERANCE_M = 0.2, 0.45, 10.0, 0.05
NUMBERS = ['--wheel-diameter', str(DIAMETER_M), '--wheel-separation', str(SEPARATION_M)]
NORMAL_80 = 1.2816  # 80 % of all errors are within +- this many standard deviations
ACROSS = 1


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    for module, name, number in [(odometry_answer, 'FINE_DRAWS', 4000), (odometry_study, 'LISTED_DRAWS', 50)]:
        monkeypatch.setattr(module, name, number)
    monkeypatch.chdir(tmp_path)


def advise(*arguments):
    """The JSON of an advice on two numbers."""
    main([*NUMBERS, '--json', 'advice.json', *arguments])
    with open('advice.json', encoding='utf-8') as file:
        return json.load(file)


def test_two_numbers_are_enough(capsys):
    advice = advise()
    # Two phases across: 1 - (1 - c)^2 = 0.8 with c = tol L / (S d).
    counts = (1.0 - math.sqrt(0.2)) * DISTANCE_M * math.pi * DIAMETER_M / (SEPARATION_M * TOLERANCE_M)
    assert advice['robot'] == {'name': '0.2 m wheels, 0.45 m apart', 'own_ppr': None}
    assert advice['answers']['odometry']['smallest_ppr'] == pytest.approx(counts, rel=0.05)
    assert advice['closed_form_ppr']['10 m straight'] == pytest.approx(counts, rel=1e-3)
    assert list(advice['closed_form_ppr']) == ['10 m straight', '1 turn in place'] and advice['trials'] == []
    assert advice['assumptions'].startswith('exact wheels; no slip; 10 m straight and 1 turn in place, from rest')
    assert advice['wheels'] == 'exact' and list(advice['answers_by_wheels']) == list(QUALITIES)
    assert advice['answers_by_wheels']['exact'] == advice['answers']
    printed = capsys.readouterr().out
    assert printed.splitlines()[1].startswith('  odometry with exact wheels: at least 15')
    assert '\n  most effective improvement: ratio of the radii to 0.01' in printed


@pytest.mark.parametrize(('wheels', 'most'), [('exact', 8.0), ('calibrated', 1.7), ('uncalibrated', 1.2)])
def test_particles_with_the_alphas_of_ros1_yaml_spread_at_least_as_the_sampled_odometry(wheels, most):
    """After 10 m and a turn; with exact wheels further, as each of 50 updates has the rounding of two readings."""
    advise('--wheels', wheels)
    amcl = yaml.safe_load(Path('results/advice/ros1.yaml').read_text())['amcl']
    robot = robot_of_numbers(AdviceOptions(wheel_diameter=DIAMETER_M, wheel_separation=SEPARATION_M))
    line, turn = robot.by_wheels()[QUALITIES[wheels]]
    params, rng = AmclParams(**amcl), np.random.default_rng(1)
    steps = {'line': (Pose2D(amcl['update_min_d'], 0.0, 0.0), 50), 'turn': (Pose2D(0.0, 0.0, amcl['update_min_a']), 12)}
    spreads = {}
    for name, (step, count) in steps.items():
        particles = np.zeros((2000, 3))
        for _ in range(count):
            particles = move_particles(particles, Pose2D(0.0, 0.0, 0.0), step, params, rng)
        spreads[name] = particles.std(axis=0)
    of_line, of_turn = (draws.errors([encoder_of(180)], 2000)[0].std(axis=0) for draws in (line, turn))
    ratios = np.append(spreads['line'] / of_line, spreads['turn'][2] / of_turn[2])
    assert ratios.min() > 0.95 and ratios.max() < most


@pytest.mark.parametrize('counts', [90, 360])
def test_quantisation_on_a_straight_line_is_its_closed_form(counts):
    """The lateral standard deviation is (S d / L) sqrt(1/6)."""
    options = AdviceOptions(wheel_diameter=DIAMETER_M, wheel_separation=SEPARATION_M, distance=DISTANCE_M, turns=0.0)
    (draws,) = robot_of_numbers(options).tests
    (errors,) = draws.errors([encoder_of(counts)], 4000)
    pulse_m = math.pi * DIAMETER_M / counts
    assert errors[:, ACROSS].std() == pytest.approx(DISTANCE_M * pulse_m / SEPARATION_M / math.sqrt(6.0), rel=0.04)


@pytest.mark.parametrize('wheels', ['calibrated', 'measured', 'uncalibrated'])
def test_wheels_are_the_limit_by_the_closed_form(wheels):
    """A ratio of radii that is off by e moves the end by e S^2 / (2 L), which also shows how far a tolerance holds."""
    advice = advise('--turns', '0', '--wheels', wheels)
    error, (answer,) = NORMAL_80 * QUALITIES[wheels].std, advice['answers'].values()
    assert (advice['wheels'], answer['kind'], answer['limit'][0]['cause']) == (wheels, 'not_the_limit', 'wheel radius')
    assert answer == advice['answers_by_wheels'][wheels]['odometry']
    reach = answer['reach']
    assert (reach['axis'], reach['tolerance'], reach['after']) == ('across', TOLERANCE_M, [pytest.approx(10.0), 0.0])
    assert reach['error'] == pytest.approx(error * DISTANCE_M**2 / (2.0 * SEPARATION_M), rel=0.08)
    assert reach['holds_for'][0] == pytest.approx(math.sqrt(2.0 * SEPARATION_M * TOLERANCE_M / error), rel=0.05)
    assert advice['assumptions'].startswith(QUALITIES[wheels].text)


def test_turns_are_limited_by_mean_radius_and_separation():
    advice = advise('--distance', '0.5', '--turns', '3')
    reach = advice['answers_by_wheels']['uncalibrated']['odometry']['reach']
    std = QUALITIES['uncalibrated'].std * math.hypot(0.5, 1.0)  # of the mean radius over the separation
    assert (reach['test'], reach['axis']) == ('3 turns in place', 'heading')
    assert reach['error'] == pytest.approx(NORMAL_80 * std * 6.0 * math.pi, rel=0.08)
    assert reach['holds_for'][1] == pytest.approx(math.radians(3.0) / (NORMAL_80 * std), rel=0.08)


def test_many_turns_are_as_good_as_few():
    within = []
    for turns in (2.0, 20.0):
        options = AdviceOptions(wheel_diameter=DIAMETER_M, wheel_separation=SEPARATION_M, turns=turns)
        errors = robot_of_numbers(options).tests[1].errors([encoder_of(40)], 500)[0]
        within.append(Requirement().within(errors).mean())
    # The heading does not drift by counts, and the robot stays where it turns.
    assert within[1] == pytest.approx(within[0], abs=0.02)


def test_an_imu_replaces_the_calibration_on_a_straight_line(capsys, monkeypatch):
    monkeypatch.setattr(imu_answer, 'MOST_DRAWS', 50)
    advice = advise('--turns', '0', '--wheels', 'calibrated', '--imu', 'mpu6050')
    plain, fused = (advice['answers'][key] for key in ('odometry', 'odometry_with_imu'))
    assert (plain['kind'], fused['kind'], fused['imu']) == ('not_the_limit', 'from', 'mpu6050')
    assert fused['smallest_ppr'] < 40.0 and fused['text'].endswith('better than any without IMU over 10 m in 23 s')
    (budgets,) = advice['imus'][0]['budgets'].values()
    without, with_imu = (budgets[key]['parts']['wheel radius']['across'] for key in ('without', 'with'))
    assert abs(with_imu['variance']) < 0.01 * without['variance']
    printed = ' '.join(capsys.readouterr().out.split())
    assert 'with an IMU: 10 s at rest first, which determine the bias, and 50 sampled drives' in printed
    assert re.search(r'errors with mpu6050: wheel radius in 10 m straight: [0-9.]+ mm instead of 0.11 m', printed)


def test_good_wheels_need_no_improvement():
    advice = advise('--distance', '1')
    exact, calibrated = (advice['answers_by_wheels'][name]['odometry'] for name in ('exact', 'calibrated'))
    assert calibrated['kind'] == 'from' and calibrated['reach'] is None
    assert calibrated['smallest_ppr'] == pytest.approx(exact['smallest_ppr'], rel=0.15)
    assert advice['improvement'] == 'the encoder; wheels calibrated to 0.1 % are good enough'


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        ([*NUMBERS, '--robot', 'alto'], '--robot: given with --wheel-diameter; allowed: one of them'),
        ([*NUMBERS, '--drive', 'a.bag'], '--drive: given with --wheel-diameter; allowed: one of them'),
        ([*NUMBERS, '--tests', 'SL'], '--tests: given with --wheel-diameter; allowed: one of them'),
        ([*NUMBERS, '--trials', '40'], '--trials: given with --wheel-diameter; allowed: one of them'),
        (NUMBERS[:2], '--wheel-diameter, --wheel-separation: given one of them; expected both'),
        (['--turns', '2'], '--turns: given without --wheel-diameter; expected --wheel-diameter and --wheel-sep'),
        (['--wheel-diameter', '-0.2', *NUMBERS[2:]], "argument --wheel-diameter: given '-0.2'; allowed: 0.001 to 100"),
        ([*NUMBERS, '--distance', '-1'], "argument --distance: given '-1'; allowed: 0.1 to 1000"),
        ([*NUMBERS, '--imu'], 'argument --imu: expected at least one argument'),
        ([*NUMBERS, '--imu', 'bno'], "imu: given 'bno'; allowed: bmi088, bno055, mpu6050, stim300, or a .yaml file"),
        ([*NUMBERS, '--imu', 'no.yaml'], "imu: given 'no.yaml'; allowed: bmi088"),
        ([*NUMBERS, '--imu', 'bno055', 'bno055'], "--imu: given 'bno055' twice; allowed: each IMU once"),
        ([*NUMBERS, '--wheels', 'good'], "argument --wheels: invalid choice: 'good'"),
    ],
)
def test_bad_options_are_one_line(arguments, message, tmp_path, capsys):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    printed = capsys.readouterr()
    assert message in (printed.err.splitlines()[-1] if ended.value.code == 2 else ended.value.code)
    assert printed.out == '' and list(tmp_path.iterdir()) == []
