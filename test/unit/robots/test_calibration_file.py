"""The calibration in a robot file: what is accepted, and the file that is written and read again."""

import math

import numpy as np
import pytest
import yaml

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.calibration_file import CalibrationParams
from diff_encoder_sim.robots.robot_file import NO_ROBOT, calibrated_robot_text, load_robot_file
from diff_encoder_sim.trials.robot_params import load_numbers, load_robot, load_robot_config, override, wheel_errors_of
from diff_encoder_sim.wheels.odometry_params import UNCERTAINTY_KEYS
from places import CONFIG, ROOT


def estimate(value, half=0.0):
    return {'value': value, 'interval': [round(value - half, 9), round(value + half, 9)]}


# ln of left and right diameter and separation: 0.3 % of scale, 0.01 % of each wheel, 0.1 % of radius / separation.
FACTORS = np.array([[3e-3, 1e-4, 0.0, 0.0], [3e-3, 0.0, 1e-4, 0.0], [3e-3, 0.0, 0.0, 1e-3]])
GIVEN = {
    'left_wheel_diameter_m': estimate(0.3157, 0.0019),
    'right_wheel_diameter_m': estimate(0.3174, 0.0019),
    'wheel_separation_m': estimate(0.5612, 0.0035),
    'reference_x_m': estimate(-0.215, 0.004),
    'reference_y_m': estimate(0.003, 0.002),
    'reference_yaw_rad': estimate(0.01, 0.002),
    'reference_delay_s': estimate(0.11, 0.01),
    'slip_m2_per_m': estimate(3.1e-6, 1e-6),
    'slip_rad2_per_rad': estimate(2e-7, 2e-7),
    'geometry_covariance': (FACTORS @ FACTORS.T).round(15).tolist(),
    'drives': [{'file': 'drive 1.bag', 'sha256': 64 * 'a'}],
}
ALPHAS = {f'amcl.odom_alpha{number}': 0.01 * number for number in (1, 2, 3, 4)}


def calibration(**changes):
    return CalibrationParams.from_mapping({**GIVEN, **changes}, 'c')


@pytest.mark.parametrize(('changes', 'error'), [
    ({'wheel_separation_m': {'value': 0.5, 'interval': [0.51, 0.52]}},
     'c: wheel_separation_m.interval: given [0.51, 0.52]; allowed: low and high around the value, 0.5'),
    ({'left_wheel_diameter_m': {'value': 0.5}}, 'c: left_wheel_diameter_m.interval: missing'),
    ({'left_wheel_diameter_m': estimate(-0.1)}, 'c: left_wheel_diameter_m.value: given -0.1; allowed: 0 to 1e6'),
    ({'reference_dely_s': 0.1}, "c: reference_dely_s: unknown key; did you mean 'reference_delay_s'?"),
    ({'geometry_covariance': [[1e-6, 0.0], [0.0, 1e-6]]},
     'c: geometry_covariance: given [[1e-06, 0.0], [0.0, 1e-06]]; allowed: 3 rows of 3, symmetric and positive semi'),
    ({'geometry_covariance': np.diag([1e-6, -1e-6, 0.0]).tolist()},
     'c: geometry_covariance: given [[1e-06, 0.0, 0.0], [0.0, -1e-06, 0.0], [0.0, 0.0, 0.0]]; allowed: 3 rows of 3'),
    ({'drives': []}, 'c: drives: given []; allowed: '),
])  # fmt: skip
def test_a_bad_calibration_is_named(changes, error):
    with pytest.raises(ConfigError) as refused:
        calibration(**changes)
    assert str(refused.value).startswith(error)


def test_the_spread_of_the_geometry_is_that_of_distances_turns_and_the_difference():
    settings = calibration().settings()
    expected = math.hypot(3e-3, 1e-4 / math.sqrt(2)), math.hypot(1e-3, 1e-4 / math.sqrt(2)), 1e-4 * math.sqrt(2)
    keys = [f'config.{name}_std' for name in ('distance', 'turn', 'diameter_difference')]
    assert [settings[key] for key in keys] == pytest.approx(expected, rel=1e-5)


def written(folder, base, **changes):
    (folder / 'new').mkdir()
    path = folder / 'new' / 'calibrated.yaml'
    path.write_text(calibrated_robot_text(base, {**GIVEN, **changes}, ALPHAS, path))
    return str(path)


