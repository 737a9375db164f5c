"""The parameters of all parts of a robot, from the files of config/, a robot and overrides; and how the robot stops."""

import math
import re
import shutil

import numpy as np
import pytest
import yaml

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import Params, flat
from diff_encoder_sim.base.per_wheel import PerWheel
from diff_encoder_sim.localization.slam_params import GridSlamParams
from diff_encoder_sim.robots.robot_file import robot_file_text
from diff_encoder_sim.simulation.simulator import SimulatorParams
from diff_encoder_sim.simulation.slip import CONTACT_CURVE_NOISE, CONTACT_DISTANCE_STD, WheelErrorParams
from diff_encoder_sim.trials import robot_params
from diff_encoder_sim.trials.robot_params import LatencyParams, load_robot, load_robot_config, override
from diff_encoder_sim.wheels.odometry_params import UNCERTAINTY_KEYS, USUAL_MOTION_NOISE, OdometryParams
from places import CONFIG, ROOT

ALTO = ROOT / 'urdf' / 'alto.urdf.xacro'
FILES = {stem: tuple(classes.values()) for stem, classes in robot_params.CONFIG_FILES.items()}
FILES['slam'] = (GridSlamParams,)
ERRORS, STOP = 'simulator.wheel_errors', 'navigation.DWAPlannerROS.stop'
# An older spelling; the size of a rolling window, which the global costmap is not; move_base's key of the same name.
ELSEWHERE = {
    'amcl.beam_skip_error_threshold_',
    'navigation.global_costmap.width',
    'navigation.global_costmap.height',
    'navigation.global_costmap.resolution',
    'navigation.DWAPlannerROS.latch_xy_goal_tolerance',
}


def overridden(values=()):
    return robot_params.override(load_robot_config(CONFIG), dict(values))


def test_a_file_that_is_missing_or_bad_is_named(tmp_path):
    folder = tmp_path / 'config'
    shutil.copytree(CONFIG, folder)
    (folder / 'amcl.yaml').write_text('max_particles: many\n')
    with pytest.raises(ConfigError, match=f"^{folder}/amcl.yaml: max_particles: given 'many'"):
        override(load_robot_config(folder), {})
    (folder / 'amcl.yaml').unlink()
    with pytest.raises(ConfigError, match='amcl.yaml: cannot be read'):
        override(load_robot_config(folder), {})


def test_a_latency_is_whole_ticks():
    with pytest.raises(ConfigError, match='command'):
        LatencyParams.from_mapping({'command': 0.005}, 'lockstep.yaml')
    assert robot_params.latency_ns(LatencyParams.from_mapping({'command': 0.07}, '').command) == 70_000_000


def parameters(params_class, instance=None, prefix=''):
    """(dotted key, default, description) of each parameter that has an effect."""
    for name, field in params_class.model_fields.items():
        default = field.get_default(call_default_factory=True) if instance is None else getattr(instance, name)
        key = f'{prefix}{field.alias or name}'
        if isinstance(default, Params) and not isinstance(default, PerWheel):
            yield from parameters(type(default), default, f'{key}.')
        elif not (field.description or '').startswith('accepted'):
            yield key, default, field.description or ''


