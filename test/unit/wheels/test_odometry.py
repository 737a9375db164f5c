"""Odometry over given and random motions: poses, covariances, twists; restarts, lost reports and measured speeds."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.counter import wrap_count
from diff_encoder_sim.wheels.odometry import TwistEstimator, WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from encoder_drives import RADIUS_M, SEPARATION_M, TICK_NS, drive, m_per_pulse

MS, PERIOD_NS, PERIOD_S = 1_000_000, 50_000_000, 0.05
TURN = 2.0 * math.pi
# Speeds that no wheel has, so that steps of many pulses are no restarts.
ANY_SPEED = {'max_wheel_speed': 1e9, 'max_wheel_acceleration': 1e9}


def integrated(reports, period_ns=PERIOD_NS, **params):
    """The estimates after counts, or counts and measured speeds, that come every period."""
    odometry = WheelOdometry(OdometryParams.from_mapping({**ANY_SPEED, **params}, ''))
    return [odometry.update(index * period_ns, *report) for index, report in enumerate(reports)]


def test_one_wheel_turns_about_the_other():
    _, after = integrated([(0, 0), (0, 100)], ppr=100)  # pi/2 about the left wheel
    assert after.base_pose_in_odom == pytest.approx((SEPARATION_M / 2, SEPARATION_M / 2, math.pi / 2))


def test_unequal_wheels_that_turn_alike_drive_an_arc_and_measured_speeds_are_of_each_wheel():
    """Of curvature (right - left radius) / (separation x mean radius)."""
    left_m, right_m, turned_rad = 0.099, 0.102, 100.0
    geometry = {'wheel_diameter': {'left': 2 * left_m, 'right': 2 * right_m}, 'wheel_separation': 0.4}
    counts, rates = [round(360 * turned_rad / TURN * part) for part in (0.0, 0.5, 1.0)], (3.0, 3.0)
    *_, end = integrated([(count, count, rates) for count in counts], ppr=360, **geometry)
    way_m, curvature = 0.5 * (left_m + right_m) * counts[-1] * TURN / 360, (right_m - left_m) / 0.4 / 0.1005
    expected = math.sin(way_m * curvature) / curvature, (1.0 - math.cos(way_m * curvature)) / curvature
    assert end.base_pose_in_odom == pytest.approx((*expected, way_m * curvature))
    assert end.linear_velocity_mps == pytest.approx(3.0 * 0.1005)
    assert end.angular_velocity_radps == pytest.approx(3.0 * 0.1005 * curvature)


def test_time_that_jumps_back_restarts_at_zero_with_one_warning(caplog):
    odometry = WheelOdometry(OdometryParams(ppr=100, **ANY_SPEED))
    for index in range(10):
        odometry.update(10_000 * MS + index * PERIOD_NS, 10 * index, 10 * index)
    restarted = odometry.update(0, 500, 500)
    assert (*restarted.base_pose_in_odom, restarted.linear_velocity_mps) == (0, 0, 0, 0)
    assert odometry.update(PERIOD_NS, 510, 510).base_pose_in_odom.x_m == pytest.approx(10 * m_per_pulse(100))
    assert [record.levelname for record in caplog.records] == ['WARNING']


def test_reset_takes_the_next_report_as_the_start_and_forgets_speeds():
    odometry = WheelOdometry(OdometryParams(velocity_low_pass=1.0))
    odometry.update(0, 0, 0, (5.0, 5.0))
    odometry.reset()
    assert odometry.update(0, 9, 9) is None  # its stamp has been published already
    again = odometry.update(PERIOD_NS, 18, 18, (1.0, 1.0))
    assert again.base_pose_in_odom == (0, 0, 0) and again.linear_velocity_mps == pytest.approx(0.1)


SEEDS = 200
# 99 % of sample variances over 200 seeds lie in this range around the true one (chi-square
# quantiles for 199 degrees of freedom, divided by 199; errors here are bounded, so less spread).
VARIANCE_RANGE_99 = (0.760, 1.279)


@pytest.mark.parametrize('ppr', [40, 1024])
def test_straight_drive_spread_is_the_closed_form(ppr):
    """Lateral (S d/L) sqrt(1/6), heading (d/L) sqrt(1/3), over wheel phases and end points."""
    rng, rows = np.random.default_rng(1), np.arange(201)
    ends_m = 20.0 + rng.uniform(0, 0.1, SEEDS)  # anywhere in a pulse
    angles_rad = np.stack([np.outer(ends_m / RADIUS_M, rows / 200)] * 2, axis=-1)
    odometry = OdometryParams.from_mapping({'ppr': ppr, **ANY_SPEED, 'motion_noise': 0.0}, '')
    drive = Drive(PERIOD_NS * rows, angles_rad)
    run = Chain(EncoderParams(ppr=ppr), odometry, SEEDS).run(drive, rng.uniform(0.0, TURN, (SEEDS, 2)), rows=rows)
    errors, d_rad = run.final_poses, m_per_pulse(ppr) / SEPARATION_M
    errors[:, 0] -= ends_m
    ratios = np.mean(errors[:, 1:] ** 2, axis=0) / (d_rad**2 * np.array([20.0**2 / 6, 1 / 3]))
    assert (ratios > VARIANCE_RANGE_99[0]).all() and (ratios < VARIANCE_RANGE_99[1]).all(), ratios
    assert np.abs(errors[:, 2]).max() <= d_rad * 1.000001  # bounded: a pulse a wheel
    # Its own covariance says the same: NEES of 3 numbers averages 3.
    covariances = [run.estimates(draw)[-1].of_pose.matrix() for draw in range(SEEDS)]
    nees = [error @ np.linalg.solve(covariance, error) for error, covariance in zip(errors, covariances)]
    assert 0.7 < np.mean(nees) / 3 < 1.3


AXLE_X_M = -0.15


def test_the_base_is_where_a_rigid_body_has_it():
    reports = np.cumsum([(0, 0), *np.random.default_rng(1).integers(-40, 90, (60, 2)).tolist()], axis=0).tolist()
    ahead = Pose2D(AXLE_X_M, 0.0, 0.0)
    for axle, base in zip(integrated(reports, ppr=1000), integrated(reports, ppr=1000, axle_x=AXLE_X_M)):
        expected = ahead.compose(axle.base_pose_in_odom).compose(ahead.inverse())
        assert base.base_pose_in_odom == pytest.approx(expected, abs=1e-12)
        assert base.of_twist == pytest.approx(axle.of_twist)
        assert axle.lateral_velocity_mps == 0.0
        assert base.lateral_velocity_mps == pytest.approx(-AXLE_X_M * base.angular_velocity_radps)
        jacobian, yaw_rad = np.eye(3), axle.base_pose_in_odom.yaw_rad
        jacobian[:2, 2] = AXLE_X_M * math.sin(yaw_rad), -AXLE_X_M * math.cos(yaw_rad)
        assert base.of_pose.matrix() == pytest.approx(jacobian @ axle.of_pose.matrix() @ jacobian.T, rel=1e-9)


# Counters whose half covers what a wheel turns at speed between two reports.
COUNTERS = [(40, 0), (40, 256), (90, 256), (4096, 65536)]


def reported(angles_rad, ppr, modulus=0, encoder=(), tick_ns=TICK_NS, **params):
    """The run of (n, 2) angles through an encoder and odometry with a counter of finite width."""
    shared = {'ppr': ppr, 'counter_modulus': modulus, 'encoder': dict(encoder)}
    chain = Chain(EncoderParams.from_mapping({**shared, **params}, ''), OdometryParams.from_mapping(shared, ''))
    return chain.run(Drive(tick_ns * np.arange(len(angles_rad)), angles_rad))


@pytest.mark.parametrize(('ppr', 'modulus'), COUNTERS)
@pytest.mark.parametrize('speed_radps', [4.5, -4.5])
def test_a_restart_in_mid_drive_costs_at_most_one_interval(ppr, modulus, speed_radps, caplog):
    times_s = 1e-9 * TICK_NS * np.arange(800)
    start_rad = TURN * (100 if modulus == 256 else 12_000) / ppr
    turned_rad = start_rad + np.sign(speed_radps) * TURN / 7 + speed_radps * times_s
    # When the counter is far from zero, whatever its width.
    counts = np.abs(wrap_count(np.floor(turned_rad * ppr / TURN).astype(int), modulus))
    restart_s = times_s[(times_s > 2.0) & (counts > (60 if modulus == 256 else 5000) - 5000 * (modulus == 0))][0] + 0.02
    found = reported(np.column_stack([turned_rad] * 2), ppr, modulus, {'faults': {'restart_at': restart_s}}).estimates()
    lost_m = (abs(speed_radps) * PERIOD_S * ppr / TURN + 1) * m_per_pulse(ppr)
    driven_m = (turned_rad[795] - turned_rad[0]) * RADIUS_M
    assert found[-1].base_pose_in_odom.x_m == pytest.approx(driven_m, abs=lost_m + m_per_pulse(ppr))
    assert abs(found[-1].base_pose_in_odom.yaw_rad) < 1e-9
    assert [record.levelname for record in caplog.records] == ['WARNING']


@pytest.mark.parametrize(('ppr', 'modulus'), COUNTERS)
def test_hard_driving_through_every_count_is_no_restart(ppr, modulus, caplog):
    """As hard as the wheels of a robot can: full speed, at once back, at once to a stop, over zero and over wraps."""
    legs = [(speed, turn * speed) for speed in (4.5, -4.5, 0.0, -4.5, 4.5, 0.0) for turn in (1, -1)]
    speeds = np.repeat(legs, [300, 35] * 6, axis=0)
    found = reported(np.cumsum(1e-9 * TICK_NS * speeds, axis=0), ppr, modulus)
    assert found.estimates()[-1].base_pose_in_odom == pytest.approx(found.poses[0, -1]) and caplog.records == []


@pytest.mark.parametrize(('rate_hz', 'spread_s'), [(20, 0.05), (1000, 0.02)])
def test_stamps_of_arrival_that_come_in_bursts_are_no_restart(rate_hz, spread_s, caplog):
    """Reports that arrive one after the other show a wheel far faster than it is."""
    report = {'stamps': 'arrival', 'latency': 0.01, 'latency_spread': spread_s}
    angles_rad = 1.0 + np.repeat(0.0045 * np.arange(5000)[:, np.newaxis], 2, axis=1)
    found = reported(angles_rad, 1024, tick_ns=MS, rate=rate_hz, report=report).estimates()
    assert abs(found[-1].base_pose_in_odom.yaw_rad) < 2.1 * m_per_pulse(1024) / SEPARATION_M and not caplog.records


@pytest.mark.parametrize('rate_hz', [20, 1000])
@pytest.mark.parametrize('ppr', [1, 40])
def test_whole_pulses_within_a_short_interval_are_no_restart(rate_hz, ppr, caplog):
    """One count of 40 PPR within 1 ms is 157 rad/s."""
    odometry = WheelOdometry(OdometryParams(ppr=ppr))
    pulses = (30.0 * np.arange(2 * rate_hz) / rate_hz * ppr / TURN).astype(int).tolist()
    for index, count in enumerate(pulses):
        odometry.update(index * 1_000_000_000 // rate_hz, count, -count)
    assert odometry.pulses.counts == (pulses[-1], -pulses[-1]) and not caplog.records


@pytest.mark.parametrize('encoder', [{'sensor': 'absolute', 'bits': 14, 'noise': 5.0}, {'hysteresis': 9.0}])
def test_noise_and_hysteresis_of_counters_near_zero_are_no_restart(encoder, caplog):
    """At 1 kHz no acceleration explains them."""
    angle_rad = 0.01 * np.sin(np.arange(4000) / 300)
    found = reported(np.column_stack([angle_rad, -angle_rad]), 16384, 0, encoder, MS, rate=1000.0, seed=1)
    assert None not in found.estimates() and not caplog.records


@pytest.mark.parametrize('period_ns', [5 * MS, PERIOD_NS, 200 * MS])
@pytest.mark.parametrize(('ppr', 'modulus'), COUNTERS)
def test_lost_reports_are_bridged_and_those_that_come_twice_or_after_the_next_ignored(ppr, modulus, period_ns, caplog):
    """Down to 5 Hz."""
    counts = wrap_count(np.floor(4.5 * PERIOD_S * np.arange(16) * ppr / TURN).astype(int), modulus).tolist()
    whole, gappy = (WheelOdometry(OdometryParams(ppr=ppr, counter_modulus=modulus)) for _ in range(2))
    expected = [whole.update(index * period_ns, counts[index], counts[index]) for index in range(16)]
    order = (0, 1, 2, 2, 4, 3, 5, 15)
    found = [gappy.update(index * period_ns, counts[index], counts[index]) for index in order]
    assert [each is None for each in found] == [False, False, False, True, False, True, False, False]
    assert found[-1].base_pose_in_odom == pytest.approx(expected[-1].base_pose_in_odom, abs=1e-12)
    assert caplog.records == []


PPR = 40
D_M = m_per_pulse(PPR)


def twists(reports, **params):
    """(n, 2) linear and angular velocities after each report."""
    found = integrated(reports, ppr=PPR, **params)
    return np.array([(each.linear_velocity_mps, each.angular_velocity_radps) for each in found])


def test_ms_quantum_is_a_count_per_period_and_a_window_averages_it():
    quantum = D_M / PERIOD_S
    seen = twists([(0, 0), (1, 1), (1, 2), (1, 2)])
    assert seen == pytest.approx(
        np.array([[0, 0], [quantum, 0], [quantum / 2, quantum / SEPARATION_M], [0, 0]]), abs=1e-12
    )
    linear_mps = twists([(count, count) for count in (0, 1, 3, 6, 10, 15)], velocity_window=4)[:, 0]
    assert linear_mps == pytest.approx(np.array([0, 1, 3 / 2, 6 / 3, 10 / 4, 14 / 4]) * quantum)


def test_measured_speeds_make_the_twist_and_leave_the_pose():
    counts = [(index // 3, index // 4) for index in range(20)]
    measured = integrated([(*each, (2.0, 3.0)) for each in counts])
    assert [each.base_pose_in_odom for each in measured] == [each.base_pose_in_odom for each in integrated(counts)]
    for each in measured:
        assert each.linear_velocity_mps == pytest.approx(RADIUS_M * 2.5)
        assert each.angular_velocity_radps == pytest.approx(RADIUS_M * 1.0 / SEPARATION_M)


@pytest.mark.parametrize('time_constant_s', [0.02, 0.1, 1.0])
def test_a_step_passes_the_low_pass_as_the_first_order_difference_equation_has_it(time_constant_s):
    seen = twists([(0, 0, (0.0, 0.0))] + [(0, 0, (4.0, -2.0))] * 30, velocity_low_pass=time_constant_s)
    passed = 1.0 - (time_constant_s / (time_constant_s + PERIOD_S)) ** np.arange(31)
    assert seen == pytest.approx(np.outer(passed, [RADIUS_M, -6.0 * RADIUS_M / SEPARATION_M]), abs=1e-12)


def twist_of(method, mps, **params):
    """The twist at the second report of wheels that turn evenly, a count."""
    estimator = TwistEstimator(OdometryParams(ppr=PPR, velocity_method=method, motion_noise=0.0, **params))
    totals = [(0, 0, 0), (PERIOD_NS, 1, 1)]
    return estimator.twist(totals, None if method == 'M' else (mps / RADIUS_M, mps / RADIUS_M))


@pytest.mark.parametrize(
    ('method', 'mps', 'params', 'expected'),
    [
        # Two roundings and two edges.
        ('M', 0.3, {'encoder': {'edge_error': 0.2}}, 2 * (1 / 12 + 0.2**2) * (D_M / PERIOD_S) ** 2 / 2),
        # Two readings of the clock: v^2 / (d f) is a tick at a count's distance, docs/encoders.md.
        ('T', 0.3, {'velocity_clock': 2000.0}, (0.3**2 / (D_M * 2000.0)) ** 2 / 6 / 2),
        # Wheels that show no speed may creep: by less than a count until that is noticed.
        ('MT', 0.0, {}, (D_M / 0.5) ** 2 / 12 / 2),
    ],
)
def test_the_covariance_of_a_speed_is_its_closed_form(method, mps, params, expected):
    _, _, covariance = twist_of(method, mps, **params)
    assert covariance.linear == pytest.approx(expected)


@pytest.mark.parametrize('method', ['T', 'MT'])
@pytest.mark.parametrize('mps', [0.0817, 0.8123])  # at 40 PPR a quarter of a count a report, and two and a half
@pytest.mark.parametrize(
    'encoder', [{'edge_error': 0.1}, {'sensor': 'hall', 'sensor_error': 6.0}, {'eccentricity': 0.05}, {}]
)
def test_the_covariance_is_that_of_the_speeds_which_encoders_measure(method, mps, encoder):
    """Over 60 encoders; a coarse clock is what is left if edges are in their places."""
    turned = np.repeat(mps / RADIUS_M * 1e-9 * TICK_NS * np.arange(150)[:, np.newaxis], 2, axis=1)
    measured = {'velocity_method': method, 'velocity_clock': 2000.0}
    last = [each for seed in range(60) for each in drive(turned, seed, 42, encoder, **measured)[-10:]]
    squares = [(each.linear_velocity_mps - mps) ** 2 for each in last]
    assert 0.4 < np.mean(squares) / np.mean([each.of_twist.linear for each in last]) < 1.7
