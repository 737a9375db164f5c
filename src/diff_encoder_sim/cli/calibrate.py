"""calibrate: find the wheels of a robot from its own drives, and predict the next one.

Estimates both diameters, the separation, the place and the delay of a reference (motion capture, camera, laser), and
slip, each with an interval. Writes them as a robot file, which all commands accept, and as YAML for
diff_drive_controller, robot_localization and AMCL.
"""

from __future__ import annotations

import logging
import sys
from functools import partial
from typing import Optional, Sequence

from diff_encoder_sim.api.options import CalibrateOptions
from diff_encoder_sim.base.command_line import as_called, user_errors
from diff_encoder_sim.cli.arguments import read_options

NOTES = """\
Drive curves in both directions, a few minutes in total: a straight line does not determine the separation. Of several
drives each one is predicted by the others. The reference may be off the axle and late, and may have no yaw.

--reference scan needs the nominal geometry (--robot, or the bag's trial) and the laser's frame in /tf_static."""

EXAMPLES = [
    'drive_1.bag drive_2.bag --robot burger --reference /mocap/pose --out my_robot.yaml',
    'drive.bag --robot my_robot.yaml --reference scan --out calibrated.yaml --json calibrated.json',
    '--csv drive.csv --columns t left right --ticks-per-revolution 4096 --reference-columns t x y --out my_robot.yaml',
    '--umbmark cw.bag ccw.bag --robot burger',
    '--umbmark --ends ends.csv --side 4 --robot burger --out my_robot.yaml',
]

API = 'api.calibration'  # imported by the command on demand
parse = partial(read_options, CalibrateOptions, name='calibrate', description=__doc__, examples=EXAMPLES, notes=NOTES)


@user_errors('calibrate')
def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    from diff_encoder_sim.api.calibration import calibration

    logging.basicConfig(format=f'{as_called("calibrate")}: %(message)s')
    done = calibration(parse(arguments))
    for note in done.notes:
        print(f'{as_called("calibrate")}: {note}', file=sys.stderr)
    print(done.text)
    for file in done.files:
        print(file)
