"""Odometry through what happens to reports: a controller that restarts, reports that are lost, late or come twice."""

import math

import pytest

from diff_encoder_sim.wheels.encoder_params import wrap_count
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder
from encoder_drives import JOINTS, wheels_of

MS, PERIOD_NS = 1_000_000, 50_000_000
DIAMETER_M = 0.2
# Counters whose half covers what a wheel turns at speed between two reports.
COUNTERS = [(40, 0), (40, 256), (40, 65536), (90, 0), (90, 256), (90, 65536), (4096, 0), (4096, 65536)]
SPEEDS_RADPS = [0.0, 0.5, 4.5, -4.5, 9.0]


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
@pytest.mark.parametrize('seed', [1, 2, 3])
def test_stamps_of_arrival_that_come_in_bursts_are_no_restart(rate_hz, spread_s, seed, caplog):
    """Reports that arrive one after the other show a wheel far faster than it is."""
    report = {'stamps': 'arrival', 'latency': 0.01, 'latency_spread': spread_s}
    reporting, odometry, phases = wheels_of(seed, 1024, rate=rate_hz, report=report)
    for index in range(5000):
        for sample in reporting.update(index * MS, JOINTS, (phases + 0.0045 * index).tolist()):
            odometry.update(*sample)
    assert odometry.restarts == 0 and not caplog.records
    assert abs(odometry.counts[0] - odometry.counts[1]) <= 2


@pytest.mark.parametrize('rate_hz', [20, 1000, 5000])
@pytest.mark.parametrize('ppr', [1, 40, 4096])
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
    for drive, gap in ((whole, 0), (with_losses, lost)):
        drive.drive(4.5, 4.5, 10)
        for _ in range(gap):
            drive.turn(4.5, 4.5)
        drive.drive(4.5, 4.5, 30 - gap)
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
