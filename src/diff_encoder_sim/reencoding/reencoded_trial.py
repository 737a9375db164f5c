"""The trial that a reencoded bag is of."""

from __future__ import annotations

from diff_encoder_sim.encoders.pulses import PerWheel
from diff_encoder_sim.odometry.wheel_odometry import OdometryParams
from diff_encoder_sim.trials.trial_definition import Trial
from diff_encoder_sim.trials.trial_wheels import OF_ODOMETRY


def with_encoder(trial: Trial, ppr: PerWheel, odometry: OdometryParams) -> Trial:
    """Return the same trial as if it had been driven with another encoder and odometry."""
    geometry = {name: getattr(odometry, name) for name in OF_ODOMETRY}
    return trial.model_copy(update={'ppr': ppr, 'odom': 'encoder', **geometry})
