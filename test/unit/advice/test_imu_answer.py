"""Odometry fused with a gyroscope: against closed forms, only wheels, and the counts of equal error."""

import math

import numpy as np
import pytest

from diff_encoder_sim.advice import imu_answer as module
from diff_encoder_sim.advice.answers import Requirement
from diff_encoder_sim.advice.drive_draws import CONTACT, SEPARATION, DriveDraws
from diff_encoder_sim.advice.fused_draws import FUSED_CAUSES, GYROSCOPE, STANDSTILL_S, FusedDraws
from diff_encoder_sim.advice.imu_answer import Estimate, imu_answer
from diff_encoder_sim.advice.odometry_answer import QUANTISATION, OdometryCurves
from diff_encoder_sim.analysis.closed_form import crossover_counts, gyro_heading_std_rad, wheels_heading_std_rad
from diff_encoder_sim.analysis.results_table import RobotGeometry
from diff_encoder_sim.navigation.goal_stopping import StopSpread
from diff_encoder_sim.robots.wheel_quality import CALIBRATED, EXACT
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from drawn_drives import encoder_of, robot_of, rolled
from encoder_drives import RADIUS_M, SEPARATION_M
from fusion_drives import IMUS

HEADING, RATE_HZ, DRAWS = 2, 20.0, 300
ALTO, NO_DRIFT = RobotGeometry(2.0 * RADIUS_M, SEPARATION_M), np.zeros(1)
STOP = StopSpread(0.1, 0.1)  # ends that differ by more than a count


def draws_of(*segments, **errors):
    return DriveDraws(rolled(*segments, name='drive', speed=0.1), robot_of(stop=STOP, **errors), 1)


def heading_rms(errors):
    return math.sqrt(np.mean(errors[:, HEADING] ** 2))


@pytest.mark.parametrize('name', IMUS)
def test_integrated_rates_drift_by_the_closed_form(name):
    draws = draws_of(('straight', 10.0))
    fused = FusedDraws(draws, IMUS[name], RATE_HZ)
    rates, true_rates = (fused.rates_radps(0, 500, each) for each in (FUSED_CAUSES, {}))
    errors = rates - true_rates
    at_rest = round(STANDSTILL_S * RATE_HZ)
    drift_rad = (errors[:, at_rest:] - errors[:, :at_rest].mean(axis=1, keepdims=True)).sum(axis=1) / RATE_HZ
    std_rad = gyro_heading_std_rad(IMUS[name], STANDSTILL_S, draws.drive.rolled.times_s[-1:])
    assert drift_rad.std() == pytest.approx(std_rad[0], rel=0.1)


@pytest.mark.parametrize('name', ['bno055', 'stim300'])
def test_the_gyroscope_is_the_limit_if_diameters_are_unknown(name):
    draws = draws_of(('straight', 5.0), radius_spread=0.01)
    (errors,) = FusedDraws(draws, IMUS[name], RATE_HZ).errors([encoder_of(1024)], DRAWS, FUSED_CAUSES)
    std_rad = gyro_heading_std_rad(IMUS[name], STANDSTILL_S, draws.drive.rolled.times_s[-1:])
    assert heading_rms(errors) == pytest.approx(std_rad[0], rel=0.1)


@pytest.mark.parametrize(('slip', 'difference'), [(0.0, 0.0), (1e-7, 0.0), (0.0, 1e-4)])
def test_encoder_and_gyroscope_are_equal_at_the_crossover(slip, difference):
    draws = draws_of(('straight', 5.0), slip_noise=slip, radius_spread=difference / math.sqrt(2.0))
    time_s, distance_m = draws.drive.rolled.times_s[-1:], np.array([5.0])
    gyro_rad = gyro_heading_std_rad(IMUS['bno055'], STANDSTILL_S, time_s)
    wheels_rad = wheels_heading_std_rad(ALTO, math.inf, distance_m, slip, difference)
    (counts,) = crossover_counts(ALTO, gyro_rad, wheels_rad)
    (errors,) = draws.errors([encoder_of(round(counts))], 2000)
    assert heading_rms(errors) == pytest.approx(gyro_rad[0], rel=0.1)
    assert np.isinf(crossover_counts(ALTO, gyro_rad, wheels_rad + gyro_rad))


