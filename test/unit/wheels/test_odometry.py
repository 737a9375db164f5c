"""Odometry over given and random motions, with restarts, lost reports and measured speeds."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.wheels.counter import Reading, wrap_count
from diff_encoder_sim.wheels.odometry import RimMotion, TwistEstimator, WheelOdometry, twist_of_rims
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder
from encoder_drives import JOINTS, RADIUS_M, TICK_NS, drive, wheels_of

MS, PERIOD_NS = 1_000_000, 50_000_000

DIAMETER_M, SEPARATION_M = 0.2, 0.4

PPRS = [40, 1024]


def metres_per_pulse(ppr):
    return math.pi * DIAMETER_M / ppr


def odometry(**params):
    return WheelOdometry(
        OdometryParams.from_mapping({'max_wheel_speed': 1e9, 'max_wheel_acceleration': 1e9, **params}, 'test')
    )


def test_one_wheel_alone_turns_about_the_other():
    wheel_odometry = odometry(ppr=100)
    wheel_odometry.update(0, 0, 0)
    pose = wheel_odometry.update(50 * MS, 0, 100).base_pose_in_odom  # pi/2 about the left wheel
    assert pose == pytest.approx((SEPARATION_M / 2, SEPARATION_M / 2, math.pi / 2))


increments = st.lists(st.tuples(st.integers(-30, 30), st.integers(-30, 30)), min_size=1, max_size=40)


@given(increments, st.sampled_from([128, 255, 65536]), st.integers(-(10**6), 10**6))
def test_a_wrapping_counter_gives_the_same_poses_as_an_endless_one(steps, modulus, start):
    endless, wrapping = odometry(), odometry(counter_modulus=modulus)
    totals = (np.cumsum([(0, 0)] + steps, axis=0) + start).tolist()
    for index, (left, right) in enumerate(totals):
        expected = endless.update(index * 50 * MS, left, right)
        wrapped = wrapping.update(index * 50 * MS, wrap_count(left, modulus), wrap_count(right, modulus))
        assert wrapped.base_pose_in_odom == expected.base_pose_in_odom


@given(st.integers(-40, 40), st.integers(-40, 40), st.integers(1, 25))
def test_an_arc_gives_the_same_pose_however_it_is_split(left, right, pieces):
    whole, split = odometry(), odometry()
    whole.update(0, 0, 0)
    expected = whole.update(50 * MS, left * pieces, right * pieces).base_pose_in_odom
    for index in range(pieces + 1):
        pose = split.update(index * 50 * MS, left * index, right * index).base_pose_in_odom
    assert pose == pytest.approx(expected, abs=1e-9)


def test_a_window_averages_the_twist_over_that_many_reports():
    wheel_odometry = odometry(ppr=100, velocity_window=4)
    counts = [0, 1, 3, 6, 10, 15]
    speeds = [
        wheel_odometry.update(index * 50 * MS, count, count).linear_velocity_mps for index, count in enumerate(counts)
    ]
    d = metres_per_pulse(100)
    assert speeds == pytest.approx([0, 1 * d / 0.05, 3 * d / 0.1, 6 * d / 0.15, 10 * d / 0.2, 14 * d / 0.2])


def test_time_that_jumps_back_restarts_at_zero_with_one_warning(caplog):
    wheel_odometry = odometry(ppr=100)
    for index in range(10):
        wheel_odometry.update(10_000 * MS + index * 50 * MS, 10 * index, 10 * index)
    restarted = wheel_odometry.update(0, 500, 500)
    assert restarted.base_pose_in_odom == (0, 0, 0)
    assert restarted.linear_velocity_mps == 0
    again = wheel_odometry.update(50 * MS, 510, 510)
    assert again.base_pose_in_odom.x_m == pytest.approx(10 * metres_per_pulse(100))
    assert [record.levelname for record in caplog.records] == ['WARNING']


def test_reset_takes_the_next_report_as_the_start():
    wheel_odometry = odometry()
    wheel_odometry.update(0, 0, 0)
    wheel_odometry.update(50 * MS, 9, 9)
    wheel_odometry.reset()
    assert wheel_odometry.update(50 * MS, 9, 9) is None  # its stamp has been published already
    assert wheel_odometry.update(100 * MS, 18, 18).base_pose_in_odom == (0, 0, 0)


SEEDS = 200

# 99 % of sample variances over 200 seeds lie in this range around the true one (chi-square
# quantiles for 199 degrees of freedom, divided by 199; errors here are bounded, so less spread).
VARIANCE_RANGE_99 = (0.760, 1.279)


def quick_odometry(**params):
    return WheelOdometry(OdometryParams.from_mapping({'max_wheel_speed': 1e9, **params}, 'test'))


def drive_wheels(ppr, wheel_angles_rad, seed):
    """Odometry's last estimate after (n, 2) wheel angles 50 ms apart, from random phases."""
    phases = np.random.default_rng(seed).uniform(0, 2 * math.pi, 2)
    encoder = ReportingEncoder(EncoderParams.from_mapping({'ppr': ppr}, ''))
    wheel_odometry = quick_odometry(ppr=ppr, motion_noise=0.0)
    for index, angles in enumerate((wheel_angles_rad + phases).tolist()):
        (sample,) = encoder.update(index * 50 * MS, JOINTS, angles)
        estimate = wheel_odometry.update(*sample)
    return estimate


