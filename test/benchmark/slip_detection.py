#!/usr/bin/env python3
"""False alarms of slip detection in clean drives, and how many spins and lifts of a wheel for 0.5 s it detects.

Drives of sampled lengths and speeds, wheel phases, bias, scale error and slip noise; test/support/slip_drives.py.
"""

from __future__ import annotations

import time
from typing import List

import numpy as np
from bench import parser, print_header, print_table

from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.localization.fusion import FusionParams
from diff_encoder_sim.localization.slip_detection import SlipDetector
from fusion_drives import IMUS, measured
from slip_drives import clean_drive, detection_s, false_alarms, heading_error, spun_drive

PPRS = (20, 40, 90, 250, 1024, 4096)
SPEEDS_MPS = (0.1, 0.15, 0.2, 0.3, 0.5)
SPIN_MPS = 0.3  # for the heading
LEGEND = """
Detected spins in each 100 by excess speed of the wheel [m/s] and counts per revolution, and the median time until
detection [s]."""


def main() -> None:
    made = parser(__doc__, hours=1, events=20)
    made.add_argument('--imus', nargs='+', default=list(IMUS), choices=list(IMUS))
    arguments = made.parse_args()
    print_header(f'Slip detection, {arguments.hours} hours and {arguments.events} events for each IMU')
    rows = [[imu, *_clean(IMUS[imu], arguments.hours)] for imu in arguments.imus]
    print_table(rows, ['IMU', 'hours', 'false alarms', 'largest difference / limit'])
    rows = [
        [imu, f'{mps:g}', *(_detected(ppr, IMUS[imu], mps, arguments.events) for ppr in PPRS)]
        for imu in arguments.imus
        for mps in SPEEDS_MPS
    ]
    print_table(rows, ['IMU', 'm/s', *map(str, PPRS)], 2)
    print(LEGEND)
    rows = [
        [imu, str(ppr), *_headings(ppr, IMUS[imu], arguments.events)] for imu in arguments.imus for ppr in PPRS[::2]
    ]
    print(f'Fused heading at the end of drives with a spin of {SPIN_MPS:g} m/s for 0.5 s:')
    print_table(rows, ['IMU', 'counts', 'rms error [degrees]', 'NEES', 'without detection', 'NEES'], 2)
    print(f'For each rate at 100 Hz, with reports at 20 Hz: {_step_us():.2f} us.')


def _clean(imu: ImuParams, hours: float) -> List[float]:
    """Return the hours of drives, their alarms, and the largest difference in units of its limit."""
    total_s, alarms, largest, seed = 0.0, 0, 0.0, 0
    while total_s < 3600.0 * hours:
        for ppr in PPRS:
            drive = clean_drive(ppr, imu, seed)
            total_s += 1e-9 * float(drive.stamps_ns[-1])
            of_drive, ratio = false_alarms(drive)
            alarms, largest, seed = alarms + of_drive, max(largest, ratio), seed + 1
    return [total_s / 3600.0, alarms, largest]


def _detected(ppr: float, imu: ImuParams, mps: float, events: int) -> str:
    times_s = np.array([detection_s(ppr, imu, mps, seed) for seed in range(events)])
    found_s = times_s[np.isfinite(times_s)]
    return f'{100.0 * len(found_s) / events:.0f} ({np.median(found_s):.2f})' if len(found_s) else '0'


def _headings(ppr: float, imu: ImuParams, events: int) -> List[str]:
    """Return the error of the fused heading [degrees] and its NEES, with detection and without it."""
    drives = [spun_drive(ppr, imu, SPIN_MPS, seed)[1] for seed in range(events)]
    cells: List[str] = []
    for has_detector in (True, False):
        errors_rad, nees = np.transpose([heading_error(drive, has_detector) for drive in drives])
        cells += [f'{np.degrees(np.sqrt(np.mean(errors_rad**2))):.2f}', f'{np.mean(nees):.3g}']
    return cells


def _step_us(seed: int = 0) -> float:
    """Return the processor time of 100 Hz of rates and 20 Hz of reports, by rate: best of 10."""
    drive, best_s = measured('curvy', 90, IMUS['mpu6050'], seed), np.inf
    rates = list(zip(drive.stamps_ns.tolist(), drive.rates_radps.tolist()))
    reports = [(stamp_ns, *counts) for stamp_ns, counts in zip(drive.report_stamps_ns.tolist(), drive.counts.tolist())]
    for _ in range(10):
        detector, begin_s = SlipDetector(FusionParams(), drive.wheels, drive.imu), time.process_time()
        for index, report in enumerate(reports):
            for rate in rates[5 * index : 5 * index + 5]:
                detector.take_gyro(*rate)
            detector.take_counts(*report)
        best_s = min(best_s, time.process_time() - begin_s)
    return 1e6 * best_s / len(rates)


if __name__ == '__main__':
    main()
