"""Latencies of trials in lockstep, as their file gives them."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.robot_params import LatencyParams, latency_ns


@pytest.mark.parametrize('value', [0.005, -0.01, 11.0, float('nan')])
def test_a_latency_is_whole_ticks(value):
    with pytest.raises(ConfigError, match='command'):
        LatencyParams.from_mapping({'command': value}, 'lockstep.yaml')


def test_a_latency_comes_in_whole_nanoseconds():
    assert latency_ns(LatencyParams.from_mapping({'command': 0.07}, '').command) == 70_000_000
