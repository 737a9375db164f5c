#!/usr/bin/env python3
"""What each error of an encoder does to the odometry of a straight drive: over seeds, beside its closed form.

The wheels turn evenly, from phases drawn by the seed; encoder and odometry are those of the nodes. In brackets the 99 %
interval of what was measured. docs/encoders.md derives the closed forms.
"""

from __future__ import annotations

import math
from typing import Dict, List, NamedTuple

import numpy as np
from bench import parser, print_header, print_table
from scipy import stats

from encoder_drives import RADIUS_M, SEPARATION_M, m_per_pulse, straight_drive

LENGTH_M, SPEED_MPS = 20.0, 0.9
CONFIDENCE = 0.99
MEASURES = {'y': 'sd of y [mm]', 'yaw': 'sd of yaw [mrad]', 'short': 'short by, mean [mm]'}


class Case(NamedTuple):
    """An error, what is measured of it, and what the closed form says."""

    name: str
    ppr: float
    encoder: Dict
    measure: str  # one of MEASURES
    expected: float  # [mm], [mrad]


def _across(ppr: float, variance: float) -> float:
    return 1e3 * LENGTH_M * m_per_pulse(ppr) / SEPARATION_M * math.sqrt(variance)


def _cases() -> List[Case]:
    cases = []
    for ppr in (90, 1024):
        cases.append(Case('none', ppr, {}, 'y', _across(ppr, 1 / 6)))
        for sigma in (0.1, 0.3):
            error = {'edge_error': sigma}
            cases.append(Case(f'edges, {sigma} counts', ppr, error, 'y', _across(ppr, 1 / 6 + 2 * sigma**2)))
    hall = {'sensor': 'hall', 'sensor_error': 6.0}
    cases.append(Case('hall sensors, 6 degrees', 90, hall, 'y', _across(90, 1 / 6 + 2 * 0.1**2)))
    for amplitude_rad in (0.005, 0.02):
        expected = 1e3 * LENGTH_M * RADIUS_M * amplitude_rad / SEPARATION_M
        cases.append(Case(f'eccentricity, {amplitude_rad} rad', 4096, {'eccentricity': amplitude_rad}, 'y', expected))
    for missed in (0.001, 0.01):
        variance_m2 = 2 * LENGTH_M * m_per_pulse(1024) * missed * (1 - missed)
        heading_rad = math.sqrt(variance_m2) / SEPARATION_M
        faults = {'faults': {'missed': missed}}
        cases.append(Case(f'missed, {missed:g}', 1024, faults, 'short', 1e3 * LENGTH_M * missed))
        cases.append(Case(f'missed, {missed:g}', 1024, faults, 'yaw', 1e3 * heading_rad))
        cases.append(Case(f'missed, {missed:g}', 1024, faults, 'y', 1e3 * heading_rad * LENGTH_M / math.sqrt(3)))
    return cases


def main() -> None:
    arguments = parser(__doc__, seeds=400).parse_args()
    print_header(f'Errors of encoders, {LENGTH_M:g} m straight, {arguments.seeds} seeds')
    rows, inside = [], []
    for case in _cases():
        low, found, high = _measured(case, arguments.seeds)
        inside.append(low <= case.expected <= high)
        measured, is_inside = f'{found:.2f} ({low:.2f} to {high:.2f})', 'yes' if inside[-1] else 'NO'
        about = [case.name, f'{case.ppr:g}', MEASURES[case.measure]]
        rows.append([*about, f'{case.expected:.2f}', measured, is_inside])
    print_table(rows, ['error', 'PPR', 'of odometry', 'closed form', 'measured', 'inside'], 3)
    print(f'{sum(inside)} of {len(inside)} closed forms are inside the 99 % interval.')


def _measured(case: Case, seeds: int) -> np.ndarray:
    """Return the lower end of the interval, the estimate, and its upper end."""
    about = case.ppr, case.encoder, SPEED_MPS
    ends = [straight_drive(LENGTH_M, seed, *about).base_pose_in_odom for seed in range(seeds)]
    x_m, y_m, yaw_rad = np.array(ends).T
    tail = (1.0 - CONFIDENCE) / 2.0
    if case.measure == 'short':
        # The heading's random walk shortens x, too, by its final variance times S / 4 on average.
        short_m = LENGTH_M - x_m - np.square(yaw_rad) * LENGTH_M / 4.0
        half = stats.norm.ppf(1.0 - tail) * short_m.std(ddof=1) / math.sqrt(seeds)
        return 1e3 * np.array([short_m.mean() - half, short_m.mean(), short_m.mean() + half])
    return 1e3 * _std_interval({'y': y_m, 'yaw': yaw_rad}[case.measure], tail)


def _std_interval(values: np.ndarray, tail: float) -> np.ndarray:
    """By resampling: quantisation's errors are not Gaussian."""
    rng = np.random.default_rng(0)
    drawn = rng.choice(values, (2000, len(values))).std(axis=1, ddof=1)
    low, high = np.quantile(drawn, [tail, 1.0 - tail])
    return np.array([low, values.std(ddof=1), high])


if __name__ == '__main__':
    main()
