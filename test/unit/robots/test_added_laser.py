"""A scanner added to a URDF that has none."""

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import AddedLaser, RobotChoices, with_laser
from diff_encoder_sim.robots.robot_file import load_robot_file
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from urdf_texts import usual


def test_it_is_a_link_on_the_parent():
    tree = parse_urdf(with_laser(usual(), AddedLaser('base_link', (0.1, 0.0, 0.3))), 'here')
    assert tree.joint_above('laser').parent == 'base_link'
    assert tree.link_poses()['laser'][:3, 3] == pytest.approx([0.1, 0.0, 0.3])
    assert set(tree.links) == {*parse_urdf(usual(), 'here').links, 'laser'}


def test_a_namespace_and_what_follows_the_robot_stay():
    text = with_laser('<r:robot xmlns:r="x"></r:robot>\n<!-- end -->', AddedLaser('a&b', (0.0, 0.0, 0.0)))
    assert text.endswith('</joint></r:robot>\n<!-- end -->')
    assert '"a&amp;b"' in text


def test_a_robot_file_gives_it(tmp_path):
    (tmp_path / 'mine.urdf').write_text(usual())
    (tmp_path / 'mine.yaml').write_text('urdf: mine.urdf\nlaser: {parent: base_link, xyz: [0, 0, 0.25]}\n')
    source = load_robot_file('mine.yaml', tmp_path, tmp_path, {}).source
    laser = describe(source, RobotChoices()).laser
    assert laser.link == 'laser'
    assert laser.pose_in_root == pytest.approx(np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0.25], [0, 0, 0, 1]]))


@pytest.mark.parametrize(
    ('laser', 'complaint'),
    [
        ('{parent: nowhere, xyz: [0, 0, 0.25]}', 'nowhere'),
        ('{parent: base_link, xyz: [0, 0]}', r'laser.xyz: given \[0, 0\]; allowed: '),
        ('{parent: base_link, xyz: [0, 0, .nan]}', 'laser.xyz.2: given nan'),
        ('{parent: base_link, xyz: [0, 0, 1.0e+300]}', 'laser.xyz.2: given 1e.300; allowed: '),
        ('top', "laser: given 'top'; allowed: "),
    ],
)
def test_what_cannot_be_is_named_in_one_line(tmp_path, laser, complaint):
    (tmp_path / 'mine.urdf').write_text(usual())
    (tmp_path / 'mine.yaml').write_text(f'urdf: mine.urdf\nlaser: {laser}\n')
    with pytest.raises(ConfigError, match=complaint) as fault:
        describe(load_robot_file('mine.yaml', tmp_path, tmp_path, {}).source, RobotChoices())
    assert '\n' not in str(fault.value)


def test_its_link_has_a_name_that_the_urdf_has_not():
    urdf = usual()
    for number in range(1, 4):
        urdf = with_laser(urdf, AddedLaser('base_link', (0.0, 0.0, 0.1 * number)))
    assert list(parse_urdf(urdf, 'here').links)[-3:] == ['laser', 'laser_2', 'laser_3']