def test_a_calibrated_robot_is_read_again_without_a_urdf(tmp_path):
    path = written(tmp_path, NO_ROBOT._replace(ppr=409600.0))
    file, settings = load_numbers(path, tmp_path, ROOT, {})
    assert (file.ppr, file.calibration) == (409600.0, calibration())
    params = override(load_robot_config(CONFIG), settings)
    assert params.odometry.wheel_diameter.plain == {'left': 0.3157, 'right': 0.3174}
    assert (params.odometry.wheel_separation, params.odometry.motion_noise) == (0.5612, 3.1e-6)
    assert (params.amcl.odom_alpha1, params.amcl.odom_alpha4) == (0.01, 0.04)
    assert not any(key.startswith('simulator') for key in settings)
    with pytest.raises(ConfigError) as refused:
        load_robot(path, tmp_path, ROOT, {})
    assert str(refused.value) == f"{path}: urdf: missing; expected the robot's xacro or URDF, which this needs"


def base_file(folder, **settings):
    urdf, laser = str(ROOT / 'urdf' / 'burger.urdf.xacro'), {'parent': 'base_link', 'xyz': [0.0, 0.0, 0.2]}
    content = {'urdf': urdf, 'ppr': 4096, 'laser': laser, 'arguments': {}, 'set': settings}
    (folder / 'base.yaml').write_text(yaml.safe_dump(content))
    return load_robot_file('base.yaml', folder, ROOT, {})


@pytest.mark.parametrize('noise', [None, 1e-5])
def test_a_calibrated_robot_keeps_its_description_and_settings_and_is_simulated_as_calibrated(tmp_path, noise):
    slip = {} if noise is None else {'simulator.wheel_errors.slip_noise': noise}
    settings = {'config.counter_modulus': 65536, 'amcl.odom_alpha1': 0.5, 'config.wheel_diameter': 0.3, **slip}
    base = base_file(tmp_path, **settings)
    path = written(tmp_path, base, wheel_separation_m=estimate(0.16, 0.001))
    robot = load_robot(path, tmp_path, ROOT, {})
    assert (robot.file.source, robot.file.ppr) == (base.source, 4096)
    assert robot.description.wheel_diameters_m == (0.3157, 0.3174)
    params = override(load_robot_config(CONFIG), robot.settings)
    assert params.simulator.wheel_diameter.plain == params.odometry.wheel_diameter.plain
    assert (params.encoder.counter_modulus, params.amcl.odom_alpha1) == (65536, 0.01)
    assert params.simulator.wheel_errors.slip_noise == params.odometry.motion_noise == 3.1e-6
    assert {*params.odometry.uncertainty} == {*UNCERTAINTY_KEYS} and params.odometry.distance_std > 1e-3


def test_slip_by_motion_is_that_of_the_simulator_and_of_advice_without_a_urdf(tmp_path):
    found = {'slip_by_acceleration': estimate(0.01, 0.02), 'slip_by_lateral_acceleration': estimate(-0.03, 0.01)}
    for number, (base, loader) in enumerate(((base_file(tmp_path), load_robot), (NO_ROBOT, load_numbers))):
        (tmp_path / str(number)).mkdir()
        loaded = loader(written(tmp_path / str(number), base, **found), tmp_path, ROOT, {})
        settings = loaded.settings if loader is load_robot else loaded[1]
        assert wheel_errors_of(settings).slip.by_motion == (0.01, -0.03)
    base = base_file(tmp_path, **{'simulator.wheel_errors.slip.lateral_acceleration': 0.02})
    (tmp_path / 'new.yaml').write_text(calibrated_robot_text(base, GIVEN, {}, tmp_path / 'new.yaml', True))
    assert wheel_errors_of(load_robot('new.yaml', tmp_path, ROOT, {}).settings).slip.by_motion == (0.0, 0.02)


def test_a_simulated_robot_with_errors_stays_as_it_is_and_only_its_odometry_is_calibrated(tmp_path):
    base = base_file(tmp_path, **{'simulator.wheel_errors.right_radius_error': 0.005})
    robot = load_robot(written(tmp_path, base), tmp_path, ROOT, {})
    params = override(load_robot_config(CONFIG), robot.settings)
    assert robot.description.wheel_diameters_m == (0.066, 0.066)
    assert params.simulator.wheel_errors.right_radius_error == 0.005
    assert params.odometry.wheel_diameter.plain == {'left': 0.3157, 'right': 0.3174}
