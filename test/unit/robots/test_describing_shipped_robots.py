"""The robots of config/robots: their files say what is published about them, and nothing in them needs a warning."""

import re
import shutil
import subprocess

import pytest

from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.robot_file import load_robot_file
from diff_encoder_sim.robots.robot_setup import derived_settings
from diff_encoder_sim.robots.simulated_robot import needs_other_files
from diff_encoder_sim.robots.xacro_expansion import expand
from diff_encoder_sim.trials.robot_params import load_robot_config, override
from places import ROOT

NAMES = sorted(path.stem for path in (ROOT / 'config' / 'robots').glob('*.yaml'))

# kg, wheel diameter and separation [m], counts per wheel revolution, states of the counter, reports per second
PUBLISHED = {
    'alto': (80, 0.2, 0.4, 90, 0, 20),
    'burger': (1.0, 0.066, 0.160, 4096, 2**32, 30),
    'waffle_pi': (1.8, 0.066, 0.287, 4096, 2**32, 30),
    'kobuki': (2.35 + 0.17, 0.070, 0.230, 52 * 6545 / 132, 2**16, 50),
    'create2': (3.6 + 0.17, 0.072, 0.235, 508.8, 2**16, 1 / 0.015),
    'hoverboard': (20.59, 0.165, 0.45, 90, 9000, 100),
    'gearmotor_kit': (1.26, 0.065, 0.17, 48 * 34.014, 2**32, 30),
}
# mm, length and width with the wheels
OUTSIDE = {'burger': (138, 178), 'waffle_pi': (281, 306), 'kobuki': (351.5, 351.5), 'create2': (348.5, 348.5)}


def shipped(name):
    return load_robot_file(name, ROOT, ROOT, {})


def params_of(name):
    file = shipped(name)
    config = load_robot_config(ROOT / 'config')
    return override(config, {**derived_settings(describe(file.source)), **file.overrides})


@pytest.mark.parametrize('name', NAMES)
def test_a_shipped_robot_has_the_published_mass_wheels_and_encoder(name):
    file, robot, params = shipped(name), describe(shipped(name).source), params_of(name)
    mass_kg, diameter_m, separation_m, ppr, modulus, rate_hz = PUBLISHED[name]
    assert robot.mass.mass_kg == pytest.approx(mass_kg)
    assert (robot.wheel_diameter_m, robot.wheel_separation_m) == pytest.approx((diameter_m, separation_m))
    assert (params.odometry.wheel_diameter, params.odometry.wheel_separation) == (diameter_m, separation_m)
    assert file.ppr == pytest.approx(ppr)
    assert (params.encoder.counter_modulus, params.encoder.rate) == (modulus, pytest.approx(rate_hz))


@pytest.mark.parametrize('name', NAMES)
def test_nothing_of_a_shipped_robot_is_doubtful(name):
    robot = describe(shipped(name).source)
    assert (robot.warnings, robot.notes) == ((), ())
    assert robot.laser is not None
    assert robot.contacts != ()


@pytest.mark.parametrize('name', OUTSIDE)
def test_a_shipped_robot_has_the_published_size(name):
    across_m = [max(side) - min(side) for side in zip(*describe(shipped(name).source).footprint)]
    assert [1e3 * each for each in across_m] == pytest.approx(OUTSIDE[name], abs=2)


@pytest.mark.parametrize('name', NAMES)
def test_the_counter_of_a_shipped_robot_does_not_wrap_within_a_report(name):
    """At the highest speed, and at the speed above which odometry takes a jump for a restart."""
    params, ppr = params_of(name), shipped(name).ppr
    drive = params.simulator.drive
    rim_mps = drive.max_linear_speed + 0.5 * drive.max_angular_speed * params.odometry.wheel_separation
    wheel_radps = 2 * rim_mps / params.odometry.wheel_diameter
    assert wheel_radps < params.odometry.max_wheel_speed
    counts = wheel_radps / 6.283 * ppr / params.encoder.rate
    assert counts < (params.encoder.counter_modulus or float('inf')) / 4


@pytest.mark.parametrize('name', NAMES)
def test_a_shipped_robot_travels_alone_once_expanded(name):
    assert not needs_other_files(expand(shipped(name).source))


@pytest.mark.parametrize('name', [name for name in NAMES if name != 'alto'])
def test_the_sources_of_a_shipped_robots_numbers_are_named(name):
    """Each [number] that is used is one of the list at the top, and the other way round."""
    for path in (ROOT / 'config' / 'robots' / f'{name}.yaml', ROOT / 'urdf' / f'{name}.urdf.xacro'):
        marks = re.findall(r'\[\d\]', path.read_text())
        assert marks != []
        assert min(marks.count(mark) for mark in marks) >= 2, path


@pytest.mark.skipif(shutil.which('check_urdf') is None, reason='liburdfdom-tools is not installed')
@pytest.mark.parametrize('name', NAMES)
def test_ros_reads_a_shipped_robot(name, tmp_path):
    (tmp_path / 'robot.urdf').write_text(expand(shipped(name).source))
    assert subprocess.run(['check_urdf', tmp_path / 'robot.urdf'], capture_output=True).returncode == 0
