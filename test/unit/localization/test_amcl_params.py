"""AMCL's parameters: upstream's names and defaults, and bad values."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.localization.amcl_params import AmclParams
from upstream_params import AMCL, different, read_config, wrong_types


@pytest.mark.parametrize(
    ('given', 'message'),
    [
        (dict(odom_model_type='omni'), "odom_model_type: given 'omni'; allowed: 'diff' or"),
        (dict(min_particles=10, max_particles=5), 'min_particles .10. of at most max_particles'),
        (dict(max_particle=10), "max_particle: unknown key; did you mean 'max_particles'?"),
    ],
)
def test_bad_parameters_are_named(given, message):
    with pytest.raises(ConfigError, match=message):
        AmclParams.from_mapping(given, 'amcl.yaml')


@pytest.mark.parametrize('file', ['amcl.yaml', 'amcl_accurate.yaml'])
def test_our_files_fit_upstream(file):
    """Upstream knows every parameter and its type; a default that differs must stand in the file."""
    ours = read_config(file)
    assert set(ours) - set(AMCL) <= {'seed', 'axle_x', 'lost_fraction', 'lost_distance', 'lost_scans'}  # not upstream's
    assert wrong_types(ours, (AMCL,)) == []
    assert different(AMCL, AmclParams(), ours) == set()


def test_both_files_have_the_same_keys_and_amcl_takes_upstreams():
    assert set(read_config('amcl_accurate.yaml')) == set(read_config('amcl.yaml'))
    assert AmclParams.from_mapping(AMCL, 'amcl') == AmclParams()


def test_amcl_takes_what_upstreams_node_writes_to_the_parameter_server():
    """dynamic_reconfigure adds restore_defaults, and has an older name for one of the others."""
    older = 'beam_skip_error_threshold_'
    dumped = {**AMCL, 'restore_defaults': False, older: 0.0}
    assert AmclParams.from_mapping(dumped, 'amcl') == AmclParams(beam_skip_error_threshold=0.0)
    with pytest.raises(ConfigError, match='beam_skip_error_threshold: given 1.5'):
        AmclParams.from_mapping({older: 1.5}, 'amcl')
    # What has no effect leaves the campaigns' fingerprints as they are.
    assert not {older, 'restore_defaults'} & set(AmclParams().model_dump())
