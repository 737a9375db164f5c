"""Parameters of the DWA with which a standing robot can start, or not."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.navigation.dwa_params import DwaParams

SLOW_START = {'acc_lim_x': 0.7, 'acc_lim_theta': 4.0, 'min_vel_trans': 0.1, 'min_vel_theta': 0.4}


@pytest.mark.parametrize(
    ('changes', 'can_start'),
    [
        ({}, False),  # 0.035 m/s and 0.2 rad/s after 50 ms
        ({'min_vel_trans': 0.03}, True),
        ({'min_vel_theta': 0.2}, True),
        ({'acc_lim_x': 2.5}, True),
        ({'acc_lim_x': 2.5, 'max_vel_x': 0.05}, False),
        ({'acc_lim_x': 2.5, 'max_vel_x': 0.05, 'min_vel_x': -0.2}, True),  # backwards
        ({'use_dwa': False}, True),  # sim_time is long enough
    ],
)
def test_a_standing_robot_starts_if_one_period_reaches_a_minimum(changes, can_start):
    assert DwaParams.from_mapping({**SLOW_START, **changes}, '').can_start(0.05) is can_start


@pytest.mark.parametrize(
    ('given', 'complaint'),
    [
        ({'min_vel_x': 0.6}, 'min_vel_x not above max_vel_x'),
        ({'min_vel_theta': 1.1}, 'min_vel_theta not above max_vel_theta'),
    ],
)
def test_a_minimum_above_its_maximum_is_refused(given, complaint):
    with pytest.raises(ConfigError, match=complaint):
        DwaParams.from_mapping(given, '')
