"""The trial that a reencoded bag is of."""

from __future__ import annotations

from diff_encoder_sim.drives.trial_definition import OF_ODOMETRY, Trial
from diff_encoder_sim.wheels.catalogue import resolution_text
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams


def with_encoder(trial: Trial, encoder: EncoderParams, odometry: OdometryParams, name: str = '') -> Trial:
    """Return the same trial as if it had been driven with another encoder, which may have a name, and odometry."""
    geometry = {key: getattr(odometry, key) for key in OF_ODOMETRY}
    resolution = resolution_text(encoder.encoder)
    counted = {'ppr': encoder.counts_per_turn, 'encoder': name, 'resolution': resolution}
    counted['counter_modulus'] = encoder.counter_modulus
    return trial.model_copy(update={**counted, 'odom': 'encoder', **geometry, **odometry.uncertainty})
