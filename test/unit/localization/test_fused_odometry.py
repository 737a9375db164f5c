"""Odometry of wheels and a gyroscope: the order of arrival, faulty samples, and frozen wheels."""

import math
import random
import re

import pytest

from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.base.se2 import wrap_angle
from diff_encoder_sim.localization.fused_odometry import FusedOdometry
from diff_encoder_sim.localization.fusion import FusionParams
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from fusion_drives import IMUS, measured

SECOND_NS, TICK_NS = 1_000_000_000, 10_000_000
PARAMS, IMU = (
    FusionParams(frequency=100.0),
    ImuParams.from_mapping({'gyroscope': {'noise_density': 1e-4, 'bias': 0.01}}, ''),
)
ODOMETRY = OdometryParams(ppr=1024, counter_modulus=4096)
COUNT_M = ODOMETRY.m_per_pulse[0]
MPS, RADPS = 0.5, 0.4


def made(params=PARAMS, odometry=ODOMETRY, imu=IMU):
    return FusedOdometry(params, odometry, imu)


def counts_at(time_s):
    """On an arc, wrapped."""
    rims_m = ((MPS + side * 0.5 * 0.4 * RADPS) * time_s for side in (-1.0, 1.0))
    return [(round(rim_m / COUNT_M) + 2048) % 4096 - 2048 for rim_m in rims_m]


def drive(fused, first, last, sample=lambda stamp_ns: (stamp_ns, 'imu_link', RADPS), has_counts=True):
    """Feed ticks of 10 ms, with reports at 20 Hz; return the estimates."""
    estimates = []
    for tick in range(first, last):
        if sample is not None:
            estimates += fused.take_imu(*sample(TICK_NS * tick))
        if has_counts and tick % 5 == 0:
            estimates += fused.take_counts(TICK_NS * tick, *counts_at(0.01 * tick))
    return estimates


def assert_on_arc(estimate, tolerance=0.02):
    time_s = estimate.stamp_ns / SECOND_NS
    radius_m, yaw_rad = MPS / RADPS, RADPS * time_s
    true = radius_m * math.sin(yaw_rad), radius_m * (1.0 - math.cos(yaw_rad)), math.remainder(yaw_rad, 2.0 * math.pi)
    assert estimate.base_pose_in_odom == pytest.approx(true, abs=tolerance)
    assert estimate[2:4] == pytest.approx([MPS, RADPS], abs=0.05)


def test_each_report_gives_an_estimate_across_wraps_of_the_counters():
    estimates = drive(made(), 0, 501)
    assert [each.stamp_ns for each in estimates] == list(range(0, 501 * TICK_NS, 5 * TICK_NS))
    assert_on_arc(estimates[-1])
    assert 0.0 < estimates[-1].of_pose.yaw_yaw < 1e-4


def test_estimates_come_at_most_at_the_frequency():
    assert len(drive(made(FusionParams(frequency=10.0)), 0, 500)) == 50


@pytest.mark.parametrize('latency_s', [0.0, 0.0049, 0.03])
def test_the_order_of_arrival_does_not_change_the_estimates(latency_s):
    """Within each topic the order stays; reports may be later or earlier than samples by 100 ms."""
    drawn = measured('curvy', 90, IMUS['bmi088'], 5)
    imu = drawn.imu.model_copy(update={'latency': latency_s})
    samples = [
        (stamp, 0, stamp, (stamp, 'base_link', rate))
        for stamp, rate in zip(drawn.stamps_ns.tolist()[:2000], drawn.rates_radps.tolist())
    ]
    reports = [
        (stamp, 1, stamp, (stamp, *counts))
        for stamp, counts in zip(drawn.report_stamps_ns.tolist()[:400], drawn.counts.tolist())
    ]
    runs = []
    for seed in range(3):
        fused, late = made(odometry=OdometryParams(ppr=90), imu=imu), random.Random(seed)
        delays_ns = [0, 0] if seed == 0 else [late.randrange(100_000_000), late.randrange(100_000_000)]
        due = sorted((stamp + delays_ns[kind], kind, stamp, given) for stamp, kind, _, given in samples + reports)
        runs.append(
            [each for _, kind, _, given in due for each in (fused.take_counts if kind else fused.take_imu)(*given)]
        )
    shortest = min(map(len, runs))
    assert shortest > 390
    assert runs[0][:shortest] == runs[1][:shortest] == runs[2][:shortest]