def errors_over_seeds(ppr, wheel_angles_of_seed, truth_of_seed):
    """(seeds, 3) quick_odometry minus truth, and the estimates."""
    rows, estimates = [], []
    for seed in range(SEEDS):
        estimate = drive_wheels(ppr, wheel_angles_of_seed(seed), seed)
        truth = truth_of_seed(seed)
        pose = estimate.base_pose_in_odom
        rows.append([pose.x_m - truth.x_m, pose.y_m - truth.y_m, wrap_angle(pose.yaw_rad - truth.yaw_rad)])
        estimates.append(estimate)
    return np.array(rows), estimates


@pytest.mark.heavy
@pytest.mark.parametrize('ppr', PPRS)
def test_straight_drive_spread_is_the_closed_form(ppr):
    """Lateral (S d/L) sqrt(1/6), heading (d/L) sqrt(1/3), over wheel phases and end points."""
    length_m = 20.0
    end_m = length_m + np.random.default_rng(1).uniform(0, 0.1, SEEDS)  # ends anywhere in a pulse

    def wheel_angles(seed):
        # 1.9 m/s: quick, and in no simple ratio to any of the pulse lengths.
        travel_m = np.append(np.arange(0, end_m[seed], 0.095 * math.sqrt(1.01)), end_m[seed])
        return np.column_stack([travel_m, travel_m]) / (DIAMETER_M / 2)

    errors, estimates = errors_over_seeds(ppr, wheel_angles, lambda seed: Pose2D(end_m[seed], 0.0, 0.0))
    d = metres_per_pulse(ppr)
    expected = np.array([length_m * d / SEPARATION_M * math.sqrt(1 / 6), d / SEPARATION_M * math.sqrt(1 / 3)])
    ratios = np.mean(errors[:, 1:] ** 2, axis=0) / expected**2
    assert (ratios > VARIANCE_RANGE_99[0]).all() and (ratios < VARIANCE_RANGE_99[1]).all(), ratios
    assert np.abs(errors[:, 2]).max() <= d / SEPARATION_M * 1.000001  # bounded: a pulse a wheel
    # Its own covariance says the same: NEES of 3 numbers averages 3.
    nees = [error @ np.linalg.solve(estimate.pose_covariance, error) for error, estimate in zip(errors, estimates)]
    assert 0.7 < np.mean(nees) / 3 < 1.3


