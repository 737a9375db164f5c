"""What odometry's covariance is told of the wheels: the errors that the robot has, where a user does not say others.

A bias has no spread over trials of one robot: it is taken for one draw from robots whose errors spread by its size.
Errors that differ from robot to robot have their own spread.
"""

from __future__ import annotations

import math
from typing import Any, Dict, Mapping

from diff_encoder_sim.base.params import nested, with_changes
from diff_encoder_sim.simulation.simulator import CONTACT_CURVE_NOISE, CONTACT_DISTANCE_STD, WheelErrorParams
from diff_encoder_sim.wheels.odometry_params import OdometryParams


def wheel_uncertainty(errors: WheelErrorParams) -> Dict[str, float]:
    """Return the parameters of odometry, by their names, that describe the errors of wheels."""
    left, right = errors.travel_errors()
    distance, spread = 0.5 * (left + right), errors.radius_spread / math.sqrt(2.0)
    return {
        'motion_noise': errors.slip_noise,
        'distance_std': math.hypot(distance, spread),
        'turn_std': math.hypot(
            distance - errors.wheel_separation_error, math.hypot(spread, errors.wheel_separation_spread)
        ),
        'diameter_difference_std': math.hypot(right - left, 2.0 * spread),
    }


def with_uncertainty(odometry: OdometryParams, errors: WheelErrorParams) -> OdometryParams:
    """Return odometry that is told of simulated wheels' errors and contact, where it is not told otherwise."""
    values = wheel_uncertainty(errors)
    values['distance_std'] = math.hypot(values['distance_std'], CONTACT_DISTANCE_STD)
    values['curve_noise'] = CONTACT_CURVE_NOISE
    untold = {key: value for key, value in values.items() if getattr(odometry, key) is None}
    return with_changes(odometry, untold, 'simulator.wheel_errors') if untold else odometry


def uncertainty_of_robot(settings: Mapping[str, Any]) -> Dict[str, float]:
    """Return what a robot's own file says of its wheels' errors: no real wheel has none, so 0 says nothing.

    Args:
        settings: of a robot, by dotted keys.
    """
    given = nested(settings).get('simulator', {}).get('wheel_errors', {})
    errors = WheelErrorParams.from_mapping(given, 'simulator.wheel_errors')
    return {key: value for key, value in wheel_uncertainty(errors).items() if value}