FAULTS = {
    'nan': (
        lambda stamp_ns: (stamp_ns, 'imu_link', math.nan),
        r'angular velocity nan rad/s; allowed: up to 1000 rad/s',
    ),
    'infinite': (lambda stamp_ns: (stamp_ns, 'imu_link', -math.inf), r'angular velocity -inf rad/s'),
    'impossible': (lambda stamp_ns: (stamp_ns, 'imu_link', 1e200), r'angular velocity 1e\+200 rad/s; allowed: up to'),
    'ahead': (lambda stamp_ns: (stamp_ns + 5 * SECOND_NS, 'imu_link', 9.0), r'allowed: up to 0\.5 s after the counts'),
    'frame': (lambda stamp_ns: (stamp_ns, 'camera', 9.0), r"frame 'camera'; allowed: base_link or imu_link;"),
    'frozen': (lambda stamp_ns: (2 * SECOND_NS, 'imu_link', 9.0), r'stamp 2\.000 s; allowed: later'),
    'decreasing': (lambda stamp_ns: (4 * SECOND_NS - stamp_ns, 'imu_link', 9.0), r'stamp 1\.990 s; allowed: later'),
    'old': (lambda stamp_ns: (stamp_ns - 2 * SECOND_NS, 'imu_link', 9.0), r'allowed: (later|up to 0\.5 s before)'),
    'dead': (None, r'no sample for 0\.5 s'),
}


@pytest.mark.parametrize('fault', FAULTS)
def test_with_faulty_samples_it_continues_with_the_wheels_and_warns_once(fault, caplog):
    sample, text = FAULTS[fault]
    fused = made()
    drive(fused, 0, 201)
    estimates = drive(fused, 201, 601, sample)
    assert estimates[-1].stamp_ns == 6 * SECOND_NS
    assert len(estimates) == 80
    assert_on_arc(estimates[-1])
    warnings = [each.getMessage() for each in caplog.records]
    assert re.search(text, warnings[0])
    assert 1 <= len(warnings) <= (2 if fault == 'old' else 1)
    caplog.clear()
    good = drive(fused, 601, 1001)
    assert_on_arc(good[-1])
    assert good[-1].of_twist.angular < 0.5 * estimates[-1].of_twist.angular
    assert not caplog.records


def test_a_bias_far_beyond_the_parameters_is_not_used_until_a_reset(caplog):
    fused = made()

    def stand(first, last, rate_radps):
        estimates = []
        for tick in range(first, last):
            estimates += fused.take_imu(TICK_NS * tick, 'imu_link', rate_radps)
            if tick % 5 == 0:
                estimates += fused.take_counts(TICK_NS * tick, 0, 0)
        return estimates

    estimates = stand(0, 1000, 0.2)
    assert len([each for each in caplog.records if 'allowed: up to 0.05 rad/s' in each.getMessage()]) == 1
    assert len(caplog.records) == 1
    assert estimates[-1].base_pose_in_odom.yaw_rad == pytest.approx(0.0, abs=0.02)
    fused.reset()
    caplog.clear()
    assert abs(stand(1000, 2000, 0.02)[-1].base_pose_in_odom.yaw_rad) < 1e-3
    assert not caplog.records


def test_samples_at_another_rate_than_that_of_the_parameters_are_reported_once(caplog):
    fused = made()
    for tick in range(300):
        fused.take_imu(5 * TICK_NS * tick, 'imu_link', 0.0)
        fused.take_counts(5 * TICK_NS * tick, 0, 0)
    (record,) = caplog.records
    assert record.getMessage().startswith('IMU: 20 samples per second; allowed: about its parameter rate, 100 Hz')