@pytest.mark.heavy
@pytest.mark.parametrize('ppr', PPRS)
def test_turn_in_place_spread_is_the_closed_form(ppr):
    """Heading (d/L) sqrt(1/3) over angles that are no whole number of pulses."""
    end_rad = np.random.default_rng(2).uniform(8 * math.pi, 10 * math.pi, SEEDS)

    def wheel_angles(seed):
        turned_rad = np.append(np.arange(0, end_rad[seed], 0.5), end_rad[seed])
        rolled_rad = turned_rad * SEPARATION_M / DIAMETER_M
        return np.column_stack([-rolled_rad, rolled_rad])

    errors, _ = errors_over_seeds(ppr, wheel_angles, lambda seed: Pose2D(0.0, 0.0, end_rad[seed]))
    expected_rad = metres_per_pulse(ppr) / SEPARATION_M * math.sqrt(1 / 3)
    ratio = np.mean(errors[:, 2] ** 2) / expected_rad**2
    assert VARIANCE_RANGE_99[0] < ratio < VARIANCE_RANGE_99[1]


AXLE_X_M = -0.15


def estimates(axle_x_m, reports):
    """The estimates after whole pulses of both wheels, of 1000 a revolution of 0.2 m."""
    odometry = WheelOdometry(OdometryParams(ppr=1000, axle_x=axle_x_m, max_wheel_speed=1e9))
    return [odometry.update(50 * MS * index, *counts) for index, counts in enumerate(reports)]


def test_a_turn_in_place_moves_the_base_on_a_circle_about_the_axle():
    m_per_pulse = 0.2 * math.pi / 1000
    for pulses in (-400, -37, 250, 1100):
        _, estimate = estimates(AXLE_X_M, [(0, 0), (-pulses, pulses)])
        turn_rad = 2 * pulses * m_per_pulse / SEPARATION_M
        pose = estimate.base_pose_in_odom
        assert pose.x_m == pytest.approx(AXLE_X_M * (1 - math.cos(turn_rad)), abs=1e-12)
        assert pose.y_m == pytest.approx(-AXLE_X_M * math.sin(turn_rad), abs=1e-12)
        assert pose.yaw_rad == pytest.approx(wrap_angle(turn_rad))
        assert estimate.linear_velocity_mps == pytest.approx(0.0)
        assert estimate.angular_velocity_radps == pytest.approx(turn_rad / 0.05)
        assert estimate.lateral_velocity_mps == pytest.approx(-AXLE_X_M * turn_rad / 0.05)


def test_the_base_is_where_a_rigid_body_has_it():
    reports = np.cumsum([(0, 0), *np.random.default_rng(1).integers(-40, 90, (60, 2)).tolist()], axis=0).tolist()
    ahead = Pose2D(AXLE_X_M, 0.0, 0.0)
    for axle, base in zip(estimates(0.0, reports), estimates(AXLE_X_M, reports)):
        expected = ahead.compose(axle.base_pose_in_odom).compose(ahead.inverse())
        assert base.base_pose_in_odom == pytest.approx(expected, abs=1e-12)
        assert base.twist_covariance == pytest.approx(axle.twist_covariance)
        assert axle.lateral_velocity_mps == 0.0


def test_the_covariance_is_that_of_the_axle_carried_to_the_base():
    reports = [(0, 0), (700, 900), (1000, 1400)]
    axle, base = estimates(0.0, reports)[-1], estimates(AXLE_X_M, reports)[-1]
    yaw_rad = axle.base_pose_in_odom.yaw_rad
    jacobian = np.eye(3)
    jacobian[:2, 2] = AXLE_X_M * math.sin(yaw_rad), -AXLE_X_M * math.cos(yaw_rad)
    assert base.pose_covariance == pytest.approx(jacobian @ axle.pose_covariance @ jacobian.T, rel=1e-9)


# Counters whose half covers what a wheel turns at speed between two reports.
COUNTERS = [(40, 0), (40, 256), (90, 256), (4096, 65536)]

SPEEDS_RADPS = [0.0, 4.5, -4.5]


def metres(pulses, ppr):
    return pulses * math.pi * DIAMETER_M / ppr