@pytest.mark.parametrize('stem', FILES)
def test_a_file_has_every_parameter_with_its_default_and_unit(stem):
    text, path, lines = (CONFIG / f'{stem}.yaml').read_text(), [], {}
    for line in text.splitlines():  # by dotted key, those that are commented out, too
        match = re.match(r'( *)(?:# )?(\w+):(?: |$)', line)
        if match:
            path = [*path[: len(match[1]) // 2], match[2]]
            lines.setdefault('.'.join(path), line)
    set_here, order = dict(flat(yaml.safe_load(text))), list(lines)
    for key, default, description in (each for params_class in FILES[stem] for each in parameters(params_class)):
        in_file = re.sub(r'\.scan\..*', '.scan', key)
        assert in_file in lines or f'{stem}.{in_file}' in ELSEWHERE, key
        if key in lines and lines[key].lstrip().startswith('#') and key not in set_here:
            assert yaml.safe_load(lines[key].lstrip('# ')) == {key.split('.')[-1]: default}, key
        unit = re.search(r'\[[^]]+\]$', description)
        if unit and key in lines:  # there, or at the one before it of the same unit
            near = order[max(0, order.index(key) - 3) : order.index(key) + 1]
            assert unit[0] in ' '.join(lines[each] for each in near), f'{stem}.{key}: {unit[0]}'


@pytest.mark.parametrize('name', ['', *sorted(path.stem for path in (CONFIG / 'robots').glob('*.yaml'))])
def test_every_robot_of_the_package_is_loaded_by_name(name):
    robot = load_robot(name, ROOT, ROOT, {})
    params = overridden(robot.settings)
    assert params.encoder.left_joint == params.simulator.left_joint == robot.description.left.joint
    assert params.odometry.base_frame == params.amcl.base_frame_id == robot.description.tree.root
    assert params.navigator.global_costmap.footprint == params.navigator.local_costmap.footprint
    assert params.navigator.DWAPlannerROS.max_vel_x <= params.simulator.drive.max_linear_speed
    if not name:  # alto, with the parameters of config/
        nominal = {
            'wheel_diameter': SimulatorParams().wheel_diameter,
            'wheel_separation': 0.0,
        }  # as in the URDF, or the same numbers
        params = params._replace(simulator=params.simulator.model_copy(update=nominal))
        assert (robot.name, params) == ('alto', override(load_robot_config(CONFIG), {}))


def robot_file(folder, **settings):
    (folder / 'robot.yaml').write_text(yaml.safe_dump({'urdf': str(ALTO), 'set': settings}))
    return load_robot(str(folder / 'robot.yaml'), ROOT, ROOT, {})


@pytest.mark.parametrize(
    ('key', 'simulated_m'), [('simulator.wheel_separation', 0.5), ('config.wheel_separation', 0.4)]
)
def test_a_robot_file_sets_the_wheels_for_simulation_and_odometry_or_for_odometry_only(tmp_path, key, simulated_m):
    robot = robot_file(tmp_path, **{key: 0.5})
    assert robot.description.wheel_separation_m == pytest.approx(simulated_m)
    assert robot.settings['config.wheel_separation'] == 0.5


def test_two_diameters_are_of_simulation_and_odometry_or_of_odometry_only(tmp_path):
    both = {'left': 0.316, 'right': 0.318}
    for key, simulated_m, names in (
        ('simulator.wheel_diameter', (0.316, 0.318), ('odometry', 'simulator')),
        ('config.wheel_diameter', (0.2, 0.2), ('odometry',)),
    ):
        robot = robot_file(tmp_path, **{key: both})
        params = overridden(robot.settings)
        assert robot.description.wheel_diameters_m == simulated_m
        assert [getattr(params, name).wheel_diameter.plain for name in names] == [both] * len(names)
        written = tmp_path / f'{key}.yaml'
        written.write_text(robot_file_text(robot, written))
        assert load_robot(str(written), ROOT, ROOT, {}).settings == robot.settings
    robot = robot_file(tmp_path, **{'simulator.wheel_diameter': {'left': 0.0, 'right': 0.21}})
    assert robot.description.wheel_diameters_m == (0.2, 0.21)  # the left one as in the URDF


@pytest.mark.parametrize(
    ('settings', 'expected'),
    [
        ({'config.base_frme': 'b'}, "robot.yaml: set: config.base_frme: unknown key; did you mean 'config.base_frame'"),
        ({'simulator.left_joint': 3}, 'robot.yaml: simulator: left_joint: given 3; allowed: a valid string'),
        ({'simulator.left_joint': 'lft'}, "alto.urdf.xacro: given 'lft' as left wheel joint, which is missing"),
    ],
)
def test_a_mistake_is_named_with_the_robots_file(tmp_path, settings, expected):
    with pytest.raises(ConfigError) as error:
        robot_file(tmp_path, **settings)
    assert expected in str(error.value) and '\n' not in str(error.value)


def test_odometry_has_the_uncertainty_of_simulated_wheels_unless_a_user_gives_another():
    slip = {f'{ERRORS}.slip_noise': 2.7e-8}
    expected = 0.0, CONTACT_CURVE_NOISE, CONTACT_DISTANCE_STD, 0.0, 0.0
    assert overridden().odometry.uncertainty == dict(zip(UNCERTAINTY_KEYS, expected))
    assert overridden(slip).odometry.motion_noise == 2.7e-8
    given = {'config.motion_noise': 1e-5, 'config.curve_noise': 0.0, 'config.distance_std': 0.01}
    odometry = overridden({**slip, **given}).odometry
    assert (odometry.motion_noise, odometry.curve_noise, odometry.distance_std) == (1e-5, 0.0, 0.01)
    radius = {f'{ERRORS}.{side}_radius_error': 1e-4 for side in ('left', 'right')}
    assert overridden(radius).odometry.distance_std == pytest.approx(math.hypot(1e-4, CONTACT_DISTANCE_STD))
    # A robot file specifies nothing by zero, and an unknown robot has the usual noise.
    assert robot_params.uncertainty_of_robot({f'{ERRORS}.slip_noise': 0.0, 'config.wheel_diameter': 0.2}) == {}
    assert robot_params.uncertainty_of_robot(slip) == {'motion_noise': 2.7e-8}
    assert OdometryParams().uncertainty == dict(zip(UNCERTAINTY_KEYS, (USUAL_MOTION_NOISE, 0.0, 0.0, 0.0, 0.0)))


def test_radius_separation_slip_and_their_spread_are_separate():
    def of(**errors):
        stds = robot_params.wheel_uncertainty(WheelErrorParams(**errors))
        return [stds[f'{key}_std'] for key in ('distance', 'turn', 'diameter_difference')]

    assert of(left_radius_error=0.01, right_radius_error=0.03) == pytest.approx([0.02, 0.02, 0.02])
    assert of(wheel_separation_error=0.01) == pytest.approx([0.0, 0.01, 0.0])
    assert of(left_slip=0.1)[2] == pytest.approx(0.1)
    left, right = 0.01 * np.random.default_rng(1).standard_normal((2, 4000))
    separation, mean = 0.02 * np.random.default_rng(2).standard_normal(4000), 0.5 * (left + right)
    drawn = [mean.std(), (mean - separation).std(), (right - left).std()]
    assert of(radius_spread=0.01, wheel_separation_spread=0.02) == pytest.approx(drawn, rel=0.05)


def test_a_stop_depends_on_the_encoder_unless_it_latches():
    def line(*pprs, **changes):
        return robot_params.stopping_line(overridden({STOP: 'precise', **changes}), pprs)

    coarse, middle, fine = (PerWheel(left=counts, right=counts) for counts in (40, 90, 4096))
    assert line(middle, fine, coarse) == (
        'stopping: precise drives up to within about 6 mm and 1.0 degrees of the goal with 4096 counts, '
        '19 mm and 3.0 degrees with 40 counts; asked for: 50 mm and 3.0 degrees'
    )
    assert ' counts' not in line(middle)
    assert line(PerWheel(left=40, right=4096)) == line(coarse)  # the coarser wheel counts
    assert 'within about 11 mm' in line(fine, **{'lockstep.command': 0.2})
    latch = 'stopping: latch ends anywhere within {} mm and 3.0 degrees of the goal; asked for: 50 mm and 3.0 degrees'
    assert line(coarse, fine, **{STOP: 'latch'}) == latch.format(40)
    assert robot_params.stopping_line(
        robot_params.as_upstream(overridden({STOP: 'precise'})), [coarse]
    ) == latch.format(50)
