"""All laser models: what they have in common."""

import numpy as np
import pytest

from amcl_world import pillar_room, simulated_scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.laser_models import laser_model
from laser_model_cases import params


@pytest.mark.parametrize('model', ['beam', 'likelihood_field', 'likelihood_field_prob'])
def test_the_true_pose_is_the_likeliest(model):
    grid, pose = pillar_room(), Pose2D(0.4, -0.9, 2.0)
    laser = laser_model(params(laser_model_type=model, laser_max_beams=60), grid)
    others = np.array(pose) + np.array(
        [[0.4, 0, 0], [-0.4, 0, 0], [0, 0.4, 0], [0, -0.4, 0], [0, 0, 0.3], [0, 0, -0.3], [0, 0, 3.1]]
    )
    particles = np.vstack([pose, others])
    beams = laser.beams(simulated_scan(grid, pose), Pose2D(0, 0, 0))
    assert laser.likelihoods(particles, beams, False).factors.argmax() == 0
