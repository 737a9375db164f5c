"""Which way up a laser is mounted, how far it is tilted, and its scans as seen from above."""

import math

import numpy as np
import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

from geometry_msgs.msg import Quaternion, TransformStamped

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.ros.transforms import scanner_mount

SCAN = Scan(0, -0.5, 0.25, 0.1, 6.0, np.array([1.0, 2.0, 3.0]))


def mount(x=0.0, y=0.0, z=0.0, w=0.0):
    transform = TransformStamped()
    transform.transform.translation.x = 0.2
    transform.transform.rotation = Quaternion(x, y, z, w)
    return scanner_mount(transform)


def test_an_upright_laser_is_level():
    upright = mount(z=math.sin(0.3), w=math.cos(0.3))
    assert upright.laser_pose_in_base == pytest.approx((0.2, 0.0, 0.6))
    assert (upright.is_upside_down, upright.lean_rad) == (False, pytest.approx(0.0, abs=1e-7))
    assert upright.level(SCAN) is SCAN


def test_a_laser_upside_down_scans_the_other_way_round():
    hanging = mount(x=1.0)
    assert hanging.is_upside_down and hanging.lean_rad == pytest.approx(0.0, abs=1e-7)
    level = hanging.level(SCAN)
    assert level.bearings_rad() == pytest.approx(-SCAN.bearings_rad())
    assert (level.ranges_m == SCAN.ranges_m).all()


@pytest.mark.parametrize('lean_rad', [0.1, 1.0])
def test_a_tilt_is_measured_from_level_either_way_up(lean_rad):
    assert mount(y=math.sin(lean_rad / 2), w=math.cos(lean_rad / 2)).lean_rad == pytest.approx(lean_rad)
    assert mount(x=math.cos(lean_rad / 2), z=math.sin(lean_rad / 2)).lean_rad == pytest.approx(lean_rad)


def test_a_transform_without_a_rotation_is_refused():
    with pytest.raises(InputFault, match='no rotation'):
        mount()
