"""AMCL's parameters: upstream's defaults, and bad values."""

import math

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.localization.amcl_params import AmclParams


@pytest.mark.parametrize(
    ('given', 'message'),
    [
        (dict(odom_model_type='omni'), "odom_model_type: given 'omni'; allowed: 'diff' or"),
        (dict(laser_model_type='lidar'), "laser_model_type: given 'lidar'; allowed: 'beam', "),
        (dict(min_particles=10, max_particles=5), 'min_particles .10. of at most max_particles'),
        (dict(laser_max_beams=1), 'laser_max_beams: given 1; allowed: 2 to 100000'),
        (dict(kld_err=0.0), 'kld_err: given 0.0; allowed: 1e-6 to 10'),
        (dict(initial_pose_x=math.nan), 'initial_pose_x: given nan'),
        (dict(resample_interval=0), 'resample_interval: given 0'),
        (dict(laser_sigma_hit='wide'), "laser_sigma_hit: given 'wide'"),
        (dict(max_particle=10), "max_particle: unknown key; did you mean 'max_particles'?"),
    ],
)
def test_bad_parameters_are_named(given, message):
    with pytest.raises(ConfigError, match=message):
        AmclParams.from_mapping(given, 'amcl.yaml')


def test_defaults_are_upstreams():
    params = AmclParams()
    assert (params.min_particles, params.max_particles, params.kld_err, params.kld_z) == (100, 5000, 0.01, 0.99)
    assert (
        params.laser_max_beams,
        params.laser_z_hit,
        params.laser_z_short,
        params.laser_z_max,
        params.laser_z_rand,
    ) == (30, 0.95, 0.1, 0.05, 0.05)
    assert (params.recovery_alpha_slow, params.recovery_alpha_fast) == (0.001, 0.1)
