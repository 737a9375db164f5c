"""Sampled drives with and without slip, and the reports of the detector."""

import numpy as np

from diff_encoder_sim.base.se2 import wrap_angles
from diff_encoder_sim.localization.fusion import FusionParams, WheelGyroFilter
from diff_encoder_sim.localization.slip_detection import SlipDetector
from fusion_drives import DRIVES, REST_S, TICKS_PER_REPORT, Spin, measured

LATEST_S = 15.0  # start of a spin; drives are longer


def slip_states(drive, params=FusionParams()):
    """Return (m, 3) whether it slips, the difference [rad] and its limit [rad], at each report of a measured drive."""
    detector, states = SlipDetector(params, drive.wheels, drive.imu), []
    for rates, report in _reports(drive):
        for rate in rates:
            detector.take_gyro(*rate)
        detector.take_counts(*report)
        states.append(detector.state)
    return np.array(states)


def _reports(drive):
    """Yield each report, after the rates until then."""
    rates = list(zip(drive.stamps_ns.tolist(), drive.rates_radps.tolist()))
    for report, (stamp_ns, (left, right)) in enumerate(zip(drive.report_stamps_ns.tolist(), drive.counts.tolist())):
        yield rates[TICKS_PER_REPORT * report : TICKS_PER_REPORT * (report + 1)], (stamp_ns, left, right)


def clean_drive(ppr, imu, seed):
    """Measure a drive with slip noise of 1e-6 to 1e-4 m^2/m and, in half of them, an unknown separation (1 %)."""
    rng = np.random.default_rng([seed, 34])
    drive = DRIVES[seed % len(DRIVES)]
    return measured(drive, ppr, imu, seed, 10.0 ** rng.uniform(-6.0, -4.0), rng.choice([0.0, 0.01]))


def false_alarms(drive):
    """Return the number of alarms, and the largest difference in units of its limit."""
    states = slip_states(drive)
    return np.count_nonzero(np.diff(states[:, 0]) > 0), np.max(np.abs(states[:, 1]) / states[:, 2])


def detection_s(ppr, imu, mps, seed):
    """Return the time until a spin or lift of 0.5 s is detected, up to 0.5 s after its end; else infinity."""
    spin, drive = spun_drive(ppr, imu, mps, seed)
    after_s = 1e-9 * drive.report_stamps_ns - spin.start_s
    found = (after_s > 0.0) & (after_s <= 2.0 * spin.duration_s) & (slip_states(drive)[:, 0] > 0.0)
    return np.min(after_s[found], initial=np.inf)


def spun_drive(ppr, imu, mps, seed):
    """Measure a drive with a spin or lift of 0.5 s.

    A sampled wheel turns by `mps` more than it travels, forward or backward: when it starts in every second drive, else
    at a sampled time, at rest too.
    """
    rng = np.random.default_rng([seed, 35])
    start_s = REST_S if seed % 2 else rng.uniform(REST_S, LATEST_S)
    spin = Spin(start_s, int(rng.integers(2)), mps * rng.choice([-1.0, 1.0]))
    return spin, measured(DRIVES[seed // 2 % len(DRIVES)], ppr, imu, seed, spins=[spin])


def heading_error(drive, has_detector):
    """Return the error of the fused heading at the end [rad], and its square over the stated variance."""
    detector = SlipDetector(FusionParams(), drive.wheels, drive.imu)
    filter_ = WheelGyroFilter(FusionParams(), drive.wheels, drive.imu)
    for rates, report in _reports(drive):
        for rate in rates:
            detector.take_gyro(*rate)
            filter_.take_gyro(*rate)
        detector.take_counts(*report)
        if has_detector and detector.is_gyro_better:
            filter_.take_slip()
        filter_.take_counts(*report)
    error_rad = wrap_angles(filter_.estimate.pose[2] - drive.poses[-1, 2])
    return error_rad, error_rad**2 / filter_.estimate.pose_covariance[2, 2]
