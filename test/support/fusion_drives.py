"""Drives of sampled lengths and speeds, with the counts of their wheels and the rates of a gyroscope."""

import math
from typing import NamedTuple

import numpy as np

from diff_encoder_sim.base.imu import ImuParams, load_imu
from diff_encoder_sim.base.se2 import wrap_angles
from diff_encoder_sim.localization.fusion import FusionParams, WheelErrors, WheelGyroFilter
from places import ROOT

TICK_NS, TICK_S, TICKS_PER_REPORT, REST_S = 10_000_000, 0.01, 5, 2.0
DIAMETER_M, SEPARATION_M = 0.2, 0.4
DEG = math.pi / 180.0
ACCELERATION_MPS2, TURN_ACCELERATION_RADPS2 = 1.5, 6.0


IMUS = {name: load_imu(name, ROOT / 'config', ROOT).imu for name in ('mpu6050', 'bno055', 'bmi088', 'stim300')}


def _segments(name, rng):
    """Linear [m/s] and angular [rad/s] speeds, and durations [s]."""

    def about(value):
        return value * rng.uniform(0.8, 1.2)

    if name == 'line':
        return [(about(0.4), 0.0, about(40.0))]
    if name == 'turn':
        return [(0.0, about(1.0), about(30.0))]
    if name == 'pivot':
        return [each for _ in range(4) for each in ((about(0.4), 0.0, about(4.0)), (0.2, 1.0, 0.5 * math.pi))]
    if name == 'stop and go':
        pairs = [
            ((about(0.4), about(0.3) * rng.choice([-1, 1]), about(3.0)), (0.0, 0.0, about(1.0))) for _ in range(10)
        ]
        return [each for pair in pairs for each in pair]
    assert name == 'curvy'
    return [(0.45, rng.uniform(-0.6, 0.6), about(4.0)) for _ in range(20)]


DRIVES = ('line', 'turn', 'pivot', 'stop and go', 'curvy')


def _ramped(speeds, most_change):
    reached = [0.0]
    for speed in speeds.tolist()[1:]:
        reached.append(min(max(speed, reached[-1] - most_change), reached[-1] + most_change))
    return np.array(reached)


class Measured(NamedTuple):
    """A drive at 100 Hz with rates, and reports at 20 Hz."""

    stamps_ns: np.ndarray
    rates_radps: np.ndarray
    report_stamps_ns: np.ndarray
    counts: np.ndarray
    poses: np.ndarray  # (m, 3) true at the reports, yaw not wrapped
    wheels: WheelErrors
    imu: ImuParams

    def estimates(self, with_gyro=True, params=FusionParams()):
        """Those of the filter."""
        rates = (self.stamps_ns, self.rates_radps) if with_gyro else (self.stamps_ns[:0], self.rates_radps[:0])
        return WheelGyroFilter(params, self.wheels, self.imu).run(*rates, self.report_stamps_ns, self.counts)

    def wheel_yaw_error_rad(self):
        """At the end, by the counts only."""
        left, right = (self.counts[-1] - self.counts[0]) * self.wheels.m_per_count
        return (right - left) / self.wheels.separation_m - self.poses[-1, 2]

    def gyro_yaw_error_rad(self):
        """At the end, by the rates only, minus their mean while the robot stands at the start."""
        bias_radps = self.rates_radps[: round(REST_S / TICK_S) - 10].mean()
        return TICK_S * (self.rates_radps - bias_radps).sum() - self.poses[-1, 2]


class Spin(NamedTuple):
    """A wheel that turns more than it travels: it spins, or is lifted."""

    start_s: float
    wheel: int
    mps: float
    duration_s: float = 0.5


def measured(drive, ppr, imu, seed, slip=1e-6, turn_std=0.0, spins=()):
    """Measure a drive of sampled lengths and speeds with sampled phases, bias and scale error."""
    rng = np.random.default_rng([seed, 33])
    segments = [(0.0, 0.0, REST_S), *_segments(drive, rng), (0.0, 0.0, 1.0)]
    repeats = [round(segment[2] / TICK_S) for segment in segments]
    commands = np.repeat([segment[:2] for segment in segments], repeats, axis=0)
    speeds = _ramped(commands[:, 0], ACCELERATION_MPS2 * TICK_S)
    rates = _ramped(commands[:, 1], TURN_ACCELERATION_RADPS2 * TICK_S)
    steps_m, steps_rad = (TICK_S * 0.5 * (each + np.concatenate([[0.0], each[:-1]])) for each in (speeds, rates))
    yaws = np.cumsum(steps_rad)
    middles = yaws - 0.5 * steps_rad
    poses = np.column_stack([np.cumsum(steps_m * np.cos(middles)), np.cumsum(steps_m * np.sin(middles)), yaws])
    half_m = 0.5 * SEPARATION_M * rng.normal(1.0, turn_std)
    rims_m = np.column_stack([steps_m - half_m * steps_rad, steps_m + half_m * steps_rad])
    rims_m += rng.standard_normal(rims_m.shape) * np.sqrt(slip * np.abs(rims_m))
    for start_s, wheel, mps, duration_s in spins:
        rims_m[round(start_s / TICK_S) : round((start_s + duration_s) / TICK_S), wheel] += TICK_S * mps
    m_per_count = math.pi * DIAMETER_M / ppr
    counts = np.floor(np.cumsum(rims_m, axis=0) / m_per_count + rng.uniform(0.0, 1.0, 2)).astype(np.int64)
    stamps_ns = TICK_NS * np.arange(1, len(rates) + 1)
    report_rows = slice(TICKS_PER_REPORT - 1, None, TICKS_PER_REPORT)
    wheels = WheelErrors((m_per_count, m_per_count), SEPARATION_M, slip, 0.0, turn_std)
    measured_rates = np.zeros(len(rates))
    if imu is not None:
        sensor = imu.gyroscope
        kept = math.exp(-TICK_S / sensor.bias_time)
        drift = (sensor.bias_drift * rng.standard_normal(len(rates))).tolist()
        for row in range(1, len(rates)):
            drift[row] = kept * drift[row - 1] + math.sqrt(1.0 - kept**2) * drift[row]
        white = sensor.noise_density / math.sqrt(TICK_S) * rng.standard_normal(len(rates))
        scale, bias = rng.normal(1.0, sensor.scale_error), rng.normal(0.0, sensor.bias)
        measured_rates = scale * rates + bias + np.array(drift) + white
        if sensor.resolution:
            measured_rates = sensor.resolution * np.round(measured_rates / sensor.resolution)
    reports = stamps_ns[report_rows], counts[report_rows], poses[report_rows]
    return Measured(stamps_ns, measured_rates, *reports, wheels, imu or ImuParams())


class End(NamedTuple):
    """Errors at the end of a drive."""

    nees: float  # of the pose, divided by 3
    yaw_nees: float
    fused_rad: float
    wheels_rad: float
    gyro_rad: float


def end_of(drive, ppr, imu, seed, params=FusionParams(), **errors):
    """Fuse a drive."""
    made = measured(drive, ppr, imu, seed, **errors)
    fused = made.estimates(imu is not None, params)
    error, covariance = fused.pose[-1] - made.poses[-1], fused.pose_covariance[-1]
    error[2] = wrap_angles(error[2])
    nees = float(error @ np.linalg.solve(covariance, error)) / 3.0
    gyro_rad = math.inf if imu is None else made.gyro_yaw_error_rad()
    return End(nees, error[2] ** 2 / covariance[2, 2], error[2], made.wheel_yaw_error_rad(), gyro_rad)
