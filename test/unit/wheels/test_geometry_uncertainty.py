"""What errors of the assumed geometry do to the pose, against drives with these errors."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, move_along_arc
from diff_encoder_sim.wheels.covariance import NO_ERRORS, GeometryStd, carry_geometry_errors, geometry_covariance

SEPARATION_M = 0.4
SMALL = 1e-6
ALL = GeometryStd(1.0, 1.0, 1.0)


def driven(steps_m, left=1.0, right=1.0, separation=1.0):
    """The pose after steps of both wheels, whose travels and separation are other than they seem."""
    pose = IDENTITY
    for left_m, right_m in steps_m:
        left_true_m, right_true_m = left * left_m, right * right_m
        turn_rad = (right_true_m - left_true_m) / (SEPARATION_M * separation)
        moved = move_along_arc(pose, 0.5 * (left_true_m + right_true_m), turn_rad)
        pose = moved._replace(yaw_rad=pose.yaw_rad + turn_rad)
    return np.array(pose)


def carried(steps_m):
    errors, yaw_rad = NO_ERRORS, 0.0
    for left_m, right_m in steps_m:
        errors = carry_geometry_errors(errors, ALL, yaw_rad, left_m, right_m, SEPARATION_M)
        yaw_rad += (right_m - left_m) / SEPARATION_M
    return errors


def test_errors_are_those_of_drives_with_another_geometry():
    steps_m = np.random.default_rng(3).uniform(-0.002, 0.01, (400, 2))
    distance, turn, difference = np.array(carried(steps_m))
    exact = driven(steps_m)
    half = 0.5 * SMALL
    by_difference = (driven(steps_m, 1.0 - half, 1.0 + half) - exact) / SMALL
    by_both = (driven(steps_m, 1.0 + SMALL, 1.0 + SMALL) - exact) / SMALL
    by_separation = (driven(steps_m, separation=1.0 + SMALL) - exact) / SMALL
    assert difference == pytest.approx(by_difference, rel=1e-3, abs=1e-4)
    assert distance + turn == pytest.approx(by_both, rel=1e-3, abs=1e-4)
    assert -turn == pytest.approx(by_separation, rel=1e-3, abs=1e-4)


def test_a_difference_of_diameters_bends_a_straight_line_as_by_the_closed_form():
    length_m, difference = 20.0, 5.2e-5
    errors = carried([(0.02, 0.02)] * 1000)
    covariance = geometry_covariance(errors, GeometryStd(diameter_difference=difference))
    assert math.sqrt(covariance.yaw_yaw) == pytest.approx(length_m * difference / SEPARATION_M)
    assert math.sqrt(covariance.yy) == pytest.approx(length_m**2 * difference / (2 * SEPARATION_M), rel=1e-3)
    assert covariance.xx == pytest.approx(0.0, abs=1e-15)
