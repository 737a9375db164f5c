"""Which scanner is simulated, and from where it looks."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.laser_search import gazebo_lasers
from urdf_texts import described, found, joint, laser_sensor, link, tree_of, usual


def mounted(name, at='0.1 0 0.2', rpy='0 0 0', parent='base_link'):
    return link(name) + joint(f'{name}_joint', name, at, parent=parent, rpy=rpy)


def only_laser(**given):
    (laser,) = gazebo_lasers(tree_of(usual(mounted('eye'), laser_sensor('eye', **given))))
    return laser


@pytest.mark.parametrize('kind', ['ray', 'gpu_ray', 'lidar', 'gpu_lidar'])
def test_a_gazebo_sensor_gives_link_place_and_settings(kind):
    description = described(usual(mounted('eye'), laser_sensor('eye', kind=kind, pose='0.02 0 0.03 0 0 1.5')))
    laser = description.laser
    assert laser.link == 'eye'
    assert laser.pose_in_root[:3, 3] == pytest.approx([0.12, 0.0, 0.23])
    assert math.atan2(laser.pose_in_root[1, 0], laser.pose_in_root[0, 0]) == pytest.approx(1.5)
    assert found(description, 'laser link')[1] == f'<sensor type="{kind}"> of link \'eye\''
    assert laser.settings['samples'] == 360 and isinstance(laser.settings['samples'], int)
    assert (laser.settings['range_min'], laser.settings['range_max'], laser.settings['noise']) == (0.12, 3.5, 0.01)


def test_the_last_ray_is_at_max_angle_a_scan_covers_at_most_a_turn_and_resolution_multiplies_rays():
    settings = only_laser(samples=181, angles=(-math.pi / 2, math.pi / 2)).settings
    step_rad = settings['angle_span'] / settings['samples']
    assert settings['angle_min'] + 180 * step_rad == pytest.approx(math.pi / 2)
    assert only_laser(angles=(0.0, 6.28319)).settings['angle_span'] == 2 * math.pi
    text = usual(mounted('eye'), laser_sensor('eye')).replace('<resolution>1<', '<resolution>0.5<')
    assert gazebo_lasers(tree_of(text))[0].settings['samples'] == 180


@pytest.mark.parametrize(
    ('rate_hz', 'simulated_hz'), [(10, 10), (5.5, 100 / 18), (40, 50), (30, 100 / 3), (1000, 100), (0.001, 0.01)]
)
def test_a_rate_is_the_nearest_whose_period_is_whole_10_ms(rate_hz, simulated_hz):
    laser = only_laser(rate=rate_hz)
    assert laser.settings['rate'] == pytest.approx(simulated_hz)
    assert bool(laser.notes) == (simulated_hz != pytest.approx(rate_hz, rel=1e-3))


@pytest.mark.parametrize(
    ('given', 'missing'),
    [
        ({'rate': 0}, {'rate'}),
        ({'ranges': (0.1, 'inf')}, {'range_max'}),
        ({'ranges': (2.0, 1.0)}, {'range_min', 'range_max'}),
        ({'angles': ('', 1.0)}, {'angle_min', 'angle_span'}),
    ],
)
def test_impossible_settings_are_left_to_the_defaults(given, missing):
    settings = {'angle_min', 'angle_span', 'range_min', 'range_max', 'rate'}
    assert settings - set(only_laser(**given).settings) == missing


EYE, OTHER, FRAME = mounted('eye'), mounted('other'), mounted('frame', '0 0 0.03', parent='eye')
SENSOR, RAISED = (laser_sensor('eye', frame='frame', pose=pose) for pose in ('', '0 0 0.03 0 0 0'))
CHAIN = mounted('laser_mount') + mounted('laser', parent='laser_mount') + mounted('scan', parent='laser')


@pytest.mark.parametrize(
    ('parts', 'choices', 'expected', 'has_settings'),
    [
        # The frame of the scans is taken if it is at the sensor's place.
        ((EYE, FRAME, RAISED), {}, 'frame', True),
        ((EYE, FRAME, SENSOR), {}, 'eye', True),
        # Without a sensor names decide, and the end of a chain is the frame.
        ((CHAIN,), {}, 'scan', False),
        ((mounted('base_scan'),), {}, 'base_scan', False),
        ((mounted('scan_button_plate'),), {}, None, False),
        # The user precedes the sensor; a link has the settings of its own one only.
        ((EYE, OTHER, SENSOR), {'laser_link': 'other'}, 'other', False),
        ((EYE, OTHER, SENSOR), {'laser_link': 'eye'}, 'eye', True),
    ],
)
def test_the_link_of_the_scans(parts, choices, expected, has_settings):
    laser = described(usual(*parts), **choices).laser
    assert (laser and laser.link, bool(laser and laser.settings)) == (expected, has_settings)


@pytest.mark.parametrize(('link_name', 'expected'), [('ey', "missing; .*did you mean 'eye'"), ('eye', 'leans')])
def test_a_link_that_is_missing_or_leans_is_refused(link_name, expected):
    with pytest.raises(ConfigError, match=f'given {link_name!r} as laser link, which .*{expected}'):
        described(usual(mounted('eye', rpy='0 0.5 0')), laser_link=link_name)


def test_only_level_plane_scanners_are_taken_of_several_the_first():
    spatial = laser_sensor('cloud').replace('</horizontal>', '</horizontal><vertical><samples>16</samples></vertical>')
    parts = mounted('cliff', rpy='0 1.57 0'), laser_sensor('cliff'), mounted('sonar'), laser_sensor('sonar', samples=3)
    others = mounted('cloud'), spatial, mounted('seer'), laser_sensor('seer', kind='camera'), laser_sensor('none')
    description = described(usual(*parts, *others))
    assert description.laser is None
    assert "scanners that are not level are left out: 'cliff'" in description.notes
    assert description.warnings[-1].startswith('no laser is found: simulator.laser_link names its link')
    description = described(usual(*parts, EYE, SENSOR, OTHER, laser_sensor('other')))
    assert description.laser.link == 'eye'
    assert "one laser is simulated, 'eye', and not 'other'" in description.notes
    assert "scanners that are not level are left out: 'cliff'" in description.notes


def test_a_scanner_upside_down_is_turned_up_and_its_rays_go_the_other_way():
    """It sees the same: a ray at +a about an axis that points down is one at -a about one that points up."""
    parts = mounted('eye', rpy=f'{math.pi} 0 0.7'), laser_sensor('eye', samples=151, angles=(-0.5, 1.0))
    description = described(usual(*parts))
    laser = description.laser
    assert "laser 'eye' is upside down: simulated upright" in description.warnings
    assert laser.pose_in_root[:3, :3] @ [0, 0, 1] == pytest.approx([0, 0, 1])
    assert math.atan2(laser.pose_in_root[1, 0], laser.pose_in_root[0, 0]) == pytest.approx(0.7)
    step_rad = laser.settings['angle_span'] / laser.settings['samples']
    bearings_rad = laser.settings['angle_min'] + step_rad * np.arange(laser.settings['samples'])
    assert bearings_rad[[0, -1]] == pytest.approx([-1.0, 0.5])
