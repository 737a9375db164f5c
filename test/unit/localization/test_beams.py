"""Which rays of a scan count, and which scans are refused."""

import math

import numpy as np
import pytest

from amcl_world import pillar_room
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.beams import beam_step, beam_step_rounded_up, select_beams
from diff_encoder_sim.localization.laser_models import laser_model
from laser_model_cases import LASER_POSE, RANGE_LIMIT_M, params


def test_step_between_beams_is_upstreams():
    assert beam_step(1000, 180) == 5  # so 200 beams, not 180
    assert beam_step_rounded_up(1000, 180) == 6
    assert beam_step(20, 30) == beam_step_rounded_up(20, 30) == 1


@pytest.mark.parametrize('hits_only', [True, False])
@pytest.mark.parametrize('dtype', [np.float32, np.float64])
def test_the_rays_that_count_are_those_within_limits(hits_only, dtype):
    rng = np.random.default_rng(2)
    ranges_m = rng.uniform(-0.5, 7.0, 500).astype(dtype)
    ranges_m[rng.integers(0, 500, 60)] = rng.choice([np.nan, np.inf, -np.inf, 0.15, 3.5], 60)
    ranges_m.setflags(write=False)  # as of a message
    beams = select_beams(Scan(0, -2.0, 0.01, 0.15, 6.0, ranges_m), 3, LASER_POSE, params(), hits_only)
    expected = [
        (range_m if 0.15 < range_m <= 3.5 else 3.5, 0.3 + (-2.0 + 0.03 * ray))
        for ray, range_m in enumerate(ranges_m[::3].astype(float).tolist())
        if not math.isnan(range_m) and (0.15 < range_m < 3.5 or not hits_only)
    ]
    assert np.column_stack(beams[:2]) == pytest.approx(np.array(expected), rel=1e-14)
    assert beams[2:] == (LASER_POSE.x_m, LASER_POSE.y_m, 3.5)


@pytest.mark.parametrize(
    ('ranges', 'message'),
    [
        (np.array([]), '0 ranges; expected at least one'),
        (np.full(36, np.inf), 'none of 36 rays'),
        (np.full(36, np.nan), 'none of 36 rays'),
        (np.full(36, -np.inf), 'none of 36 rays'),
    ],
)
def test_a_scan_that_says_nothing_is_refused(ranges, message):
    laser = laser_model(params(), pillar_room())
    with pytest.raises(InputFault, match=message):
        laser.beams(Scan(0, 0.0, 0.1, 0.15, 6.0, ranges), Pose2D(0, 0, 0))


def test_no_return_counts_in_the_beam_model_and_nan_does_not():
    laser = laser_model(params(laser_model_type='beam'), pillar_room())
    scan = Scan(0, 0.0, 0.1, 0.15, 6.0, np.full(36, np.inf))
    assert (laser.beams(scan, Pose2D(0, 0, 0)).ranges_m == RANGE_LIMIT_M).all()
    with pytest.raises(InputFault, match='none of 36 rays'):
        laser.beams(scan._replace(ranges_m=np.full(36, np.nan)), Pose2D(0, 0, 0))


@pytest.mark.parametrize(
    ('changes', 'message'),
    [
        (dict(angle_min_rad=np.nan), 'angle_min nan'),
        (dict(angle_increment_rad=np.inf), 'angle_increment inf'),
        (dict(range_max_m=np.nan), 'range_max nan'),
        (dict(angle_increment_rad=1e307), 'angle_increment 1e.307'),
        (dict(range_max_m=-1.0), 'range_max -1'),
        (dict(range_min_m=np.nan), 'range_min nan'),
        (dict(range_min_m=-0.1), 'range_min -0.1'),
        (dict(ranges_m=np.ones((2, 2))), 'expected at least one'),
    ],
)
def test_a_scan_without_geometry_is_refused(changes, message):
    scan = Scan(0, 0.0, 0.1, 0.15, 6.0, np.ones(36))._replace(**changes)
    with pytest.raises(InputFault, match=message):
        laser_model(params(), pillar_room()).beams(scan, Pose2D(0, 0, 0))
