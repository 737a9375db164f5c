"""Serialized parts of messages: primitives, covariances, and fields that are read one after the other."""

import numpy as np
import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.wire import (
    FieldReader,
    encode_amcl_covariance,
    encode_odometry_covariance,
    encode_twist_covariance,
)
from diff_encoder_sim.wheels.covariance import PlanarCovariance
from diff_encoder_sim.wheels.odometry import TwistCovariance

PLANAR = PlanarCovariance(*range(1, 7))
TWIST = TwistCovariance(1.0, 2.0, 3.0)


def matrix(raw):
    return np.frombuffer(raw, '<f8').reshape(6, 6)


def test_what_wheels_do_not_measure_is_unknown_and_of_amcl_zero():
    assert np.diag(matrix(encode_odometry_covariance(PLANAR))).tolist() == [1.0, 4.0, 1e12, 1e12, 1e12, 6.0]
    assert np.diag(matrix(encode_twist_covariance(TWIST))).tolist() == [1.0, 1e12, 1e12, 1e12, 1e12, 3.0]
    assert np.diag(matrix(encode_amcl_covariance(PLANAR.matrix()))).tolist() == [1.0, 4.0, 0.0, 0.0, 0.0, 6.0]


def test_bytes_that_are_not_utf_8_are_replaced_unless_refused():
    raw = b'\x02\0\0\0a\xff'
    assert FieldReader(raw, is_cdr=False).text() == 'a\ufffd'
    with pytest.raises(UnicodeDecodeError):
        FieldReader(raw, is_cdr=False).text('strict')


@pytest.mark.parametrize('raw', [b'', b'\0', b'\0\0\0\0', b'\1\0\0\0'])
def test_a_foreign_byte_order_is_a_fault(raw):
    with pytest.raises(InputFault, match='not little-endian CDR'):
        FieldReader(raw, is_cdr=True)
