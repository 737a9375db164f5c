"""The spread that is named before trials run."""

import math

import pytest

from diff_encoder_sim.navigation.goal_stopping import PoseStep, stop_parts, stop_spread
from navigation_scenes import dwa_params

FINE = PoseStep(0.0, 0.0)


@pytest.mark.parametrize(
    ('changes', 'expected_m'),
    [({}, 0.05), ({'latch_margin': 0.2}, 0.04), ({'latch_margin': 0.2, 'latch_xy_goal_tolerance': False}, 0.05)],
)
def test_latch_ends_on_the_edge_of_what_it_latches(changes, expected_m):
    """Without a latch the margin has no effect."""
    assert stop_spread(dwa_params(**changes), 0.05, 0.02, PoseStep(0.02, 0.04)) == pytest.approx((expected_m, 0.052))


def test_precise_is_what_the_control_loop_leaves():
    """At 20 Hz: 39 mm/s at the end, 1.1 mm of braking, 1 mm of half a period, 0.8 mm of latency, 5 mm aside."""
    spread = stop_spread(dwa_params(stop='precise'), 0.05, 0.02, FINE)
    speed = 0.7 * (math.sqrt(0.1**2 + 2 * 0.005 / 0.7) - 0.1)
    along_m = speed**2 / 1.4 + 0.5 * speed * 0.05 + speed * 0.02
    assert spread.position_m == pytest.approx(math.hypot(along_m, 0.005)) and 0.005 < spread.position_m < 0.006
    assert spread.yaw_rad == pytest.approx(0.052 / 3.0)


def test_a_coarse_encoder_adds_its_pulse_up_to_the_tolerance():
    fine = stop_spread(dwa_params(stop='precise'), 0.05, 0.02, FINE)
    coarse = stop_spread(dwa_params(stop='precise'), 0.05, 0.02, PoseStep(0.0157, 0.03))
    assert fine.position_m + 0.01 < coarse.position_m < 0.02
    assert fine.yaw_rad < coarse.yaw_rad < 0.052
    assert stop_spread(dwa_params(stop='precise'), 0.05, 0.02, PoseStep(1.0, 1.0)) == pytest.approx((0.05, 0.052))


@pytest.mark.parametrize('stop', ['latch', 'precise'])
def test_the_parts_make_the_spread(stop):
    params, step = dwa_params(stop=stop), PoseStep(0.002, 0.005)
    parts, spread = stop_parts(params, 0.05, 0.03, step), stop_spread(params, 0.05, 0.03, step)
    if stop == 'latch':
        assert parts == {'latch circle': spread}
    else:
        ahead_m = sum(parts[cause].position_m for cause in ('coasting', 'latency', 'one pulse'))
        assert spread.position_m == pytest.approx(math.hypot(ahead_m, parts['near enough'].position_m))
        assert parts['one pulse'] == step
        assert stop_parts(params, 0.05, 0.06, step)['latency'].position_m == 2.0 * parts['latency'].position_m
