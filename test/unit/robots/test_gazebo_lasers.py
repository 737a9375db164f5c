import math

import pytest

from diff_encoder_sim.robots.laser_search import gazebo_lasers, whole_period_rate_hz
from urdf_texts import joint, laser_sensor, link, tree_of, usual

EYE = link('eye') + joint('eye_joint', 'eye', '0 0 0.2')


def only_laser(**given):
    (laser,) = gazebo_lasers(tree_of(usual(EYE, laser_sensor('eye', **given))))
    return laser


@pytest.mark.parametrize('kind', ['ray', 'gpu_ray', 'lidar', 'gpu_lidar'])
def test_each_type_of_scanner_is_read(kind):
    assert only_laser(kind=kind).settings['samples'] == 360


def test_a_camera_is_no_scanner():
    assert gazebo_lasers(tree_of(usual(EYE, laser_sensor('eye', kind='camera')))) == ()


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


def test_a_sensor_of_a_link_that_is_not_there_is_no_scanner():
    assert gazebo_lasers(tree_of(usual(laser_sensor('nowhere')))) == ()


@pytest.mark.parametrize(
    ('samples', 'rays'), [('1e300', 100_000), ('inf', None), ('nan', None), ('-5', None), ('', None)]
)
def test_a_number_of_rays_that_no_scanner_has_is_cut_or_no_scanner(samples, rays):
    found = gazebo_lasers(tree_of(usual(EYE, laser_sensor('eye', samples=samples))))
    assert [laser.settings['samples'] for laser in found] == ([] if rays is None else [rays])
