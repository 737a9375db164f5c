"""The odometry's parameters: which values are refused, and how."""

import math

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.wheels.odometry_params import OdometryParams


@pytest.mark.parametrize('key', ['wheel_diameter', 'wheel_separation', 'max_wheel_speed'])
@pytest.mark.parametrize('value', [0, -0.2, math.nan, math.inf, '0.2'])
def test_bad_odometry_values_are_refused(key, value):
    with pytest.raises(ConfigError, match=f'node: {key}: given .*; allowed: '):
        OdometryParams.from_mapping({key: value}, 'node')
