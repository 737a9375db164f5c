"""Predictions of drives that a calibration has not seen: where odometry ends, with its interval."""

from __future__ import annotations

import math
from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import wrap_angles
from diff_encoder_sim.calibration import estimation
from diff_encoder_sim.calibration.estimation import Calibration, ReferencedDrive
from diff_encoder_sim.calibration.likelihood import INDEX, NOISE, NOISE_STEP, STEPS, Track, moved
from diff_encoder_sim.calibration.umbmark import WheelGeometry

LEVEL = 0.9
ALIGNED_OVER_M = 1.0  # the start of a drive, by which odometry is placed on the reference


class Prediction(NamedTuple):
    """The end of a drive in the frame of its start: along [m], across [m], and yaw [rad], NaN if unknown."""

    drive: str
    duration_s: float
    length_m: float
    error: np.ndarray  # (3,) observed: reference minus odometry
    std: np.ndarray  # (3,) expected: by calibration, slip and reference
    interval: np.ndarray  # (3, 2) of the error, 90 %
    nominal_error: Optional[np.ndarray]  # (3,) of odometry with the nominal geometry

    @property
    def is_inside(self) -> np.ndarray:
        """Return (3,) whether the error is inside its interval."""
        return (self.interval[:, 0] <= self.error) & (self.error <= self.interval[:, 1])


def cross_predictions(
    drives: Sequence[ReferencedDrive], nominal: Optional[WheelGeometry], near: np.ndarray
) -> List[Prediction]:
    """Predict each drive from all others; the second half of a single one from its first; `near` as in `calibrate`."""
    has_slip = len(near) > NOISE.stop
    parts, tested = (drives, range(len(drives))) if len(drives) > 1 else (_halves(drives[0]), range(1, 2))
    return [
        predict(estimation.calibrate([*parts[:at], *parts[at + 1 :]], nominal, near, has_slip), parts[at], nominal)
        for at in tested
    ]


def predict(calibration: Calibration, drive: ReferencedDrive, nominal: Optional[WheelGeometry] = None) -> Prediction:
    """Predict the end of a drive, or of its longest part between disturbances; ConfigError if it is too short."""
    parameters, uncertainty = calibration.parameters, calibration.uncertainty
    pieces = estimation.pieces_of(estimation.track_of(drive), parameters)
    if not pieces:
        raise ConfigError(f'{drive.name}: given no part without a disturbance; allowed: a steadier drive')
    track = max(pieces, key=lambda each: float(np.ptp(each.pose_times_s)))
    track.start_yaw_rad = estimation.start_heading(track, parameters, ALIGNED_OVER_M)
    error, covariance = _end_error(track, parameters)
    slopes = np.zeros((3, len(parameters)))
    for index in np.flatnonzero(np.diag(uncertainty.expected)).tolist():
        ahead, behind = (_end_error(track, moved(parameters, index, sign * STEPS[index]))[0] for sign in (1.0, -1.0))
        slopes[:, index] = (ahead - behind) / (2.0 * STEPS[index])
    more = np.diag(covariance)
    by_noise = [
        (np.diag(_end_error(track, moved(parameters, index, NOISE_STEP))[1]) - more) / NOISE_STEP
        for index in range(*NOISE.indices(len(parameters)))
    ]
    std = np.sqrt(more + [uncertainty.variance(row) for row in slopes])
    freedoms = map(uncertainty.freedom, slopes, more, np.transpose(by_noise))
    reach = std * [estimation.reach_of(LEVEL, freedom) for freedom in freedoms]
    nominal_error = None if nominal is None else _end_error(track, estimation.with_geometry(parameters, nominal))[0]
    motions = track.motions(parameters, track.pose_times_s[[0, -1]] - parameters[INDEX['reference_delay_s']])
    length_m = float(0.5 * np.diff(motions[:, 3:5], axis=0).sum())
    duration_s = float(np.ptp(track.pose_times_s))
    return Prediction(drive.name, duration_s, length_m, error, std, np.column_stack((-reach, reach)), nominal_error)


def _end_error(track: Track, parameters: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the mean error of the last part (3,) and its covariance (3, 3), without that of the parameters."""
    delay_s = parameters[INDEX['reference_delay_s']]
    motions, rows = track.motions(parameters, track.middles_s - delay_s), slice(track.first_rows[-2], None)
    of_rows, path = estimation.odometry_path(track, parameters)
    is_aligned = track.first_rows[track.first_parts[:-1]] < estimation.rows_of_start(path, ALIGNED_OVER_M)
    is_aligned[:2] = True
    _, _, state, covariance = track.filtered(parameters, is_aligned)
    at_rows = of_rows[rows, :3]
    turn = state[2] - motions[-1, 2]
    yaws = at_rows[:, 2] + turn
    moved_m = (at_rows[:, 0] + 1j * at_rows[:, 1] - complex(*motions[-1, :2])) * np.exp(1j * turn)
    sensors = complex(*parameters[3:5]) * np.exp(1j * yaws)
    off = track.poses[rows, 0] + 1j * track.poses[rows, 1] - complex(*state[:2]) - moved_m - sensors
    off_yaw = wrap_angles(track.poses[rows, 2] - yaws - parameters[5])
    of_path = (moved_m + sensors).mean()
    by_pose = np.array([[1.0, 0.0, -of_path.imag], [0.0, 1.0, of_path.real], [0.0, 0.0, 1.0]])
    total = by_pose @ covariance[:3, :3] @ by_pose.T
    noise = np.exp(2.0 * parameters[9:13])
    stated = np.zeros((3, 3))
    components = 3 if track.has_yaw else 2
    stated[:components, :components] = track.covariances[rows].mean(axis=0)
    scales = np.sqrt(noise[:2] / len(off) + noise[2:])[[0, 0, 1]]
    total += stated * np.outer(scales, scales)
    start = -track.start_yaw_rad
    turned = off.mean() * np.exp(1j * start)
    back = np.eye(3)
    back[:2, :2] = [[math.cos(start), -math.sin(start)], [math.sin(start), math.cos(start)]]
    return np.array([turned.real, turned.imag, off_yaw.mean()]), back @ total @ back.T


def _halves(drive: ReferencedDrive) -> List[ReferencedDrive]:
    """Split a drive in the middle of its reference."""
    stamps_ns, reference = drive.drive.stamps_ns, drive.reference
    middle_ns = (reference.stamps_ns[0] + reference.stamps_ns[-1]) // 2
    halves = []
    for half, is_in in (('first half', np.less_equal), ('second half', np.greater)):
        rows = is_in(reference.stamps_ns, middle_ns)
        covariances = None if reference.covariances is None else reference.covariances[rows]
        part = reference._replace(
            stamps_ns=reference.stamps_ns[rows], poses=reference.poses[rows], covariances=covariances
        )
        angles = Drive(*(each[is_in(stamps_ns, middle_ns)] for each in (stamps_ns, drive.drive.wheel_angles_rad)))
        halves.append(drive._replace(name=f'{drive.name}, {half}', drive=angles, reference=part))
    return halves