@pytest.mark.parametrize('name', IMUS)
@pytest.mark.parametrize('segment', [('straight', 2.0), ('turns', 1.0)])
def test_fused_heading_is_at_most_as_uncertain_as_by_the_wheels(name, segment):
    draws = draws_of(segment, **CALIBRATED.errors)
    (errors,) = draws.errors([encoder_of(90)], DRAWS)
    (fused,) = FusedDraws(draws, IMUS[name], RATE_HZ).errors([encoder_of(90)], DRAWS, FUSED_CAUSES)
    assert heading_rms(fused) < 1.1 * heading_rms(errors)


def test_accelerations_do_not_pass_for_errors_of_distances():
    """Nothing measures the mean radius: the line is wrong by its error only."""
    draws = draws_of(('straight', 5.0), radius_spread=0.01)
    (errors,) = FusedDraws(draws, IMUS['mpu6050'], RATE_HZ).errors([encoder_of(1024)], DRAWS, FUSED_CAUSES)
    assert math.sqrt(np.mean(errors[:, 0] ** 2)) < 1.6 * 5.0 * 0.01 / math.sqrt(2.0)


@pytest.fixture(scope='module')
def answer():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, 'MOST_DRAWS', 100)
        draws = draws_of(('straight', 5.0))
        curves = OdometryCurves([draws], EncoderParams())
        return imu_answer('stim300', IMUS['stim300'], EXACT, curves, Requirement(), RATE_HZ, [77.0, 500.0], True)


def test_counts_with_an_imu_are_worth_more(answer):
    (curve,) = answer.curves
    assert list(curve.equal) == sorted([*module.COUNTS, 77.0, 500.0]) and answer.draws == 100
    for equal in curve.equal.values():
        assert equal.low <= equal.counts <= equal.high
    assert curve.equal[77.0].low > 200.0
    assert f'77 counts equal {curve.equal[77.0]} without IMU over 5 m in 5' in str(answer)


def test_the_budget_shows_what_remains_of_the_wheels_errors():
    draws = draws_of(('turns', 3.0), **CALIBRATED.errors)
    curves = OdometryCurves([draws], EncoderParams())
    made = imu_answer('stim300', IMUS['stim300'], CALIBRATED, curves, Requirement(), RATE_HZ, [90.0], True)
    (without, with_imu) = made.budgets['drive']
    assert {*with_imu.parts} == {QUANTISATION, *draws.causes, GYROSCOPE} - {CONTACT}
    # The scale error of 0.05 % is half of the error of the separation.
    ratio = with_imu.parts[SEPARATION].std[HEADING] / without.parts[SEPARATION].std[HEADING]
    assert ratio == pytest.approx(0.2, abs=0.1)
    assert 'wheel separation in drive: 0.' in made.compensated


@pytest.mark.parametrize(
    ('equal', 'text'),
    [
        (Estimate(800.0, 700.0, 900.0), 'equal 800 (700 to 900) without IMU'),
        (Estimate(math.inf, math.inf, math.inf), 'are better than any without IMU'),
        (Estimate(80.0, 70.0, 95.0), 'are not better than without IMU'),
    ],
)
def test_an_imu_that_does_not_help_is_named(answer, equal, text):
    curve = answer.curves[0]._replace(equal={90.0: equal})
    assert f'90 counts {text} over' in str(answer._replace(counts=90.0, curves=[curve]))


@pytest.mark.parametrize(
    ('smallest', 'text'),
    [
        ((10.0, 10.0, 10.0), '10 counts per wheel turn suffice'),
        ((35.0, 30.0, 40.0), 'at least 35 counts per wheel turn (between 30 and 40)'),
        ((35.0, 30.0, math.inf), 'the success rate is near the required one'),
        ((math.inf, math.inf, math.inf), 'even 4096 counts do not suffice'),
    ],
)
def test_lowest_counts_in_words(answer, smallest, text):
    assert str(answer._replace(smallest=Estimate(*smallest))).startswith(text)
