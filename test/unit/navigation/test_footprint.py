"""The robot's outline: its radii, and polygons that are none."""

import math

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.navigation.costmap_params import CostmapParams
from diff_encoder_sim.navigation.footprint import make_footprint

INSCRIBED_M = 0.26  # of 0.5 x 0.6 m and 0.01 m of padding


def test_radii_of_the_padded_rectangle():
    footprint = make_footprint([[0.25, 0.3], [-0.25, 0.3], [-0.25, -0.3], [0.25, -0.3]], 0.01)
    assert footprint.inscribed_radius_m == pytest.approx(INSCRIBED_M)
    assert footprint.circumscribed_radius_m == pytest.approx(math.hypot(0.26, 0.31))


def test_footprint_is_read_from_text_as_upstream_does():
    params = CostmapParams.from_mapping({'footprint': '[[0.2, 0.1], [-0.2, 0.1], [0, -0.3]]'}, '')
    assert params.footprint == [[0.2, 0.1], [-0.2, 0.1], [0.0, -0.3]]


@pytest.mark.parametrize(
    'footprint', [[[0, 1], [1, 0]], [[1, 1], [2, 1], [2, 2]], 'round', [[0.1, 0.1, 0.1], [-0.1, 0.1], [0, -0.1]]]
)
def test_a_footprint_must_be_a_polygon_around_the_robot(footprint):
    with pytest.raises(ConfigError, match='footprint'):
        CostmapParams.from_mapping({'footprint': footprint}, '')
