"""What a bag says of the trial that it was recorded from."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Optional

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.encoders.pulses import PerWheel
from diff_encoder_sim.odometry.wheel_odometry import OdometryParams
from diff_encoder_sim.recording.bag_source import BagSource
from diff_encoder_sim.recording.topics import TRIAL
from diff_encoder_sim.serialization.message_types import STRING
from diff_encoder_sim.serialization.typestore import STORE
from diff_encoder_sim.trials.trial_definition import Trial


def recorded_trial(path: Path, source: BagSource) -> Optional[Trial]:
    """The trial of a bag; None where it is of none.

    Raises:
        ConfigError: what the bag says is no trial.
    """
    if source.is_cdr or source.topics.get(TRIAL) != STRING:
        return None
    message = next(source.messages((TRIAL,)), None)
    if message is None:
        return None
    try:
        about = json.loads(STORE.deserialize_ros1(message.raw, STRING).data)
    except ValueError as error:
        raise ConfigError(f'{path}: {TRIAL}: not JSON: {error}') from None
    return Trial.from_mapping(about, f'{path}: {TRIAL}')


def with_encoder(trial: Trial, ppr: PerWheel, odometry: OdometryParams) -> Trial:
    """The same trial, as if it had been driven with another encoder and odometry."""
    return trial.model_copy(
        update={
            'ppr': ppr,
            'odom': 'encoder',
            'wheel_diameter': odometry.wheel_diameter,
            'wheel_separation': odometry.wheel_separation,
        }
    )
