"""Planar covariances among the 36 numbers of a message."""

import numpy as np
import pytest

from diff_encoder_sim.drives.wire import encode_amcl_covariance, encode_odometry_covariance, encode_twist_covariance
from diff_encoder_sim.wheels.covariance import PlanarCovariance
from diff_encoder_sim.wheels.odometry import TwistCovariance

PLANAR = PlanarCovariance(*range(1, 7))
TWIST = TwistCovariance(1.0, 2.0, 3.0)


def matrix(raw):
    return np.frombuffer(raw, '<f8').reshape(6, 6)


def test_x_y_and_yaw_are_the_first_the_second_and_the_last_axis():
    for raw in (encode_amcl_covariance(PLANAR.matrix()), encode_odometry_covariance(PLANAR)):
        assert np.array_equal(matrix(raw)[np.ix_([0, 1, 5], [0, 1, 5])], PLANAR.matrix())
    assert np.array_equal(matrix(encode_twist_covariance(TWIST))[np.ix_([0, 5], [0, 5])], TWIST.matrix())


def test_what_wheels_do_not_measure_is_unknown_and_of_amcl_zero():
    assert np.diag(matrix(encode_odometry_covariance(PLANAR))).tolist() == [1.0, 4.0, 1e12, 1e12, 1e12, 6.0]
    assert np.diag(matrix(encode_twist_covariance(TWIST))).tolist() == [1.0, 1e12, 1e12, 1e12, 1e12, 3.0]
    assert np.diag(matrix(encode_amcl_covariance(PLANAR.matrix()))).tolist() == [1.0, 4.0, 0.0, 0.0, 0.0, 6.0]


@pytest.mark.parametrize(
    ('raw', 'axes'),
    [
        (encode_amcl_covariance(PLANAR.matrix()), [0, 1, 5]),
        (encode_odometry_covariance(PLANAR), [0, 1, 5]),
        (encode_twist_covariance(TWIST), [0, 5]),
    ],
)
def test_nothing_else_is_correlated(raw, axes):
    elsewhere = matrix(raw).copy()
    elsewhere[np.ix_(axes, axes)] = 0.0
    assert not (elsewhere - np.diag(np.diag(elsewhere))).any()
