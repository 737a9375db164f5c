"""Inputs of the navigator: fresh, stale, ahead of time, unusable."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.navigation.navigator_inputs import MOST_AHEAD_S, STOP, NavigatorInputs, OdometrySample
from navigation_simulation import LASER_IN_BASE, ClosedLoop, navigator_params


def scan_of(*ranges_m):
    return Scan(0, 0.0, 0.1, 0.15, 6.0, np.array(ranges_m))


@pytest.mark.parametrize('ranges', [(math.nan, math.nan), (0.0, 0.14), (6.1, 7.0), (-math.inf,)])
def test_a_scan_without_a_valid_range_is_not_fresh(ranges):
    inputs = NavigatorInputs(IDENTITY)
    with pytest.raises(InputFault, match=f'none of {len(ranges)} ranges is valid: from 0.15 to 6 m'):
        inputs.take_scan(scan_of(*ranges))
    assert inputs.scan is None


@pytest.mark.parametrize('ranges', [(math.inf, math.inf), (math.nan, 0.15), (6.0, 0.0)])
def test_one_valid_range_will_do(ranges):
    inputs = NavigatorInputs(IDENTITY)
    inputs.take_scan(scan_of(*ranges))
    assert inputs.scan is not None


def test_each_scan_counts_from_its_own_laser():
    front, back = Pose2D(0.2, 0.0, 0.0), Pose2D(-0.2, 0.0, 3.0)
    inputs = NavigatorInputs(front)
    inputs.take_odometry(OdometrySample(0, IDENTITY, 0.0, 0.0))
    inputs.take_scan(scan_of(1.0))
    assert inputs.laser_pose_in_odom() == pytest.approx(front)
    inputs.take_scan(scan_of(1.0), back)
    assert inputs.laser_pose_in_odom() == pytest.approx(back)
    with pytest.raises(InputFault):
        inputs.take_scan(scan_of(math.nan), front)
    assert inputs.laser_pose_in_odom() == pytest.approx(back)


def test_what_is_dated_far_ahead_is_not_fresh():
    """A clock that is ahead must not make a dead sensor look alive."""
    inputs = NavigatorInputs(IDENTITY)
    inputs.take_odometry(OdometrySample(0, IDENTITY, 0.0, 0.0))
    inputs.take_scan(scan_of(1.0))
    inputs.take_localization(round((MOST_AHEAD_S + 0.5) * 1e9), IDENTITY)
    assert str(inputs.missing(0, 0.5)) == 'localization (map->odom) is dated 2.5 s ahead of the clock'


def test_nothing_moves_before_the_first_inputs(room):
    navigator = Navigator(navigator_params(), room[1], LASER_IN_BASE)
    navigator.set_goal(Pose2D(1.0, 0.0, 0.0))
    output = navigator.step(0)
    assert output.command == STOP and output.text == 'stopped: odometry has not been received yet'


def test_a_transform_dated_ahead_is_fresh(room):
    loop = ClosedLoop(*room, IDENTITY)
    loop.step()
    loop.navigator.take_localization(loop.robot.now_ns + 400_000_000, IDENTITY)
    assert loop.navigator.inputs.missing(loop.robot.now_ns, 0.5) is None


def test_a_scan_counts_from_where_it_was_taken(room):
    navigator = Navigator(navigator_params(), room[1], IDENTITY)
    navigator.take_odometry(0, IDENTITY, 0.0, 1.0)
    navigator.take_odometry(100_000_000, Pose2D(0.2, 0.0, 0.1), 0.0, 1.0)
    navigator.take_scan(Scan(50_000_000, 0.0, 1.0, 0.1, 6.0, np.array([1.0])))
    assert navigator.inputs.laser_pose_in_odom() == pytest.approx((0.1, 0.0, 0.05))


def test_bad_inputs_are_refused_and_change_nothing(room):
    navigator = Navigator(navigator_params(), room[1], LASER_IN_BASE)
    with pytest.raises(InputFault, match='odometry'):
        navigator.take_odometry(0, Pose2D(math.nan, 0.0, 0.0), 0.0, 0.0)
    with pytest.raises(InputFault, match='map->odom'):
        navigator.take_localization(0, Pose2D(0.0, math.inf, 0.0))
    with pytest.raises(InputFault, match=r'odometry is at \(1e\+300, 0\) m'):
        navigator.take_odometry(0, Pose2D(1e300, 0.0, 0.0), 0.0, 0.0)
    with pytest.raises(InputFault, match=r'map->odom is at \(0, -1e\+10\) m'):
        navigator.take_localization(0, Pose2D(0.0, -1e10, 0.0))
    with pytest.raises(InputFault, match='no rays'):
        navigator.take_scan(Scan(0, 0.0, 0.1, 0.1, 6.0, np.empty(0)))
    assert navigator.inputs.missing(0, 0.5) == ('odometry', 'has not been received yet')
