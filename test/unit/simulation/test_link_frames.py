"""The robot's links as frames: origins, turning joints, and the sign that KDL gives a quaternion."""

import math

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.simulation.link_frames import LinkFrames

URDF = """<robot name="r"><link name="base"/><link name="wheel"/><link name="scanner"/><link name="arm"/>
<joint name="z_wheel" type="continuous"><parent link="base"/><child link="wheel"/>
  <origin xyz="0.1 0.2 0.3"/><axis xyz="0 2 0"/></joint>
<joint name="a_arm" type="revolute"><parent link="base"/><child link="arm"/>
  <origin rpy="0 0 1.5707963267948966"/></joint>
<joint name="mount" type="fixed"><parent link="arm"/><child link="scanner"/>
  <origin xyz="1 0 0" rpy="0.1 0.2 0.3"/></joint>
</robot>"""


def test_fixed_frames_have_their_origin():
    (mount,) = LinkFrames(URDF).fixed
    assert (mount.parent, mount.child, mount.translation_xyz_m) == ('arm', 'scanner', (1.0, 0.0, 0.0))
    # Rz(0.3) Ry(0.2) Rx(0.1), from its halved angles.
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(0.5 * angle), math.cos(0.5 * angle)) for angle in (0.1, 0.2, 0.3))
    x, y, z = sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy
    assert mount.quat_xyzw == pytest.approx((x, y, z, cr * cp * cy + sr * sp * sy))
    with pytest.raises(ConfigError, match="joint 'mount' origin xyz"):
        LinkFrames(URDF.replace('xyz="1 0 0"', 'xyz="1 0"'))


def test_joints_of_known_angle_turn_about_their_axis_after_their_origin_in_the_order_of_their_names():
    arm, wheel = LinkFrames(URDF).turned({'z_wheel': 0.5, 'a_arm': math.pi / 2})
    assert wheel.translation_xyz_m == (0.1, 0.2, 0.3)
    assert wheel.quat_xyzw == pytest.approx((0.0, math.sin(0.25), 0.0, math.cos(0.25)))
    # A quarter turn about z, then one about the arm's own x, URDF's default axis.
    assert arm.quat_xyzw == pytest.approx((0.5, 0.5, 0.5, 0.5))
    assert [frame.child for frame in LinkFrames(URDF).turned({'z_wheel': 0.0, 'other': 1.0})] == ['wheel']


@pytest.mark.parametrize(
    ('angle_rad', 'y', 'w'),
    [
        (2.0, math.sin(1.0), math.cos(1.0)),
        # From two thirds of a half turn on, KDL takes the largest of x, y, z to be positive.
        (3.5, math.sin(1.75), math.cos(1.75)),
        (-3.0, math.sin(1.5), -math.cos(1.5)),
        (4 * math.pi + 0.1, math.sin(0.05), math.cos(0.05)),
    ],
)
def test_of_the_two_quaternions_it_is_kdls(angle_rad, y, w):
    (wheel,) = LinkFrames(URDF).turned({'z_wheel': angle_rad})
    assert wheel.quat_xyzw == pytest.approx((0.0, y, 0.0, w), abs=1e-12)