@pytest.mark.parametrize(('seconds', 'unused_s', 'is_gyro_wrong'), [(0.5, 0.5, False), (30.0, 1.8, True)])
def test_a_short_slip_does_not_turn_the_robot_and_a_lasting_one_is_a_fault_of_the_gyroscope(
    seconds, unused_s, is_gyro_wrong, caplog
):
    """The wheels turn the robot, the gyroscope does not show it."""
    fused, begin, end = made(), 300, 300 + round(100 * seconds)
    drive(fused, 0, begin)
    drive(fused, begin, end, lambda stamp_ns: (stamp_ns, 'imu_link', 0.0))
    assert 'slip' in fused.slip.diagnose().warning
    yaw_rad = drive(fused, end, end + 200)[-1].base_pose_in_odom.yaw_rad
    assert not fused.slip.state.is_slipping and not fused.slip.diagnose().warning
    assert wrap_angle(yaw_rad - RADPS * (5.0 + seconds - unused_s)) == pytest.approx(0.0, abs=0.05)
    assert any('bias' in each.getMessage() for each in caplog.records) == is_gyro_wrong


@pytest.mark.parametrize('is_gyro_good', [True, False])
def test_without_reports_no_motion_is_reported_at_the_stamps_of_the_imu(is_gyro_good, caplog):
    fused = made()
    drive(fused, 0, 501)
    sample = (lambda stamp_ns: (stamp_ns, 'imu_link', RADPS)) if is_gyro_good else FAULTS['nan'][0]
    estimates = drive(fused, 501, 801, sample, has_counts=False)
    assert [each.stamp_ns for each in estimates] == list(range(551 * TICK_NS, 801 * TICK_NS, TICK_NS))
    assert {each[2:4] for each in estimates} == {(0.0, 0.0)}
    assert len({each.base_pose_in_odom for each in estimates}) == 1  # that at the timeout
    assert estimates[0].base_pose_in_odom.yaw_rad == pytest.approx(RADPS * 5.5, abs=0.02)
    assert 'no counts for 0.5 s; reporting no motion' in caplog.text
    back = drive(fused, 801, 1001)
    assert back[-1].base_pose_in_odom.yaw_rad == pytest.approx(math.remainder(RADPS * 10.0, 2 * math.pi), abs=0.02)
    assert back[-1][2:4] == pytest.approx([MPS, RADPS], abs=0.05)


def test_stale_reports_are_ignored_and_a_jump_back_resets(caplog):
    fused = made()
    drive(fused, 0, 201)
    assert fused.take_counts(2 * SECOND_NS, 0, 0) == fused.take_counts(2 * SECOND_NS - 1, 0, 0) == []
    estimates = drive(fused, 0, 201)
    assert estimates[-1].base_pose_in_odom == pytest.approx(drive(made(), 0, 201)[-1].base_pose_in_odom, abs=1e-3)
    assert 'fusion restarted at pose zero' in caplog.text


def test_without_an_imu_it_is_as_sure_as_wheels_only():
    wheels, fused = WheelOdometry(ODOMETRY), made()
    fused_estimates = drive(fused, 0, 1001, None)
    for tick in range(0, 1001, 5):
        of_wheels = wheels.update(TICK_NS * tick, *counts_at(0.01 * tick))
    assert fused_estimates[-1].stamp_ns == of_wheels.stamp_ns
    assert fused_estimates[-1].base_pose_in_odom == pytest.approx(of_wheels.base_pose_in_odom, abs=0.01)


def test_the_lateral_speed_is_that_of_a_base_off_the_axle():
    estimate = drive(made(odometry=OdometryParams(ppr=1024, counter_modulus=4096, axle_x=0.2)), 0, 301)[-1]
    assert estimate.lateral_velocity_mps == -0.2 * estimate.angular_velocity_radps
