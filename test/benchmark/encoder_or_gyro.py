#!/usr/bin/env python3
"""At which counts the heading from an encoder is as uncertain as that from a gyroscope: closed form and Monte Carlo.

Straight drives at 0.1 m/s on exact wheels, after 10 s at rest. --out docs/images/encoder_or_gyro.png draws the figure.
"""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import List, Tuple

import numpy as np
import vl_convert
from bench import in_processes, parser, print_header, print_table

from diff_encoder_sim.advice.advice_page import heading_chart
from diff_encoder_sim.advice.drive_draws import DriveDraws
from diff_encoder_sim.advice.fused_draws import FUSED_CAUSES, STANDSTILL_S, FusedDraws
from diff_encoder_sim.analysis.charts.chart_page import VEGA_LITE, drawing_dict
from diff_encoder_sim.analysis.charts.figures import CONFIG, PNG_SCALE
from diff_encoder_sim.analysis.closed_form import crossover_counts, gyro_heading_std_rad
from diff_encoder_sim.analysis.results_table import RobotGeometry
from diff_encoder_sim.navigation.goal_stopping import StopSpread
from diff_encoder_sim.robots.wheel_quality import CALIBRATED
from drawn_drives import encoder_of, robot_of, rolled
from encoder_drives import RADIUS_M, SEPARATION_M
from fusion_drives import IMUS

DURATIONS_S, SPEED_MPS, RATE_HZ = (10.0, 60.0, 180.0), 0.1, 20.0
GEOMETRY, STOP = RobotGeometry(2.0 * RADIUS_M, SEPARATION_M), StopSpread(0.1, 0.0)
DRAWN = ('mpu6050', 'bno055', 'stim300')  # the BMI088 has the gyroscope of the BNO055
SIZE_PX = {'width': 640, 'height': 330}


def main() -> None:
    made = parser(__doc__, draws=2000, workers=2)
    made.add_argument('--out', type=Path, help='write the figure (PNG)')
    arguments = made.parse_args()
    print_header(f'Encoder or gyroscope, {arguments.draws} draws')
    cells = [(*cell, arguments.draws) for cell in itertools.product(IMUS, DURATIONS_S)]
    rows = in_processes(_row, cells, arguments.workers)
    print_table(rows, ['IMU', 'seconds', 'crossover [counts]', 'encoder [deg]', 'gyro [deg]', 'ratio', 'allowed'], 1)
    if arguments.out:
        chart = heading_chart({name: IMUS[name] for name in DRAWN}, GEOMETRY, {CALIBRATED.text: _calibrated()})
        spec = {**drawing_dict(chart.drawing), **SIZE_PX, 'config': CONFIG, 'background': 'white', 'padding': 8}
        arguments.out.write_bytes(vl_convert.vegalite_to_png(spec, vl_version=VEGA_LITE, scale=PNG_SCALE))


def _calibrated():
    return robot_of(**CALIBRATED.errors)


def _row(cell: Tuple[str, float, int]) -> List[str]:
    name, duration_s, draws = cell
    drive = rolled(('straight', SPEED_MPS * duration_s), speed=SPEED_MPS)
    plain, time_s = DriveDraws(drive, robot_of(stop=STOP), 1), drive.rolled.times_s[-1:]
    (counts,) = crossover_counts(GEOMETRY, gyro_heading_std_rad(IMUS[name], STANDSTILL_S, time_s), np.zeros(1))
    of_encoder_rad = plain.errors([encoder_of(float(counts))], draws)[0][:, 2].std()
    fused, at_rest = FusedDraws(plain, IMUS[name], RATE_HZ), round(STANDSTILL_S * RATE_HZ)
    rates = fused.rates_radps(0, draws, FUSED_CAUSES) - fused.rates_radps(0, draws, {})
    of_gyro_rad = ((rates[:, at_rest:] - rates[:, :at_rest].mean(axis=1, keepdims=True)).sum(axis=1) / RATE_HZ).std()
    ratio = of_encoder_rad / of_gyro_rad
    stds = (f'{np.degrees(std):.4f}' for std in (of_encoder_rad, of_gyro_rad))
    return [name, f'{time_s[0]:.0f}', f'{counts:.0f}', *stds, f'{ratio:.3f}', 'yes' if 0.9 <= ratio <= 1.1 else 'no']


if __name__ == '__main__':
    main()
