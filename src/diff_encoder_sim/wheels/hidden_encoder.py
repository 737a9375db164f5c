"""Says where a motion noise that nobody gave states more error than the encoder makes."""

from __future__ import annotations

import math

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.wheels.odometry_covariance import quantisation_covariance
from diff_encoder_sim.wheels.odometry_params import USUAL_MOTION_NOISE, OdometryParams

STRAIGHT_M = 20.0  # the path by which the two are compared: the paper's straight test


def hidden_encoder(params: OdometryParams) -> str:
    """Return a line where the usual motion noise hides the encoder after a straight line; '' where it does not.

    Args:
        params: of odometry whose motion noise nobody gave.
    """
    encoder_m, noise_m = encoder_lateral_std(params), noise_lateral_std(USUAL_MOTION_NOISE, params.wheel_separation)
    if noise_m <= encoder_m:
        return ''
    return (
        f"/odom's covariance hides the encoder: after {STRAIGHT_M:g} m straight ahead it states {1e3 * noise_m:.0f} mm "
        f'across for slip of {USUAL_MOTION_NOISE:g} m^2/m, the default, and {1e3 * encoder_m:.3g} mm for the encoder; '
        "set config.motion_noise, or simulator.wheel_errors.slip_noise in the robot file, to the robot's own"
    )


def encoder_lateral_std(params: OdometryParams) -> float:
    """Return the standard deviation across [m] that the encoder's counts cause after a straight line."""
    end = Pose2D(STRAIGHT_M, 0.0, 0.0)
    covariance = quantisation_covariance(end, *params.reading_variances_m2, 0.0, params.wheel_separation)
    return math.sqrt(covariance.yy)


def noise_lateral_std(motion_noise: float, wheel_separation_m: float) -> float:
    """Return the standard deviation across [m] that motion noise [m^2/m] causes after a straight line."""
    return math.sqrt(2.0 * motion_noise * STRAIGHT_M**3 / 3.0) / wheel_separation_m
