#!/usr/bin/env python3
"""How often drive.html names the right cause: random drives of a robot with one flaw each.

Encoders of 20 and 4096 counts are compared; `recorded 20`: the drive itself was counted with 20.
"""

from __future__ import annotations

import math
import sys

import numpy as np
from bench import ROOT, in_processes, parser, print_header, print_table

sys.path.append(str(ROOT / 'test' / 'support'))

from calibration_drives import TrueRobot, referenced_drive
from diff_encoder_sim.base.se2 import poses_of_wheels
from diff_encoder_sim.calibration.drive_causes import ComparedDrive, EncoderError, find_causes
from diff_encoder_sim.calibration.umbmark import WheelGeometry
from diff_encoder_sim.drives.comparison import SensorPlace

GOOD, ASSUMED = TrueRobot(0.2, 0.2, 0.4, 0.0, 0.0, 0.0, 0.0, 1e-7, 1e-7), WheelGeometry(0.2, 0.2, 0.4)
LARGEST, START_ANGLES, COARSER = 'Largest other cause: ', 40, 4.0
CASES = {  # robot, assumed geometry, what the conclusion contains
    'separation 3 %': (GOOD, ASSUMED._replace(separation_m=0.412), 'degrees per turn'),
    'ratio 1 %': (GOOD._replace(right_wheel_diameter_m=0.202), ASSUMED, 'degrees per metre'),
    'diameters 2 %': (GOOD, WheelGeometry(0.204, 0.204, 0.4), 'distances are'),
    'encoder of 20': (GOOD, ASSUMED, 'The encoder is the main cause with 20:'),
    'recorded 20': (GOOD._replace(counts=20), ASSUMED, 'The recorded encoder is the main cause'),
    'slip': (GOOD._replace(slip_m2_per_m=3e-5), ASSUMED, 'wheel slip'),
    'noisy reference': (GOOD._replace(noise_m=0.03, noise_rad=0.03), ASSUMED, 'noise of the reference'),
    'sensor 0.2 m off': (GOOD._replace(reference_x_m=-0.2), ASSUMED, 'sensor of the reference'),
}


def is_named(job: tuple) -> bool:
    """Return whether the right cause comes first."""
    name, seed, duration_s = job
    robot, assumed, text = CASES[name]
    drive = referenced_drive(robot, np.random.default_rng(seed), duration_s)
    compared = ComparedDrive([drive], assumed, 0.0, SensorPlace(), False, False, np.zeros((3, 3)), None)
    angles_rad = drive.drive.wheel_angles_rad

    def error_of(counts: float, scale: float = 1.0) -> EncoderError:
        phases_rad = np.random.default_rng(seed).uniform(0.0, 2.0 * math.pi, (START_ANGLES, 1, 2))
        count_rad = 2.0 * math.pi / counts
        read = np.concatenate((angles_rad[np.newaxis], np.floor((angles_rad + phases_rad) / count_rad) * count_rad))
        exact, *paths = poses_of_wheels(read, *assumed.radii_m, assumed.separation_m, 0.0, False)[..., :2]
        return EncoderError(f'{counts:g}', scale * float(np.square(paths - exact).sum(axis=2).mean()), 0.0)

    recorded = error_of(robot.counts / COARSER, 1.0 / COARSER**2)
    first, *others = find_causes(compared, [error_of(20), error_of(4096)], recorded).conclusion
    if text.startswith('The '):
        return text in first
    largest = next(each for each in others if each.startswith(LARGEST))
    return text in (others[0] if text.startswith('sensor') else largest)


def main() -> None:
    """Print the fractions."""
    options = parser(__doc__, seeds=20, workers=2, seconds=60).parse_args()
    print_header(__doc__)
    rows = []
    for name in CASES:
        named = in_processes(
            is_named, [(name, seed, options.seconds) for seed in range(options.seeds)], options.workers
        )
        rows.append((name, f'{sum(named)} of {len(named)}'))
    print_table(rows, ('flaw', 'named'))


if __name__ == '__main__':
    main()
