"""The wheels of a trial's robot: between the parameters of its nodes and the trial that is written into its bag."""

from __future__ import annotations

from typing import Any, Dict

from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

# Fields of Trial, by the parameters of which they have the names.
OF_ODOMETRY = ('wheel_diameter', 'wheel_separation', 'axle_x')
OF_ENCODER = ('left_joint', 'right_joint', 'left_reversed', 'right_reversed')


def wheels_of(odometry: OdometryParams, encoder: EncoderParams) -> Dict[str, Any]:
    """Return the fields of Trial that whoever computes odometry from the bag's pulses or angles needs."""
    return {
        **{name: getattr(odometry, name) for name in OF_ODOMETRY},
        **odometry.uncertainty,
        **{name: getattr(encoder, name) for name in OF_ENCODER},
        'counter_modulus': encoder.counter_modulus,
    }
