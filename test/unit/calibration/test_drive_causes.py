"""The causes of the error of generated drives are those with which they were made."""

import math

import numpy as np
import pytest

from calibration_drives import TrueRobot, referenced_drive
from diff_encoder_sim.calibration.drive_causes import GROUPS, ComparedDrive, EncoderError, find_causes
from diff_encoder_sim.calibration.umbmark import WheelGeometry
from diff_encoder_sim.drives.comparison import SensorPlace

GOOD = TrueRobot(0.2, 0.2, 0.4, 0.0, 0.0, 0.0, 0.0, 1e-7, 1e-7)
COARSE, FINE = EncoderError('40 counts', 1e-5, 0.1), EncoderError('4096 counts', 1e-9, 0.1)


def causes_of(robot, assumed=(0.2, 0.2, 0.4), duration_s=60.0, recorded=None, encoders=(COARSE, FINE), **known):
    drive = referenced_drive(robot, np.random.default_rng(1), duration_s)
    about = {'geometry_covariance': np.zeros((3, 3)), 'slip': None, **known}
    compared = ComparedDrive([drive], WheelGeometry(*assumed), 0.0, SensorPlace(), False, False, **about)
    return find_causes(compared, encoders, recorded)


@pytest.mark.parametrize(('robot', 'assumed', 'group', 'text'), [
    (GOOD, (0.2, 0.2, 0.412), 'calibration', 'degrees per turn: check the wheel separation: 0.97'),
    (GOOD._replace(right_wheel_diameter_m=0.202), (0.2, 0.2, 0.4), 'calibration', 'degrees per metre: check'),
    (GOOD, (0.204, 0.204, 0.4), 'calibration', 'distances are +1.99 % off'),
    (GOOD._replace(slip_m2_per_m=3e-5), (0.2, 0.2, 0.4), 'slip', 'cause: wheel slip'),
    (GOOD._replace(noise_m=0.03, noise_rad=0.03), (0.2, 0.2, 0.4), 'reference', 'cause: noise of the reference'),
    (GOOD._replace(reference_x_m=-0.2), (0.2, 0.2, 0.4), 'place of the reference', 'give --reference-pose -0.2'),
])  # fmt: skip
def test_the_largest_cause_is_named_and_its_part_of_the_error_the_largest(robot, assumed, group, text):
    found = causes_of(robot, assumed)
    assert text in ' '.join(found.conclusion)
    assert max(GROUPS, key=found.budgets[1].get) == group
    assert (found.corrected is not None) == (group in ('calibration', 'place of the reference'))


def test_only_an_encoder_that_makes_much_of_the_error_is_a_cause():
    first = causes_of(GOOD, (0.2, 0.2, 0.43)).conclusion[0]
    assert first.startswith('The encoder is not the cause: the error over the drive is 0.1 m with 40 counts, 0.1 m')
    first = causes_of(GOOD, encoders=(COARSE._replace(quantisation_m2=0.1), FINE)).conclusion[0]
    assert first.startswith('The encoder is the main cause with 40 counts: ') and '; with 4096 counts, 0 %' in first
    recorded = EncoderError('20 counts', 1e-2, 0.0)
    first = causes_of(GOOD._replace(counts=20), recorded=recorded).conclusion[0]
    assert first.startswith('The recorded encoder is the main cause with 20 counts')


def test_errors_within_the_intervals_of_a_robot_file_are_those_of_the_calibration_and_the_slip():
    variance, slip = 0.003**2, (1e-7, 1e-7)
    found = causes_of(GOOD, (0.2, 0.2006, 0.4), geometry_covariance=variance * np.eye(3), slip=slip)
    assert 'interval of the calibration' in found.conclusion[2] and found.corrected is None
    assert found.budgets[1]['calibration'] > 0.5 * sum(found.budgets[1].values())


def test_a_drive_that_determines_nothing_leaves_the_rest_unexplained():
    found = causes_of(GOOD, duration_s=11.0)
    assert found.conclusion[1].startswith('The other causes are unknown: drive: given ')
    assert math.isclose(found.budgets[1]['rest'] + FINE.quantisation_m2, sum(found.budgets[1].values()))
