"""Poses, angles, series of poses and bearings against geometry that can be done by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from diff_encoder_sim.base.se2 import (
    IDENTITY,
    Pose2D,
    move_along_arc,
    quat_xyzw_from_yaw,
    transform_points,
    wrap_angle,
    yaw_from_quat_xyzw,
)

lengths = st.floats(-100, 100)
poses = st.builds(Pose2D, lengths, lengths, st.floats(-10, 10))


def matrix(pose):
    cos_yaw, sin_yaw = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return np.array([[cos_yaw, -sin_yaw, pose.x_m], [sin_yaw, cos_yaw, pose.y_m], [0, 0, 1]])


@given(poses, poses)
def test_poses_compose_as_matrices_do(parent, child):
    assert matrix(parent.compose(child)) == pytest.approx(matrix(parent) @ matrix(child), abs=1e-9)
    assert matrix(parent.compose(parent.inverse())) == pytest.approx(np.eye(3), abs=1e-9)
    assert matrix(parent.compose(child.relative_to(parent))) == pytest.approx(matrix(child), abs=1e-9)
    point_m = transform_points(parent, np.array([child[:2]]))
    assert point_m[0] == pytest.approx(parent.compose(child)[:2], abs=1e-9)


@given(st.floats(-1e6, 1e6))
def test_wrapped_angles_are_in_range_and_point_the_same_way(angle):
    wrapped = wrap_angle(angle)
    assert -math.pi <= wrapped < math.pi
    assert (math.cos(wrapped), math.sin(wrapped)) == pytest.approx((math.cos(angle), math.sin(angle)), abs=1e-8)


@given(st.floats(-5, 5), st.floats(-6, 6), st.integers(1, 30))
def test_an_arc_in_pieces_ends_where_the_whole_arc_does(distance, turn, pieces):
    pose = IDENTITY
    for _ in range(pieces):
        pose = move_along_arc(pose, distance / pieces, turn / pieces)
    assert pose == pytest.approx(move_along_arc(IDENTITY, distance, turn), abs=1e-9)


@given(st.floats(-2e-4, 2e-4))
def test_the_series_for_small_turns_meets_the_sine(turn):
    exact_x = 1.0 if turn == 0 else math.sin(turn) / turn
    assert move_along_arc(IDENTITY, 1.0, turn).x_m == pytest.approx(exact_x, abs=1e-15)


def test_arcs_by_hand():
    assert move_along_arc(IDENTITY, math.pi / 2, math.pi / 2) == pytest.approx((1, 1, math.pi / 2))  # radius 1 m
    assert move_along_arc(Pose2D(1, 2, math.pi / 2), 3, 0) == pytest.approx((1, 5, math.pi / 2))


@given(st.floats(-math.pi, math.pi), st.floats(0.1, 10))
def test_yaw_survives_the_quaternion_whatever_its_length(yaw, length):
    quat = [length * part for part in quat_xyzw_from_yaw(yaw)]
    assert wrap_angle(yaw_from_quat_xyzw(*quat) - yaw) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize('quat', [(0, 0, 0, 0), (math.nan, 0, 0, 1), (0, 0, math.inf, 1)])
def test_what_is_no_rotation_is_refused(quat):
    with pytest.raises(ValueError, match='no rotation'):
        yaw_from_quat_xyzw(*quat)