class Drive:
    """Two wheels at a steady speed, with counters that can be restarted."""

    def __init__(self, ppr, modulus, start=0):
        self.ppr, self.modulus = ppr, modulus
        self.odometry = WheelOdometry(OdometryParams(ppr=ppr, counter_modulus=modulus))
        self.turned, self.zero, self.time_ns = [0.0, 0.0], [-start, -start], 0
        self.estimate = self.report()

    def counts(self):
        return [math.floor(turned) - zero for turned, zero in zip(self.turned, self.zero)]

    def report(self):
        self.estimate = self.odometry.update(
            self.time_ns, *(wrap_count(count, self.modulus) for count in self.counts())
        )
        return self.estimate

    def turn(self, left_radps, right_radps, period_ns=PERIOD_NS):
        for wheel, speed in enumerate((left_radps, right_radps)):
            self.turned[wheel] += speed * self.ppr / (2 * math.pi) * period_ns * 1e-9
        self.time_ns += period_ns

    def drive(self, left_radps, right_radps, reports):
        for _ in range(reports):
            self.turn(left_radps, right_radps)
            self.report()

    def restart(self):
        self.zero = [math.floor(turned) for turned in self.turned]


@pytest.mark.parametrize(('ppr', 'modulus'), COUNTERS)
@pytest.mark.parametrize('speed_radps', SPEEDS_RADPS)
def test_a_restart_in_mid_drive_costs_at_most_one_interval(ppr, modulus, speed_radps, caplog):
    start = 100 if modulus == 256 else 12_000
    drive = Drive(ppr, modulus, start)
    # To where the counter is far from zero, whatever its width.
    drive.drive(speed_radps, speed_radps, 40)
    while abs(wrap_count(drive.counts()[0], modulus)) < (60 if modulus == 256 else 5000):
        drive.drive(speed_radps, speed_radps, 1)
    drive.turn(speed_radps, speed_radps, PERIOD_NS // 2)
    drive.restart()
    drive.turn(speed_radps, speed_radps, PERIOD_NS // 2)
    drive.report()
    drive.drive(speed_radps, speed_radps, 40)
    lost = abs(speed_radps) * PERIOD_NS * 1e-9 * ppr / (2 * math.pi) + 1
    assert drive.odometry.restarts == 1
    assert drive.estimate.base_pose_in_odom.x_m == pytest.approx(metres(drive.turned[0], ppr), abs=metres(lost, ppr))
    assert drive.estimate.base_pose_in_odom.yaw_rad == 0.0
    assert [record.levelname for record in caplog.records] == ['WARNING']


@pytest.mark.parametrize(('ppr', 'modulus'), COUNTERS)
def test_hard_driving_through_every_count_is_no_restart(ppr, modulus, caplog):
    """As hard as the wheels of a robot can: full speed, at once back, at once to a stop, over zero and over wraps."""
    drive = Drive(ppr, modulus)
    for speed_radps in (4.5, -4.5, 0.0, -4.5, 4.5, 0.0):
        drive.drive(speed_radps, speed_radps, 60)
        drive.drive(speed_radps, -speed_radps, 7)
    assert drive.odometry.restarts == 0 and caplog.records == []


@pytest.mark.heavy
@pytest.mark.parametrize(('rate_hz', 'spread_s'), [(20, 0.05), (100, 0.02), (1000, 0.02)])
@pytest.mark.parametrize('seed', [1])
def test_stamps_of_arrival_that_come_in_bursts_are_no_restart(rate_hz, spread_s, seed, caplog):
    """Reports that arrive one after the other show a wheel far faster than it is."""
    report = {'stamps': 'arrival', 'latency': 0.01, 'latency_spread': spread_s}
    reporting, odometry, phases = wheels_of(seed, 1024, rate=rate_hz, report=report)
    for index in range(5000):
        for sample in reporting.update(index * MS, JOINTS, (phases + 0.0045 * index).tolist()):
            odometry.update(*sample)
    assert odometry.restarts == 0 and not caplog.records
    assert abs(odometry.counts[0] - odometry.counts[1]) <= 2


@pytest.mark.parametrize('rate_hz', [20, 1000])
@pytest.mark.parametrize('ppr', [1, 40])
def test_whole_pulses_within_a_short_interval_are_no_restart(rate_hz, ppr, caplog):
    """One count of 40 PPR within 1 ms is 157 rad/s."""
    odometry = WheelOdometry(OdometryParams(ppr=ppr))
    turned_pulses = [30.0 * index / rate_hz * ppr / (2 * math.pi) for index in range(2 * rate_hz)]
    for index, pulses in enumerate(turned_pulses):
        odometry.update(index * 1_000_000_000 // rate_hz, int(pulses), -int(pulses))
    assert odometry.counts == (int(turned_pulses[-1]), -int(turned_pulses[-1]))
    assert not caplog.records


@pytest.mark.parametrize('encoder', [{'sensor': 'absolute', 'bits': 14, 'noise': 5.0}, {'hysteresis': 9.0}])
def test_noise_and_hysteresis_of_counters_near_zero_are_no_restart(encoder, caplog):
    """At 1 kHz no acceleration explains them."""
    ppr, period_ns = 16384, MS
    reporting = ReportingEncoder(EncoderParams(ppr=ppr, rate=1000.0, encoder=encoder, seed=1))
    odometry = WheelOdometry(OdometryParams(ppr=ppr, encoder=encoder))
    for index in range(4000):
        angle = 0.01 * math.sin(index / 300)
        for sample in reporting.update(index * period_ns, JOINTS, [angle, -angle]):
            odometry.update(*sample)
    assert odometry.restarts == 0 and not caplog.records


@pytest.mark.parametrize('lost', [1, 3, 10])
@pytest.mark.parametrize(('ppr', 'modulus'), COUNTERS)
def test_lost_reports_are_bridged(ppr, modulus, lost):
    whole, with_losses = Drive(ppr, modulus), Drive(ppr, modulus)
    for each, gap in ((whole, 0), (with_losses, lost)):
        each.drive(4.5, 4.5, 10)
        for _ in range(gap):
            each.turn(4.5, 4.5)
        each.drive(4.5, 4.5, 30 - gap)
    assert with_losses.odometry.restarts == 0
    assert with_losses.estimate.base_pose_in_odom == pytest.approx(whole.estimate.base_pose_in_odom, abs=1e-12)


@pytest.mark.parametrize('period_ns', [PERIOD_NS, 5 * MS, 200 * MS])
def test_reports_that_come_twice_or_after_the_next_are_ignored(period_ns):
    """Down to 5 Hz."""
    odometry = WheelOdometry(OdometryParams(ppr=90))
    for index in range(3):
        odometry.update(index * period_ns, index, index)
    assert odometry.update(2 * period_ns, 2, 2) is None
    assert odometry.update(4 * period_ns, 4, 4).base_pose_in_odom.x_m == pytest.approx(metres(4, 90))
    assert odometry.update(3 * period_ns, 3, 3) is None
    assert odometry.update(5 * period_ns, 5, 5).base_pose_in_odom.x_m == pytest.approx(metres(5, 90))


PERIOD_S = 0.05

PPR = 40


def odometry_of(**params):
    return WheelOdometry(OdometryParams(ppr=PPR, **params))


def twists(wheel_odometry, reports):
    """(linear, angular) after each report: counts and, where there are three values, measured speeds."""
    estimates = [wheel_odometry.update(index * PERIOD_NS, *report) for index, report in enumerate(reports)]
    return [(estimate.linear_velocity_mps, estimate.angular_velocity_radps) for estimate in estimates]


def test_measured_speeds_make_the_twist_and_leave_the_pose():
    by_counts, by_speeds = odometry_of(), odometry_of()
    for index in range(20):
        counts = index // 3, index // 4
        pose = by_counts.update(index * PERIOD_NS, *counts).base_pose_in_odom
        estimate = by_speeds.update(index * PERIOD_NS, *counts, (2.0, 3.0))
        assert estimate.base_pose_in_odom == pose
        assert estimate.linear_velocity_mps == pytest.approx(0.5 * DIAMETER_M * 2.5)
        assert estimate.angular_velocity_radps == pytest.approx(0.5 * DIAMETER_M * 1.0 / SEPARATION_M)


@pytest.mark.parametrize('time_constant_s', [0.02, 0.1, 1.0])
def test_a_step_passes_the_low_pass_as_the_first_order_difference_equation_has_it(time_constant_s):
    reports = [(0, 0, (0.0, 0.0))] + [(0, 0, (4.0, -2.0))] * 30
    seen = twists(odometry_of(velocity_low_pass=time_constant_s), reports)
    for index, (linear_mps, angular_radps) in enumerate(seen):
        share = 1.0 - (time_constant_s / (time_constant_s + PERIOD_S)) ** index
        assert linear_mps == pytest.approx(0.5 * DIAMETER_M * 1.0 * share, abs=1e-12)
        assert angular_radps == pytest.approx(0.5 * DIAMETER_M * -6.0 / SEPARATION_M * share, abs=1e-12)


INTERVAL_S = 0.05

RIMS = RimMotion(0.07, 4e-6), RimMotion(-0.015, 2e-8)


def test_the_covariance_is_that_of_the_two_ways():
    rng = np.random.default_rng(1)
    left_m, right_m = rng.normal(0.0, [[math.sqrt(rim.variance)] for rim in RIMS], (2, 200_000))
    drawn = np.cov((left_m + right_m) / 2 / INTERVAL_S, (right_m - left_m) / SEPARATION_M / INTERVAL_S)
    assert twist_of_rims(RIMS, INTERVAL_S, SEPARATION_M).covariance.matrix() == pytest.approx(drawn, rel=0.02)


def estimate(method, mps, counts=1, **params):
    """The twist at the second report of wheels that turn evenly."""
    estimator = TwistEstimator(OdometryParams(ppr=40, velocity_method=method, **params))
    totals = [Reading(0, 0, 0), Reading(50_000_000, counts, counts)]
    return estimator.twist(totals, None if method == 'M' else (mps / RADIUS_M, mps / RADIUS_M))


def test_by_counts_two_roundings_and_two_edges_are_uncertain():
    d_m, sigma = math.pi * 0.2 / 40, 0.2
    covariance = estimate('M', 0.3, motion_noise=0.0, encoder={'edge_error': sigma}).covariance
    assert covariance.linear == pytest.approx(2 * (1 / 12 + sigma**2) * (d_m / INTERVAL_S) ** 2 / 2)


def test_by_times_of_edges_two_readings_of_the_clock_are_uncertain():
    """v^2 / (d f) is a tick at a count's distance: docs/encoders.md."""
    d_m, mps, clock_hz = math.pi * 0.2 / 40, 0.3, 2000.0
    covariance = estimate('T', mps, velocity_clock=clock_hz, motion_noise=0.0).covariance
    assert covariance.linear == pytest.approx((mps**2 / (d_m * clock_hz)) ** 2 / 6 / 2)


SPEEDS_MPS = (0.0817, 0.8123)  # at 40 PPR a quarter of a count a report, and two and a half


@pytest.mark.heavy
@pytest.mark.parametrize('method', ['T', 'MT'])
@pytest.mark.parametrize('mps', SPEEDS_MPS)
@pytest.mark.parametrize(
    'encoder', [{'edge_error': 0.1}, {'sensor': 'hall', 'sensor_error': 6.0}, {'eccentricity': 0.05}, {}]
)
def test_the_covariance_is_that_of_the_speeds_which_encoders_measure(method, mps, encoder):
    """Over 60 encoders; a coarse clock is what is left where edges are in their places."""
    clock_hz, ppr = 2000.0, 42
    turned = np.repeat(mps / RADIUS_M * 1e-9 * TICK_NS * np.arange(150)[:, None], 2, axis=1)
    measured = {'velocity_method': method, 'velocity_clock': clock_hz}
    errors_mps, stated = [], []
    for seed in range(60):
        last = drive(turned, seed, ppr, encoder, **measured)[-10:]
        errors_mps += [estimate.linear_velocity_mps - mps for estimate in last]
        stated += [estimate.twist_covariance[0, 0] for estimate in last]
    ratio = np.mean(np.square(errors_mps)) / np.mean(stated)
    assert 0.4 < ratio < 1.7
