"""Write the page of a recorded drive: why its odometry is off the reference, with each encoder."""

from __future__ import annotations

import math
from pathlib import Path
from typing import List, Sequence

import numpy as np

from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.report.about import PageAbout, guide, robot_file, wheels_text
from diff_encoder_sim.analysis.result_tables import TextTable
from diff_encoder_sim.api.calibration import referenced
from diff_encoder_sim.api.recorded_sources import OpenedDrive, RecordedDrive, forward_drives, recorded_encoder
from diff_encoder_sim.base.se2 import PoseSeries
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.calibration.drive_causes import ComparedDrive, DriveCauses, EncoderError, find_causes
from diff_encoder_sim.calibration.umbmark import WheelGeometry
from diff_encoder_sim.drives.comparison import Comparison
from diff_encoder_sim.drives.odometry_wheels import OdometryWheels
from diff_encoder_sim.drives.reencoding import EncodedDrive, Encoder, ReadDrive, Table, encode_drive
from diff_encoder_sim.drives.trajectory_error import Alignment
from diff_encoder_sim.wheels.encoder_params import ppr_label

QUANTISATION_DRAWS = 40  # of start angles: the mean square to 10 %
UNIT = 'counts per wheel turn'
COARSER = 4.0  # than the recorded counts, whose own start angles are not known


def write_drive_page(
    page: Path,
    command: str,
    read: ReadDrive,
    opened: OpenedDrive,
    comparison: Comparison,
    encoded: Sequence[EncodedDrive],
    cells: Sequence[Table],
) -> List[str]:
    """Write the page, of tables with these cells; return its conclusion as lines for the terminal."""
    from diff_encoder_sim.calibration.drive_page import DrivePage, write_page  # noqa: PLC0415 - Altair takes a second

    path, odometry = opened.source.path, opened.robot.odometry
    diameter, compared = odometry.wheel_diameter, {one.encoder.label: one for one in encoded if one.errors}
    geometry = WheelGeometry(diameter.left, diameter.right, odometry.wheel_separation)
    if opened.poses and compared:
        causes = _causes(read, opened, comparison, list(compared.values()), geometry)
    else:
        text = f'Without a reference, errors are relative to {comparison.name}; their causes need --reference.'
        causes = DriveCauses([text], [])
    series = {label: comparison.along(one.paths) for label, one in compared.items()}
    spreads = {label: one.errors.spreads for label, one in compared.items() if one.errors}
    links = [*robot_file(opened.robot.file.where), *map(guide, ('recorded_drives', 'index'))]
    quality = 'assumed, as neither the bag nor an option has them' if opened.robot.is_guessed() else ''
    about = PageAbout(command, wheels_text(*geometry, quality), links)
    tables = [TextTable('Errors', list(heads), lines, texts=0) for lines, heads in cells]
    write_page(DrivePage(path.name, comparison.name, series, spreads, causes, tables), about, page)
    return ['', *causes.conclusion]


def _causes(
    read: ReadDrive,
    opened: OpenedDrive,
    comparison: Comparison,
    encoded: Sequence[EncodedDrive],
    geometry: WheelGeometry,
) -> DriveCauses:
    wheels, robot = opened.wheels, opened.robot
    known = np.array([1.0, 1.0, 1.0 if comparison.alignment is Alignment.ORIGIN else math.nan])  # aligned likewise
    paths = encode_drive(read, recorded_encoder(opened)).paths
    exact = Comparison('', [PoseSeries(path.stamps_ns, path.x_y_yaw * known) for path in paths])
    phases_rad = generator(robot.encoder.seed, 'quantisation').uniform(0.0, 2.0 * math.pi, (QUANTISATION_DRAWS, 2))

    def quantised(encoder: Encoder, name: str, ate_m: float = 0.0) -> EncoderError:
        errors = encode_drive(read, encoder, exact, phases_rad, opened.trial).errors
        return EncoderError(name, float(np.square(errors.of_draws[:, 0]).mean()) if errors else 0.0, ate_m)

    tested = [
        quantised(one.encoder, ppr_text(one.encoder.label, UNIT), one.errors.spreads['ate_m'].median)
        for one in encoded
        if one.errors and one.encoder.imu is None
    ]
    recorded, slip, covariance, calibration = None, None, np.zeros((3, 3)), robot.file.calibration
    if wheels.ppr:  # finer counts than the recorded ones: the mean square is proportional to the square of a count
        coarse = quantised(recorded_encoder(opened, COARSER), ppr_text(ppr_label(wheels.ppr), UNIT))
        recorded = coarse._replace(quantisation_m2=coarse.quantisation_m2 / COARSER**2)
    if calibration:
        slip = calibration.slip_m2_per_m.value, calibration.slip_rad2_per_rad.value
        covariance = np.array(calibration.geometry_covariance)
    parts = list(zip(forward_drives(read, wheels, robot), read.references))
    drives = list(referenced([RecordedDrive(opened.source.path, parts, wheels.ppr, robot, opened.trial, [])]))
    is_guessed = isinstance(wheels, OdometryWheels) or robot.is_guessed()
    assumed = geometry, robot.odometry.axle_x, comparison.place, comparison.is_own_clock, is_guessed
    return find_causes(ComparedDrive(drives, *assumed, covariance, slip), tested, recorded)
