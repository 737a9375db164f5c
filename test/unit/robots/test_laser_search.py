"""Which scanner is simulated, and from where it looks."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import AddedLaser, RobotChoices, with_laser
from diff_encoder_sim.robots.laser_search import gazebo_lasers, whole_period_rate_hz
from diff_encoder_sim.robots.robot_file import load_robot_file
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from urdf_texts import described, found, joint, laser_sensor, link, tree_of, usual

EYE = link('eye') + joint('eye_joint', 'eye', '0 0 0.2')


def only_laser(**given):
    (laser,) = gazebo_lasers(tree_of(usual(EYE, laser_sensor('eye', **given))))
    return laser


@pytest.mark.parametrize(
    ('link_name', 'kind', 'count'),
    [
        ('eye', 'ray', 1),
        ('eye', 'gpu_ray', 1),
        ('eye', 'lidar', 1),
        ('eye', 'gpu_lidar', 1),
        ('eye', 'camera', 0),
        ('no', 'ray', 0),
    ],
)
def test_scanners_are_told_by_their_type_and_link(link_name, kind, count):
    assert len(gazebo_lasers(tree_of(usual(EYE, laser_sensor(link_name, kind=kind))))) == count


def test_the_last_ray_is_at_max_angle():
    settings = only_laser(samples=181, angles=(-math.pi / 2, math.pi / 2)).settings
    step_rad = settings['angle_span'] / settings['samples']
    assert settings['angle_min'] + 180 * step_rad == pytest.approx(math.pi / 2)


def test_a_scan_around_never_covers_more_than_a_turn():
    assert only_laser(angles=(0.0, 6.28319)).settings['angle_span'] == 2 * math.pi


def test_the_resolution_multiplies_the_rays():
    text = usual(EYE, laser_sensor('eye', samples=360)).replace('<resolution>1<', '<resolution>0.5<')
    assert gazebo_lasers(tree_of(text))[0].settings['samples'] == 180


@pytest.mark.parametrize(
    ('rate_hz', 'simulated_hz'),
    [(10, 10), (5, 5), (5.5, 100 / 18), (40, 50), (30, 100 / 3), (1000, 100), (0.001, 0.01)],
)
def test_a_rate_is_the_nearest_whose_period_is_whole_10_ms(rate_hz, simulated_hz):
    assert whole_period_rate_hz(rate_hz) == pytest.approx(simulated_hz)
    laser = only_laser(rate=rate_hz)
    assert laser.settings['rate'] == pytest.approx(simulated_hz)
    assert len(laser.notes) == (0 if simulated_hz == pytest.approx(rate_hz, rel=1e-3) else 1)


@pytest.mark.parametrize(
    ('given', 'missing'),
    [
        ({'rate': 0}, ['rate']),
        ({'rate': 'fast'}, ['rate']),
        ({'ranges': (0.1, 'inf')}, ['range_max']),
        ({'ranges': (2.0, 1.0)}, ['range_min', 'range_max']),
        ({'angles': (1.0, 1.0)}, ['angle_min', 'angle_span']),
        ({'angles': ('', 1.0)}, ['angle_min', 'angle_span']),
    ],
)
def test_what_makes_no_sense_is_left_to_the_defaults(given, missing):
    settings = only_laser(**given).settings
    assert {'angle_min', 'angle_span', 'range_min', 'range_max', 'rate'} - set(settings) == set(missing)


def mounted(name, at='0.1 0 0.2', rpy='0 0 0', parent='base_link'):
    return link(name) + joint(f'{name}_joint', name, at, parent=parent, rpy=rpy)


def laser_of(*parts, **choices):
    return described(usual(*parts), **choices).laser


def test_a_gazebo_sensor_tells_link_place_and_settings():
    description = described(usual(mounted('eye'), laser_sensor('eye')))
    laser = description.laser
    assert laser.link == 'eye'
    assert laser.pose_in_root[:3, 3] == pytest.approx([0.1, 0.0, 0.2])
    assert found(description, 'laser link')[1] == '<sensor type="ray"> of link \'eye\''
    assert laser.settings['samples'] == 360 and isinstance(laser.settings['samples'], int)
    assert (laser.settings['range_min'], laser.settings['range_max'], laser.settings['noise']) == (0.12, 3.5, 0.01)


def test_a_sensors_pose_in_its_link_counts():
    laser = laser_of(mounted('eye'), laser_sensor('eye', pose='0.02 0 0.03 0 0 1.5'))
    assert laser.pose_in_root[:3, 3] == pytest.approx([0.12, 0.0, 0.23])
    assert math.atan2(laser.pose_in_root[1, 0], laser.pose_in_root[0, 0]) == pytest.approx(1.5)


def test_the_frame_of_the_scans_is_taken_where_it_is_at_the_sensors_place():
    frame = mounted('scan_frame', '0 0 0.03', parent='eye')
    there = laser_of(mounted('eye'), frame, laser_sensor('eye', frame='scan_frame', pose='0 0 0.03 0 0 0'))
    elsewhere = laser_of(mounted('eye'), frame, laser_sensor('eye', frame='scan_frame'))
    assert (there.link, elsewhere.link) == ('scan_frame', 'eye')


def test_without_a_sensor_names_tell_and_the_end_of_a_chain_is_the_frame():
    parts = mounted('laser_mount'), mounted('laser', parent='laser_mount'), mounted('laser_frame', parent='laser')
    assert laser_of(*parts).link == 'laser_frame'
    assert found(described(usual(*parts)), 'laser link')[1] == "its link's name"
    assert laser_of(mounted('base_scan')).link == 'base_scan'
    assert laser_of(mounted('scan_button_plate')) is None


def test_the_user_goes_before_the_sensor_and_gets_its_settings_where_they_are_its_own():
    parts = mounted('eye'), mounted('other'), laser_sensor('eye')
    assert laser_of(*parts, laser_link='other').settings == {}
    assert laser_of(*parts, laser_link='eye').settings['samples'] == 360


def test_a_link_that_is_missing_or_leans_is_refused():
    with pytest.raises(ConfigError, match="given 'ey' as laser link, which is missing; .*did you mean 'eye'"):
        laser_of(mounted('eye'), laser_link='ey')
    with pytest.raises(ConfigError, match='which leans by 29 degrees; allowed: a scanner upright within 5 degrees'):
        laser_of(mounted('eye', rpy='0 0.5 0'), laser_link='eye')


def test_a_range_finder_or_a_leaning_or_spatial_scanner_is_not_taken():
    down = mounted('cliff', rpy='0 1.57 0'), laser_sensor('cliff')
    few = mounted('sonar'), laser_sensor('sonar', samples=3)
    spatial = (
        mounted('cloud'),
        laser_sensor('cloud').replace('</horizontal>', '</horizontal><vertical><samples>16</samples></vertical>'),
    )
    description = described(usual(*down, *few, *spatial))
    assert description.laser is None
    assert "scanners that are not level are left out: 'cliff'" in description.notes
    assert description.warnings[-1].startswith('no laser is found: simulator.laser_link names its link')


def test_of_two_scanners_the_first_is_simulated_and_the_other_noted():
    description = described(usual(mounted('front'), mounted('rear'), laser_sensor('front'), laser_sensor('rear')))
    assert description.laser.link == 'front'
    assert "one laser is simulated, 'front', and not 'rear'" in description.notes


def test_a_scanner_upside_down_is_turned_up_and_its_rays_go_the_other_way():
    """It sees the same: a ray at +a about an axis that points down is one at -a about one that points up."""
    angles = (-0.5, 1.0)
    parts = mounted('eye', rpy=f'{math.pi} 0 0.7'), laser_sensor('eye', samples=151, angles=angles)
    description = described(usual(*parts))
    laser = description.laser
    assert "laser 'eye' is upside down: simulated upright" in description.warnings
    assert laser.pose_in_root[:3, :3] @ [0, 0, 1] == pytest.approx([0, 0, 1])
    yaw_rad = math.atan2(laser.pose_in_root[1, 0], laser.pose_in_root[0, 0])
    assert yaw_rad == pytest.approx(0.7)
    step_rad = laser.settings['angle_span'] / laser.settings['samples']
    bearings_rad = laser.settings['angle_min'] + step_rad * np.arange(laser.settings['samples'])
    assert (bearings_rad[0], bearings_rad[-1]) == pytest.approx((-angles[1], -angles[0]))


def test_a_link_with_a_level_and_a_leaning_sensor_has_the_level_one():
    leaning = laser_sensor('eye', pose='0 0 0 0 1 0')
    description = described(usual(mounted('eye'), laser_sensor('eye'), leaning))
    assert description.laser.link == 'eye'
    assert "scanners that are not level are left out: 'eye'" in description.notes


def test_it_is_a_link_on_the_parent():
    tree = parse_urdf(with_laser(usual(), AddedLaser('base_link', (0.1, 0.0, 0.3))), 'here')
    assert tree.joint_above('laser').parent == 'base_link'
    assert tree.link_poses()['laser'][:3, 3] == pytest.approx([0.1, 0.0, 0.3])
    assert set(tree.links) == {*parse_urdf(usual(), 'here').links, 'laser'}


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
        ('{parent: base_link, xyz: [0, 0]}', r'laser.xyz: given \[0, 0\]; allowed: '),
        ('{parent: base_link, xyz: [0, 0, .nan]}', 'laser.xyz.2: given nan'),
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
