"""The laser models by the names of laser_model_type."""

from __future__ import annotations

from typing import Dict, Type

from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.beam_model import BeamModel
from diff_encoder_sim.localization.likelihood_field import LikelihoodField
from diff_encoder_sim.localization.likelihood_field_prob import LikelihoodFieldProb
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.localization.sensor import SensorModel

LASER_MODELS: Dict[str, Type[SensorModel]] = {
    'beam': BeamModel,
    'likelihood_field': LikelihoodField,
    'likelihood_field_prob': LikelihoodFieldProb,
}


def laser_model(params: AmclParams, grid: OccupancyGrid) -> SensorModel:
    """Build the model that laser_model_type names, for one map."""
    return LASER_MODELS[params.laser_model_type](params, grid)
