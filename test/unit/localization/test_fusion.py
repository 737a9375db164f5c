"""The filter of wheels and gyroscope: honest, at most as good as its sensors allow, and sound without one of them."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.localization.fusion import FusionParams, WheelErrors, WheelGyroFilter
from fusion_drives import DEG, IMUS, REST_S, SEPARATION_M, TICK_S, end_of, measured

SECOND_NS, D_M = 1_000_000_000, 0.01
WHEELS, RATE_STD_RADPS = WheelErrors((D_M, D_M), 0.4), 1e-3
IMU = ImuParams.from_mapping({'gyroscope': {'noise_density': 0.1 * RATE_STD_RADPS, 'bias': 0.01}}, '')
SEEDS = 100


@pytest.mark.parametrize(
    ('drive', 'ppr', 'imu'),
    [
        ('line', 20, 'mpu6050'),
        ('pivot', 20, 'bno055'),
        ('pivot', 90, 'mpu6050'),  # the standing wheel moves again within a count
        ('stop and go', 40, 'bmi088'),
        ('curvy', 1024, 'stim300'),
    ],
)
def test_the_covariance_is_honest_and_the_heading_that_of_the_better_sensor(drive, ppr, imu):
    ends = np.array([end_of(drive, ppr, IMUS[imu], seed) for seed in range(SEEDS)])
    assert 0.8 <= ends[:, 0].mean() <= 1.25
    fused, wheels, gyro_only = np.sqrt(np.mean(ends[:, 2:] ** 2, axis=0))
    assert fused <= 1.1 * min(wheels, gyro_only)


def test_a_wrong_separation_is_learned_from_the_gyroscope():
    ends = np.array([end_of('turn', 1024, IMUS['stim300'], seed, turn_std=0.02) for seed in range(SEEDS)])
    assert 0.8 <= ends[:, 0].mean() <= 1.25
    fused, wheels, gyro_only = np.sqrt(np.mean(ends[:, 2:] ** 2, axis=0))
    assert fused <= 1.1 * min(wheels, gyro_only) < 0.1 * wheels


def test_the_limits_are_those_of_counting_and_of_the_angle_random_walk():
    """(d/L) sqrt(1/3) without a gyroscope, N sqrt(t) with a known bias and useless wheels."""
    counting, density = math.pi * 0.2 / 20 / SEPARATION_M * math.sqrt(1.0 / 3.0), 0.01 * DEG
    wheels = [measured('curvy', 20, None, seed, slip=0.0) for seed in range(SEEDS)]
    walking = ImuParams.from_mapping({'gyroscope': {'noise_density': density}}, '')
    gyros = [measured('curvy', 0.01, walking, seed, slip=0.0) for seed in range(SEEDS)]
    for drives, with_gyro, limits in (
        (wheels, False, [counting] * SEEDS),
        (gyros, True, [density * math.sqrt(TICK_S * len(each.stamps_ns) - REST_S) for each in gyros]),
    ):
        fused = [each.estimates(with_gyro) for each in drives]
        errors = np.array([each.pose[-1, 2] - drive.poses[-1, 2] for each, drive in zip(fused, drives)])
        errors = (errors + math.pi) % (2.0 * math.pi) - math.pi
        stated = np.sqrt([each.pose_covariance[-1, 2, 2] for each in fused])
        assert stated == pytest.approx(limits, rel=0.1 if with_gyro else 0.2)
        assert np.sqrt(np.mean(errors**2)) == pytest.approx(np.mean(limits), rel=0.25)


def test_steps_and_arrays_are_equal_bit_for_bit():
    made = measured('stop and go', 90, IMUS['bno055'], 1)
    estimates, steps = made.estimates(), WheelGyroFilter(FusionParams(), made.wheels, made.imu)
    sample = 0
    for report, (stamp_ns, (left, right)) in enumerate(zip(made.report_stamps_ns.tolist(), made.counts.tolist())):
        while sample < len(made.stamps_ns) and made.stamps_ns[sample] <= stamp_ns:
            steps.take_gyro(int(made.stamps_ns[sample]), float(made.rates_radps[sample]))
            sample += 1
        steps.take_counts(stamp_ns, left, right)
        for one, of_all in zip(steps.estimate, estimates):
            assert np.array_equal(one, of_all[report])


def drive_straight(made, seconds, start_s=0.0, rate_radps=0.0, mps=0.5, with_gyro=True, with_counts=True):
    """Feed 100 Hz of a gyroscope and 20 Hz of counts, after an own first report."""
    for tick in range(1, round(100 * seconds) + 1):
        time_s = start_s + 0.01 * tick
        if with_gyro:
            made.take_gyro(round(time_s * SECOND_NS), rate_radps)
        if with_counts and tick % 5 == 0:
            count = math.floor(mps * time_s / D_M + 0.5)
            made.take_counts(round(time_s * SECOND_NS), count, count)


def started(params=FusionParams(), wheels=WHEELS, imu=IMU):
    made = WheelGyroFilter(params, wheels, imu)
    made.take_counts(0, 0, 0)
    return made


def test_without_a_gyroscope_it_continues_with_the_wheels():
    made = started()
    drive_straight(made, 2.0)
    drive_straight(made, 8.0, 2.0, with_gyro=False)
    estimate = made.estimate
    assert estimate.pose == pytest.approx([5.0, 0.0, 0.0], abs=0.02)
    assert estimate.twist == pytest.approx([0.5, 0.0], abs=0.1)
    assert 0.5 * D_M / 0.4 * math.sqrt(1 / 3) < math.sqrt(estimate.pose_covariance[2, 2]) < D_M / 0.4


def test_without_a_gyroscope_rest_is_by_the_counts():
    made = started()
    drive_straight(made, 5.0, mps=0.0, with_gyro=False)
    assert np.sqrt(np.diag(made.estimate.twist_covariance)) == pytest.approx([0.0, 0.0], abs=0.01)


def test_without_counts_it_continues_with_the_gyroscope_and_then_reports_no_motion():
    made = started(FusionParams(wheel_timeout=0.5))
    drive_straight(made, 5.0)
    drive_straight(made, 0.4, 5.0, rate_radps=0.5, with_counts=False)
    turning = made.estimate
    assert turning.twist == pytest.approx([0.5, 0.5], abs=0.1)
    assert turning.pose[2] == pytest.approx(0.2, abs=0.03)
    drive_straight(made, 5.0, 5.4, rate_radps=0.5, with_counts=False)
    standing = made.estimate
    assert (standing.twist == 0.0).all()
    assert standing.stamp_ns == round(5.5 * SECOND_NS)
    # The wheels turned by 0.25 rad meanwhile, and drove 2 m.
    made.take_counts(round(10.4 * SECOND_NS), 445, 455)
    assert made.estimate.pose[2] == pytest.approx(0.25, abs=2 * D_M / 0.4)
    assert math.hypot(*made.estimate.pose[:2]) == pytest.approx(4.5, abs=0.05)
    drive_straight(made, 1.0, 10.4, mps=0.0, with_counts=False)
    assert np.isfinite(made.estimate.pose_covariance).all()


def test_a_robot_at_rest_learns_the_bias_from_all_rates_since_it_stopped():
    rng, made = np.random.default_rng(3), started()
    rates = 0.02 + RATE_STD_RADPS * rng.standard_normal(1000)
    for tick, rate in enumerate(rates.tolist(), 1):
        made.take_gyro(10_000_000 * tick, rate)
        if tick % 5 == 0:
            made.take_counts(10_000_000 * tick, 0, 0)
    estimate = made.estimate
    assert estimate.gyro_bias_radps == pytest.approx(rates.mean(), abs=0.3 * RATE_STD_RADPS / math.sqrt(1000))
    assert math.sqrt(estimate.gyro_bias_variance) == pytest.approx(RATE_STD_RADPS / math.sqrt(1000), rel=0.1)
    assert estimate.pose[2] == pytest.approx(0.0, abs=1e-5)


def test_elastic_slip_at_the_start_of_a_turn_is_no_bias():
    """Wheels that turn are 1.2 ms ahead of the robot, as with slip in proportion to the acceleration."""
    imu, d_m, ahead_s = IMUS['stim300'], 1.5e-4, 0.0012
    made = WheelGyroFilter(FusionParams(), WheelErrors((d_m, d_m), 0.4), imu)

    def yaw_rad(time_s):
        """Accelerate to 1 rad/s from 0.1 to 0.3 s, stop from 5.0 to 5.2 s."""
        up_s, down_s = np.clip(time_s - 0.1, 0.0, 0.2), np.clip(time_s - 5.0, 0.0, 0.2)
        return 2.5 * up_s**2 - 2.5 * down_s**2 + max(0.0, time_s - 0.3) - max(0.0, time_s - 5.2)

    for tick in range(701):
        time_s = 0.01 * tick
        rate_radps = (yaw_rad(time_s + 1e-6) - yaw_rad(time_s - 1e-6)) / 2e-6
        made.take_gyro(10_000_000 * tick, float(rate_radps))
        if tick % 5 == 0:
            count = math.floor(0.2 * (yaw_rad(time_s) + ahead_s * rate_radps) / d_m)
            made.take_counts(10_000_000 * tick, -count, count)
            assert abs(made.estimate.gyro_bias_radps) < 3.0 * math.sqrt(made.estimate.gyro_bias_variance)
    assert made.estimate.pose[2] == pytest.approx(4.9 - 2.0 * math.pi, abs=1e-3)


def test_a_turn_between_two_counts_is_no_rest():
    """Of wheels with few counts, only the gyroscope shows it."""
    made = started(wheels=WheelErrors((1.0, 1.0), 0.4))
    for tick in range(1, 301):
        made.take_gyro(10_000_000 * tick, 0.2 if 200 < tick <= 250 else 0.0)
        if tick % 5 == 0:
            made.take_counts(10_000_000 * tick, 0, 0)
    assert made.estimate.pose[2] == pytest.approx(0.1, abs=0.003)


def test_a_base_off_the_axle_moves_sideways_in_turns():
    made = started(wheels=WHEELS._replace(axle_x_m=0.2))
    for tick in range(1, 401):
        phase_rad = 0.5 * math.pi * min(0.01 * tick, 2.0)
        made.take_gyro(10_000_000 * tick, math.pi**2 / 8.0 * math.sin(phase_rad))
        if tick % 5 == 0:
            count = math.floor(0.25 * math.pi * (1.0 - math.cos(phase_rad)) * 0.2 / D_M + 0.5)
            made.take_counts(10_000_000 * tick, -count, count)
    assert made.estimate.pose == pytest.approx([0.2, -0.2, 0.5 * math.pi], abs=0.03)


def test_a_late_rate_corrects_the_current_speed():
    made = started()
    drive_straight(made, 1.0)
    made.take_counts(round(1.05 * SECOND_NS), 52, 52)
    made.take_gyro(round(1.03 * SECOND_NS), 0.0)
    assert made.estimate.stamp_ns == round(1.05 * SECOND_NS)


def test_the_world_is_the_odom_frame():
    assert FusionParams(odom_frame='robot/odom', world_frame='robot/odom').world_frame == 'robot/odom'
    with pytest.raises(ConfigError, match=r"^f: world_frame: given 'map'; allowed: odom_frame \(odom\)$"):
        FusionParams.from_mapping({'world_frame': 'map'}, 'f')
