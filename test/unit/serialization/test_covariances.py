"""Planar covariances among the 36 numbers of a message."""

import numpy as np

from diff_encoder_sim.serialization.covariances import (
    encode_amcl_covariance,
    encode_odometry_covariance,
    encode_twist_covariance,
)

PLANAR = np.arange(9.0).reshape(3, 3)


def matrix(raw):
    return np.frombuffer(raw, '<f8').reshape(6, 6)


def test_x_y_and_yaw_are_the_first_the_second_and_the_last_axis():
    for encode in (encode_amcl_covariance, encode_odometry_covariance):
        assert np.array_equal(matrix(encode(PLANAR))[np.ix_([0, 1, 5], [0, 1, 5])], PLANAR)
    assert np.array_equal(matrix(encode_twist_covariance(PLANAR[:2, :2]))[np.ix_([0, 5], [0, 5])], PLANAR[:2, :2])


def test_what_wheels_do_not_measure_is_unknown_and_of_amcl_zero():
    assert np.diag(matrix(encode_odometry_covariance(PLANAR))).tolist() == [0.0, 4.0, 1e12, 1e12, 1e12, 8.0]
    assert np.diag(matrix(encode_twist_covariance(PLANAR[:2, :2]))).tolist() == [0.0, 1e12, 1e12, 1e12, 1e12, 4.0]
    assert np.diag(matrix(encode_amcl_covariance(PLANAR))).tolist() == [0.0, 4.0, 0.0, 0.0, 0.0, 8.0]
