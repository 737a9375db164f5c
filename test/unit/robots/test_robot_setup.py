"""What is wrong in a robot file is said of that file."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.robot_file import load_robot_file
from diff_encoder_sim.robots.robot_setup import set_up_robot
from urdf_texts import joint, laser_sensor, link, usual


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


@pytest.mark.parametrize('own_link', ['laser', 'scan'])
def test_a_laser_of_the_robot_file_wins_over_those_of_the_urdf(tmp_path, own_link):
    own = link(own_link) + joint('own', own_link, '0.2 0 0.2') + laser_sensor(own_link)
    setup = set_up(tmp_path, usual(own), '{parent: base_link, xyz: [0, 0, 0.3]}')
    added = 'laser_2' if own_link == 'laser' else 'laser'
    assert setup.settings['simulator.laser_link'] == setup.description.laser.link == added
    assert setup.description.laser.pose_in_root[:3, 3] == pytest.approx([0.0, 0.0, 0.3])
    assert [note for note in setup.description.notes if repr(added) in note and repr(own_link) in note]


def test_a_mesh_of_a_package_that_is_missing_says_where_it_was_looked_for(tmp_path):
    urdf = usual().replace('<box size="0.3 0.2 0.1"/>', '<mesh filename="package://nowhere/a.stl"/>')
    with pytest.raises(ConfigError, match=f"package 'nowhere' is not found; looked for in {tmp_path}, .*PACKAGE_PATH"):
        set_up(tmp_path, urdf, '{parent: base_link, xyz: [0, 0, 0.3]}')
