"""The filter while the robot is lost."""

import math

import numpy as np
import pytest

from amcl_world import ELSEWHERE, START, moved, pillar_room, simulated_scan
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams

ROOM = pillar_room()


ON = dict(
    lost_fraction=0.5,
    lost_scans=5,
    max_particles=1000,
    laser_max_beams=60,
    initial_pose_x=START.x_m,
    initial_pose_y=START.y_m,
    initial_pose_a=START.yaw_rad,
    initial_cov_xx=0.0025,
    initial_cov_yy=0.0025,
    initial_cov_aa=0.0025,
)


def amcl(**changes):
    return Amcl(AmclParams(**{**ON, **changes}), ROOM, np.random.default_rng(0))


def feed(filter_, true_pose, count, odom_pose=IDENTITY):
    """Scans from where the robot stands; whether it is lost after each."""
    scan = simulated_scan(ROOM, true_pose)
    lost_after_each = []
    for _ in range(count):
        filter_.update(odom_pose, scan, IDENTITY)
        lost_after_each.append(filter_.is_lost)
    return lost_after_each


def test_carried_off_and_back():
    """Lost at the fifth scan; the particles stay, so that it is found when it is back."""
    filter_ = amcl()
    assert not any(feed(filter_, START, 5)) and filter_.fit_fraction == 1.0
    particles = filter_.particles
    assert feed(filter_, ELSEWHERE, 20) == [False] * 4 + [True] * 16
    assert filter_.particles is particles
    assert feed(filter_, START, 6) == [True] * 4 + [False] * 2


@pytest.mark.parametrize('degrees', [0, 120, 240])
def test_begun_two_metres_off(degrees):
    """Whichever way, off the map or not: lost at the fifth scan, found by a better pose."""
    guess = Pose2D(
        START.x_m + 2.0 * math.cos(math.radians(degrees)),
        START.y_m + 2.0 * math.sin(math.radians(degrees)),
        START.yaw_rad,
    )
    filter_ = amcl(initial_pose_x=guess.x_m, initial_pose_y=guess.y_m)
    assert feed(filter_, START, 10) == [False] * 4 + [True] * 6
    filter_.set_pose(moved(START, 0.1, 0.05), 0.01 * np.eye(3))
    assert not feed(filter_, START, 10)[-1]
    assert np.subtract(filter_.odom_pose_in_map, START) == pytest.approx(0, abs=0.2)


def test_a_new_pose_is_settled_on_the_spot():
    """Lost, the robot stands still; scans from there pull the particles to where it is."""
    filter_ = amcl()
    feed(filter_, START, 1)
    feed(filter_, ELSEWHERE, 6)
    filter_.set_pose(
        Pose2D(ELSEWHERE.x_m + 0.3, ELSEWHERE.y_m - 0.2, ELSEWHERE.yaw_rad + 0.2), np.diag([0.16, 0.16, 0.07])
    )
    assert not feed(filter_, ELSEWHERE, 30)[-1]
    assert np.subtract(filter_.odom_pose_in_map, ELSEWHERE) == pytest.approx(0, abs=0.25)


def test_global_localization_is_not_settled_on_the_spot():
    """Standing still, the particles would agree on a place that only looks alike."""
    filter_ = amcl()
    feed(filter_, START, 3)
    filter_.global_localization()
    assert filter_.is_lost
    count = filter_.update_count
    assert all(feed(filter_, START, 20)) and filter_.update_count == count + 1


def test_a_bad_scan_is_a_fault_also_between_updates():
    filter_ = amcl()
    feed(filter_, START, 1)
    with pytest.raises(InputFault, match='none of 180 rays'):
        filter_.update(IDENTITY, simulated_scan(ROOM, START)._replace(ranges_m=np.full(180, np.inf)), IDENTITY)


def test_upstreams_default_is_never_lost():
    filter_ = amcl(lost_fraction=0.0)
    feed(filter_, START, 1)
    assert not any(feed(filter_, ELSEWHERE, 20)) and filter_.fit_fraction is None
    filter_.global_localization()
    assert not filter_.is_lost
