"""Which URDFs are simulated as they are."""

import pytest

from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.physics_urdf import sound_wheels
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expand
from generated_robots import LEFT, RECIPES, RIGHT, urdf_of
from places import ROOT

ALTO = expand(RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro'))
JOINTS = 'left_wheel_joint', 'right_wheel_joint'
BARE_FRAME = """<link name="frame"/>
  <joint name="frame" type="fixed"><parent link="hull"/><child link="frame"/></joint>"""


def test_alto_is_sound():
    assert sound_wheels(parse_urdf(ALTO, 'alto'), *JOINTS) == pytest.approx((0.1, 0.1, 0.4))


@pytest.mark.parametrize(
    ('old', 'new'),
    [
        ('<sphere radius="0.1"/>', '<cylinder radius="0.1" length="0.02"/>'),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 -1 0"/>'),
        ('<lateral_friction value="0"/>', '<lateral_friction value="0.5"/>'),
        ('<rolling_friction value="0"/>', '<rolling_friction value="0.01"/>'),
        ('xyz="-0.19 0 0.043"', 'xyz="-0.19 0 0.04"'),  # both casters touch
        ('xyz="0.19 0 0.04"', 'xyz="0.19 0 0.043"'),  # none does
        ('xyz="0.19 0 0.04"', 'xyz="0.19 0 0.039"'),  # it lifts the wheels
        ('</robot>', f'{BARE_FRAME}</robot>'),
        ('<mass value="0.5"/>', '<mass value="0"/>'),
        ('joint name="laser_joint" type="fixed"', 'joint name="laser_joint" type="continuous"'),
        ('<box size="0.5 0.6 0.99"/>', '<mesh filename="body.stl"/>'),
    ],
)  # fmt: skip
def test_what_is_not_right_in_it_makes_a_urdf_unsound(old, new):
    urdf = ALTO.replace('0.043000000000000003', '0.043')
    assert old in urdf
    assert sound_wheels(parse_urdf(urdf.replace(old, new), 'alto'), *JOINTS) is None


@pytest.mark.parametrize('name', list(RECIPES))
def test_robots_as_people_write_them_are_not_sound(name, tmp_path):
    assert sound_wheels(parse_urdf(urdf_of(RECIPES[name], tmp_path), 'robot'), LEFT, RIGHT) is None
