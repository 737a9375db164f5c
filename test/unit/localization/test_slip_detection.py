"""Slip detection: no false alarms in clean drives, spins and lifts of a wheel are found, with limits of closed form."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.localization.fusion import FusionParams, WheelErrors
from diff_encoder_sim.localization.slip_detection import SlipDetector, SlipState
from fusion_drives import IMUS
from slip_drives import clean_drive, detection_s, false_alarms, heading_error, spun_drive

D_M, SEPARATION_M, SECOND_NS, TICK_NS = 0.01, 0.4, 1_000_000_000, 10_000_000
WHEELS = WheelErrors((D_M, D_M), SEPARATION_M)


class Robot:
    """Drives with 100 Hz of an ideal gyroscope, plus a bias, and 20 Hz of counts."""

    def __init__(self, imu=ImuParams(), wheels=WHEELS, bias_radps=0.0):
        self.detector = SlipDetector(FusionParams(), wheels, imu)
        self._bias_radps, self._travels_m, self.stamp_ns = bias_radps, np.array([0.3, 0.6]) * D_M, 0
        self.detector.take_gyro(0, bias_radps)

    def drive(self, seconds, mps=0.0, radps=0.0, slip_mps=(0.0, 0.0), has_gyro=True):
        """Return the state at each report; wheels turn by `slip_mps` more than they travel."""
        states = []
        rims_mps = mps + np.array([-0.5, 0.5]) * SEPARATION_M * radps + slip_mps
        for tick in range(1, round(100 * seconds) + 1):
            self.stamp_ns += TICK_NS
            self._travels_m += 0.01 * rims_mps
            if has_gyro:
                self.detector.take_gyro(self.stamp_ns, radps + self._bias_radps)
            if tick % 5 == 0:
                counts = np.floor(self._travels_m / D_M).astype(int).tolist()
                self.detector.take_counts(self.stamp_ns, *counts)
                states.append(self.detector.state)
        return states


def flags(states):
    return [each.is_slipping for each in states]


@pytest.mark.parametrize('imu', IMUS)
def test_clean_drives_cause_no_alarm(imu):
    for ppr, seeds in ((20, range(10)), (4096, range(10, 20))):
        for seed in seeds:
            alarms, ratio = false_alarms(clean_drive(ppr, IMUS[imu], seed))
            assert alarms == 0 and ratio < 0.95, seed


@pytest.mark.parametrize(('ppr', 'imu', 'mps'), [(20, 'mpu6050', 0.25), (40, 'bno055', 0.2), (4096, 'bmi088', 0.1)])
def test_spins_and_lifts_of_half_a_second_are_detected(ppr, imu, mps):
    times_s = [detection_s(ppr, IMUS[imu], mps, seed) for seed in range(20)]
    assert sum(map(math.isfinite, times_s)) >= 19


def test_a_spin_does_not_turn_the_fused_heading():
    for ppr in (20, 1024):
        drives = [spun_drive(ppr, IMUS['mpu6050'], 0.3, seed)[1] for seed in range(6)]
        with_detector, without = (
            np.array([heading_error(drive, has_detector) for drive in drives]) for has_detector in (True, False)
        )
        assert np.max(np.abs(with_detector[:, 0])) < 0.05
        assert np.mean(with_detector[:, 1]) < 3.0
        assert np.max(np.abs(without[:, 0])) > 0.2


def test_without_other_errors_the_limit_is_one_count_of_each_wheel():
    states = Robot().drive(3.0, 0.37)[10:]
    assert [each.limit_rad for each in states] == pytest.approx([2.0 * D_M / SEPARATION_M] * len(states))
    assert max(abs(each.difference_rad) for each in states) <= 2.0 * D_M / SEPARATION_M


def test_with_many_counts_the_limit_is_by_slip_noise_and_the_wrong_separation():
    noise, turn_std, radps, window_s = 1e-4, 0.02, 1.0, 0.5
    wheels = WheelErrors((1e-7, 1e-7), SEPARATION_M, travel_variance=noise, turn_std=turn_std)
    detector = SlipDetector(FusionParams(slip_threshold=3.0), wheels, ImuParams())
    for report in range(21):
        detector.take_gyro(report * SECOND_NS // 20, radps)
        travel = round(0.05 * report * 0.5 * SEPARATION_M * radps / 1e-7)
        detector.take_counts(report * SECOND_NS // 20, -travel, travel)
    variance = noise * radps * SEPARATION_M * window_s / SEPARATION_M**2 + (turn_std * radps * window_s) ** 2
    assert detector.state.limit_rad == pytest.approx(3.0 * math.sqrt(variance), rel=1e-3)
    assert detector.state.difference_rad == pytest.approx(0.0, abs=1e-5)


def test_the_bias_is_learned_at_rest_and_in_motion():
    imu = ImuParams.from_mapping({'gyroscope': {'bias': 0.1}}, '')
    for mps in (0.0, 0.4):
        states = Robot(imu, bias_radps=0.2).drive(20.0, mps)
        assert not any(flags(states))
        assert states[12].limit_rad > 0.2
        assert states[-1].limit_rad < 1.2 * 2.0 * D_M / SEPARATION_M
        assert abs(states[-1].difference_rad) < 2.0 * D_M / SEPARATION_M


@pytest.mark.parametrize('seconds', [0.5, 10.0])
def test_the_flag_ends_after_the_slip_which_leaves_the_bias_as_it_was(seconds):
    imu = ImuParams.from_mapping({'gyroscope': {'bias': 0.1}}, '')
    robot = Robot(imu, bias_radps=0.05)
    before = robot.drive(30.0, 0.4)[-1]
    during = flags(robot.drive(seconds, 0.4, slip_mps=(0.3, 0.0)))
    after = robot.drive(2.0, 0.4)
    assert all(during[4:])
    assert not any(flags(after)[10:])
    assert after[-1].limit_rad == pytest.approx(before.limit_rad, rel=0.1)
    assert abs(after[-1].difference_rad) < 2.0 * D_M / SEPARATION_M


def test_the_sign_of_the_difference_is_that_of_the_turn_by_the_wheels():
    for slip_mps, sign in (((0.0, 0.3), 1.0), ((0.3, 0.0), -1.0)):
        robot = Robot()
        robot.drive(1.0, 0.4)
        last = robot.drive(0.5, 0.4, slip_mps=slip_mps)[-1]
        assert sign * last.difference_rad == pytest.approx(0.5 * 0.3 / SEPARATION_M, abs=2.0 * D_M / SEPARATION_M)


def test_equal_slip_of_both_wheels_is_not_visible_for_a_gyroscope():
    robot = Robot()
    robot.drive(1.0, 0.4)
    assert not any(flags(robot.drive(0.5, 0.4, slip_mps=(0.3, 0.3))))


def test_without_rates_nothing_is_known_until_a_window_after_the_next_rate():
    robot = Robot()
    robot.drive(1.0, 0.4, slip_mps=(0.4, 0.0))
    assert robot.detector.state.is_slipping
    assert robot.drive(1.0, 0.4, slip_mps=(0.4, 0.0), has_gyro=False)[-1] == SlipState()
    again = robot.drive(2.0, 0.4)
    assert all(each == SlipState() for each in again[:10])
    assert not any(flags(again)) and math.isfinite(again[11].limit_rad)
    robot.detector.reset()
    assert robot.detector.state == SlipState()


def test_few_lost_rates_and_late_counts_cause_no_alarm():
    robot = Robot()
    for _ in range(20):
        states = robot.drive(0.5, 0.4, 0.8) + robot.drive(0.05, 0.4, 0.8, has_gyro=False)
        assert not any(flags(states))
    assert math.isfinite(states[-1].limit_rad)
