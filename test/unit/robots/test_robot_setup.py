"""What is wrong in a robot file is said of that file."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.added_laser import AddedLaser, with_laser
from diff_encoder_sim.robots.robot_file import load_robot_file
from diff_encoder_sim.robots.robot_setup import set_up_robot
from urdf_texts import joint, usual


def set_up(folder, urdf, laser):
    (folder / 'mine.urdf').write_text(urdf)
    (folder / 'mine.yaml').write_text(f'urdf: mine.urdf\nlaser: {laser}\n')
    return set_up_robot(load_robot_file('mine.yaml', folder, folder, {}))


def test_a_laser_is_added_and_named(tmp_path):
    setup = set_up(tmp_path, usual(), '{parent: base_link, xyz: [0, 0, 0.3]}')
    assert setup.settings['simulator.laser_link'] == 'laser'
    setup.check_laser()


def test_a_laser_on_a_link_that_is_missing(tmp_path):
    with pytest.raises(
        ConfigError, match="mine.yaml: laser: parent: given 'base_lin'; .*mine.urdf; did you mean 'base_link'"
    ):
        set_up(tmp_path, usual(), '{parent: base_lin, xyz: [0, 0, 0.3]}')


def test_a_laser_beside_a_link_of_its_name(tmp_path):
    urdf = with_laser(usual(), AddedLaser('base_link', (0.0, 0.0, 0.2)))
    with pytest.raises(ConfigError, match="mine.yaml: laser: mine.urdf has a link 'laser' already"):
        set_up(tmp_path, urdf, '{parent: base_link, xyz: [0, 0, 0.3]}')


def test_a_mesh_of_a_package_that_is_missing_says_where_it_was_looked_for(tmp_path):
    mesh = '<collision><geometry><mesh filename="package://nowhere/a.stl"/></geometry></collision>'
    urdf = usual(f'<link name="cover">{mesh}</link>', joint('cover_joint', 'cover', '0 0 0.1'))
    with pytest.raises(
        ConfigError, match=f"package 'nowhere' is not found; .*; looked for in {tmp_path}, .*ROS_PACKAGE_PATH"
    ):
        set_up(tmp_path, urdf, '{parent: base_link, xyz: [0, 0, 0.3]}')
