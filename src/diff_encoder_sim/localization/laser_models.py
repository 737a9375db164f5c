"""The laser models by the names of laser_model_type."""

from __future__ import annotations

from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.beam_model import BeamModel
from diff_encoder_sim.localization.likelihood_field import LikelihoodField
from diff_encoder_sim.localization.likelihood_field_prob import LikelihoodFieldProb
from diff_encoder_sim.localization.sensor import SensorModel
from diff_encoder_sim.mapping.occupancy_grid import OccupancyGrid


def laser_model(params: AmclParams, grid: OccupancyGrid) -> SensorModel:
    """The parameters' model on a map."""
    models = {'beam': BeamModel, 'likelihood_field': LikelihoodField, 'likelihood_field_prob': LikelihoodFieldProb}
    return models[params.laser_model_type](params, grid)
