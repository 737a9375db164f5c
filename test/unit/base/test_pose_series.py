"""Series of poses: order of stamps, and the length of the path."""

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import PoseSeries, steps_m


def test_each_stamp_once_ascending_with_its_first_pose():
    series = PoseSeries(np.array([30, 10, 30, 20]), np.arange(12.0).reshape(4, 3))
    stamps_ns, x_y_yaw = series.by_time()
    assert stamps_ns.tolist() == [10, 20, 30]
    assert x_y_yaw[:, 0].tolist() == [3.0, 9.0, 0.0]


def test_length_is_summed_in_the_order_of_the_stamps():
    x_y_yaw = np.array([(3.0, 4.0, 1.0), (0.0, 0.0, 2.0), (3.0, 0.0, 3.0)])
    assert PoseSeries(np.array([3, 1, 2]), x_y_yaw).path_length_m() == pytest.approx(7.0)
    assert PoseSeries(np.array([1]), x_y_yaw[:1]).path_length_m() == 0.0
    assert steps_m(x_y_yaw).tolist() == [5.0, 3.0]
