"""Parameters of other programs that follow from a calibration: AMCL, diff_drive_controller, robot_localization."""

from __future__ import annotations

from typing import Any, Dict, Mapping, Optional, Sequence

import numpy as np

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.calibration.estimation import Calibration, Estimated, ReferencedDrive
from diff_encoder_sim.calibration.umbmark import LENGTHS, WheelGeometry
from diff_encoder_sim.localization.amcl_params import AmclParams

ODOMETRY_HZ = 50.0  # usual publish_rate of diff_drive_controller
LEAST_VARIANCE = 1e-9  # robot_localization accepts no 0
NOT_MEASURED = 1e6  # variance of the velocities that wheels do not measure
LEAST_UPDATE = 0.01  # AMCL may be set to update at any motion [m, rad]
LARGEST_ALPHA = 1000.0


def of_robot(found: Calibration, nominal: Optional[WheelGeometry], axle_x_m: float) -> Calibration:
    """Return the sensor's place in the base frame instead of from the axle, and the nominal of undetermined lengths."""
    x_m, interval_m = found.values['reference_x_m']
    changed = {'reference_x_m': Estimated(x_m + axle_x_m, (interval_m[0] + axle_x_m, interval_m[1] + axle_x_m))}
    for name, length_m in zip(LENGTHS, nominal or ()):
        if name in found.undetermined:
            low_m, high_m = found.values[name].interval
            changed[name] = Estimated(length_m, (min(low_m, length_m), max(high_m, length_m)))
    return found._replace(values={**found.values, **changed})


def derived_settings(
    found: Calibration, nominal: Optional[WheelGeometry], drives: Sequence[ReferencedDrive], amcl: AmclParams
) -> Dict[str, Dict[str, Any]]:
    """Return the parameters of `diff_drive_controller` and `amcl`; {} for both if the geometry remains unknown."""
    if nominal is None and {*LENGTHS} & {*found.undetermined}:
        return {'diff_drive_controller': {}, 'amcl': {}}
    values = {name: each.value for name, each in found.values.items()}
    count_m = 0.5 * values['left_wheel_diameter_m'] * max(each.count_rad[0] for each in drives)
    slip = values['slip_m2_per_m'], values['slip_rad2_per_rad']
    shown = {key: getattr(amcl, key) for key in ('odom_model_type', 'update_min_d', 'update_min_a')}
    alphas = amcl_alphas(*slip, count_m, values['wheel_separation_m'], amcl)
    controller = controller_params(values, nominal, [each.drive for each in drives])
    return {'diff_drive_controller': controller, 'amcl': {**shown, **alphas}}


def amcl_alphas(
    slip_m2_per_m: float, slip_rad2_per_rad: float, count_m: float, separation_m: float, amcl: AmclParams
) -> Dict[str, float]:
    """Return odom_alpha1 to odom_alpha4 with which AMCL spreads its particles as slip and counts spread the robot.

    AMCL moves its particles after a straight line of update_min_d or a turn of update_min_a, for which this is exact.
    The variance of a wheel's travel is that of its slip and of the rounding to counts at both ends. Alpha1 is of the
    heading after a turn, alpha2 after a line (half of it in each of two noisy rotations); alpha3 and alpha4 are of the
    distance after a line and a turn. `diff-corrected` makes a variance of alpha times the squared line or turn, `diff`
    a standard deviation (`localization.particles.move_noise`).
    """
    line_m, turn_rad = (max(least, LEAST_UPDATE) for least in (amcl.update_min_d, amcl.update_min_a))
    line_m2, turn_m2 = (slip_m2_per_m * way_m + count_m**2 / 6.0 for way_m in (line_m, 0.5 * turn_rad * separation_m))
    variances = {
        'odom_alpha1': (2.0 * turn_m2 / separation_m**2 + slip_rad2_per_rad * turn_rad, turn_rad),
        'odom_alpha2': (line_m2 / separation_m**2, line_m),
        'odom_alpha3': (line_m2 / 2.0, line_m),
        'odom_alpha4': (turn_m2 / 2.0, turn_rad),
    }
    power = 1.0 if amcl.odom_model_type == 'diff-corrected' else 0.5
    alphas = {name: min(variance**power / move**2, LARGEST_ALPHA) for name, (variance, move) in variances.items()}
    return {name: float(f'{alpha:.4g}') for name, alpha in alphas.items()}


def controller_params(
    values: Mapping[str, float], nominal: Optional[WheelGeometry], drives: Sequence[Drive]
) -> Dict[str, Any]:
    """Return parameters of diff_drive_controller; without a nominal geometry its multipliers are of the calibrated one.

    The covariance of the twist is that of white noise at `ODOMETRY_HZ` which adds up to the slip of the whole drives.
    That of the pose would grow with the distance; the controller's is constant.
    """
    geometry = WheelGeometry(*(values[name] for name in LENGTHS))
    way_m = turn_rad = duration_s = 0.0
    for drive in drives:
        times_s = (drive.stamps_ns - drive.stamps_ns[0]) / NANOSECONDS_PER_SECOND
        grid_s = np.append(np.arange(0.0, times_s[-1], 1.0), times_s[-1])  # counts at rest are noise, not a way
        angles_rad = [np.interp(grid_s, times_s, angles) for angles in drive.wheel_angles_rad.T]
        left_m, right_m = np.diff(angles_rad) * np.array(geometry.radii_m)[:, np.newaxis]
        way_m += float(np.abs([left_m, right_m]).sum())
        turn_rad += float(np.abs(right_m - left_m).sum()) / geometry.separation_m
        duration_s += float(times_s[-1])
    slip_m2, rate = values['slip_m2_per_m'] * way_m, ODOMETRY_HZ / duration_s
    heading_rad2 = slip_m2 / geometry.separation_m**2 + values['slip_rad2_per_rad'] * turn_rad
    linear, angular = max(rate * slip_m2 / 4.0, LEAST_VARIANCE), max(rate * heading_rad2, LEAST_VARIANCE)
    known = nominal or geometry
    return {
        'wheel_separation': known.separation_m,
        'wheel_radius': 0.5 * sum(known.radii_m),
        **geometry.multipliers(known),
        'twist_covariance_diagonal': [linear, linear, NOT_MEASURED, NOT_MEASURED, NOT_MEASURED, angular],
    }
