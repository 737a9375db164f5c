"""Robot, encoders and wheels of recorded drives: sources of parameters, precedence, and contradictory options."""

from pathlib import Path

import pytest
import yaml

from diff_encoder_sim.api import wheel_options
from diff_encoder_sim.api.options import DriveOptions
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.wheels.catalogue import encoder_names
from diff_encoder_sim.wheels.encoder_params import EncoderModel
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from places import CONFIG, ROOT

GEARMOTOR = EncoderModel(lines=12, side='motor', gear_ratio=34.014)
TEST = TestDefinition.from_mapping({'name': 'T', 'world': 'w', 'drive': [{'straight': 1.0}]}, '')
TRIAL = Trial(test=TEST, wheel_diameter=0.15, wheel_separation=0.3, left_joint='l', right_joint='r')
BAG, CSV, TICKS = {'bag': Path('a.bag')}, {'csv': Path('a.csv')}, {'bag': Path('a.bag'), 'ticks': ('/l', '/r')}

TABLE, POSES = {**CSV, 'columns': '123'}, {'reference_columns': 'txy'}


def encoders(own=None, **options):
    params = EncoderParams(encoder=own) if own else EncoderParams()
    return wheel_options.chosen_encoders(DriveOptions(**options), params)


def labels(**options):
    return [encoder.label for encoder in encoders(**options)]


def robot(trial=None, seed=None, has_encoders=False, **options):
    return wheel_options.recorded_robot(DriveOptions(**options), trial, seed, has_encoders)


def file(folder, text):
    path = folder / 'mine.yaml'
    path.write_text(text)
    return path


def test_ideal_encoders_come_first_in_their_order():
    assert labels(ppr=['4096', '{left: 40, right: 90.5}']) == ['4096', '40-90.5']
    assert labels(ppr=['90'], encoder=['xl430', 'amt102']) == ['90', '4096 xl430', '8192 amt102']
    assert labels() == [f'{ppr}' for ppr in wheel_options.PAPER_PPR]
    assert [encoder.name for encoder in encoders(encoder=['catalogue'])] == encoder_names(CONFIG)


def test_the_robots_own_encoder_is_the_default_if_it_has_a_resolution():
    [own] = encoders(own=GEARMOTOR)
    assert own.label == '1632.67' and own.resolution.startswith('12 lines x 4 x gear 34.014 = 1632.672 counts')
    assert labels(own=GEARMOTOR, encoder=['amt102']) == ['8192 amt102']


@pytest.mark.parametrize(
    ('options', 'message'),
    [
        ({'ppr': ['90', '90.0']}, '--ppr: given 90 twice'),
        ({'encoder': ['catalogue', 'amt102']}, '--encoder: given 8192 amt102 twice'),
        ({'encoder': ['amt10']}, "encoder: given 'amt10'; allowed: "),
        ({'ppr': ['90'], 'own': GEARMOTOR}, '--ppr: given 90 with encoder: 12 lines'),
    ],
)
def test_a_bad_choice_of_encoders_is_refused(options, message):
    with pytest.raises(ConfigError, match=message):
        encoders(**options)


def test_a_real_encoder_replaces_the_robots_and_keeps_its_other_parameters(tmp_path):
    about = {**dict.fromkeys(('manufacturer', 'part', 'type', 'price'), 'a'), 'source': ['b']}
    content = {**about, 'encoder': {'sensor': 'absolute', 'bits': 10}}
    path = file(tmp_path, yaml.safe_dump({**content, 'config': {'counter_modulus': 1024}}))
    [real] = encoders(encoder=[str(path)])
    of_robot = EncoderParams(left_joint='l', rate=50.0, seed=7, encoder=GEARMOTOR)
    of_odometry = OdometryParams(wheel_diameter=0.1, encoder=GEARMOTOR)
    params, odometry = wheel_options.parameters_with(real, of_robot, of_odometry)
    assert params.encoder == odometry.encoder == EncoderModel(sensor='absolute', bits=10)
    assert (params.left_joint, params.rate, params.seed, params.counter_modulus) == ('l', 50.0, 7, 1024)
    assert (odometry.counter_modulus, odometry.wheel_diameter.plain) == (1024, 0.1)
    assert params.counts_per_turn == odometry.counts_per_turn == real.ppr


@pytest.mark.parametrize(
    ('trial', 'name', 'expected', 'source'),
    [
        (None, None, (0.2, 0.4, 'left_wheel_joint'), 'config/config.yaml'),
        (TRIAL, None, (0.15, 0.3, 'l'), "the bag's /trial"),
        (TRIAL, 'burger', (0.066, 0.16, 'wheel_left_joint'), 'burger.yaml'),
    ],
)
def test_a_robot_overrides_the_bag_and_the_bag_the_defaults(tmp_path, trial, name, expected, source):
    found = robot(trial, robot=name)
    assert (found.odometry.wheel_diameter.plain, found.odometry.wheel_separation, found.joints[0]) == expected
    assert source in found.text() and found.is_guessed() == (trial is None)
    path = file(tmp_path, 'wheel_diameter: 0.1\nodom_frame: odom\n')
    by_file = robot(trial, robot=name, config=path)
    assert by_file.odometry.wheel_diameter.plain == 0.1 and by_file.sources['wheel_diameter'] == str(path)
    assert by_file.odometry.wheel_separation == expected[1]


def test_a_robot_may_be_known_by_its_numbers_only(tmp_path):
    both = {'left': 0.316, 'right': 0.318}
    found = robot(robot=str(file(tmp_path, f'ppr: 409600\nset: {{config.wheel_diameter: {both}}}\n')))
    assert (found.odometry.wheel_diameter.plain, found.odometry.ppr.left, found.file.ppr) == (both, 409600, 409600)
    assert 'diameter 0.316 (left) and 0.318 (right) m (' in found.text() and found.file.calibration is None


def test_the_seed_is_the_number_of_the_bags_trial_unless_given():
    numbered = TRIAL.model_copy(update={'number': 7})
    seeds = [robot().encoder.seed, robot(numbered).encoder.seed, robot(numbered, seed=9).encoder.seed]
    assert seeds == [0, 7, 9]


def test_given_encoders_override_the_resolution_of_the_robots(tmp_path):
    alto = ROOT / 'urdf' / 'alto.urdf.xacro'
    path = file(tmp_path, f'urdf: {alto}\nset: {{config.encoder.lines: 500, config.encoder.edge_error: 0.1}}\n')
    own, by_ppr = (robot(robot=str(path), has_encoders=each).encoder.encoder for each in (False, True))
    assert (own.lines, own.edge_error, by_ppr.lines, by_ppr.edge_error) == (500, 0.1, None, 0.1)


def test_recorded_counts_wrap_as_in_the_file_the_bag_or_the_robot_and_computed_ones_do_not(tmp_path):
    trial = TRIAL.model_copy(update={'counter_modulus': 4096})
    found = robot(trial)
    assert (found.counts_modulus, found.encoder.counter_modulus, found.odometry.counter_modulus) == (4096, 0, 0)
    path = file(tmp_path, 'counter_modulus: 256\n')
    by_file, by_robot = robot(trial, config=path, robot='kobuki'), robot(trial, robot='kobuki')
    assert (by_file.counts_modulus, by_robot.counts_modulus, by_robot.encoder.counter_modulus) == (256, 4096, 65536)
    assert robot(TRIAL, robot='kobuki').counts_modulus == 65536
    assert by_file.counter_text() == f'counts wrap at 256: {path}'


@pytest.mark.parametrize(
    ('options', 'text'),
    [
        ({}, 'BAG, --csv: given neither'),
        ({**BAG, **CSV}, 'BAG, --csv: given both'),
        ({**BAG, 'odom': '/o', 'pulses': '/p'}, '--pulses, --odom: given both'),
        (CSV, '--csv: given without --columns'),
        ({**CSV, 'columns': '123', 'reference': '/o'}, '--reference: given with --csv'),
        ({**BAG, 'columns': '123'}, '--columns: given with wheel angles of joints; allowed: with --csv'),
        ({**TICKS, 'time_unit': 's'}, '--time-unit: given with --ticks'),
        ({**BAG, 'unit': 'rad'}, '--unit: given with wheel angles of joints; allowed: with --ticks or --csv'),
        ({**BAG, 'ticks_modulus': 0}, '--ticks-modulus: given with wheel angles'),
        ({**BAG, 'reversed': ['left']}, '--reversed: given with wheel angles'),
        ({**TICKS, 'left': 'l'}, '--left: given with --ticks; allowed: with --joint-states or --pulses'),
        ({**TICKS, 'unit': 'foot'}, '--unit: given foot; allowed: '),
        ({**BAG, **POSES}, '--reference-columns: given with a bag; allowed: with --csv or --reference-csv'),
        ({**BAG, **POSES, 'reference': '/o'}, '--reference: given with --reference-columns'),
        ({**TABLE, 'length_unit': 'cm'}, '--length-unit: given without --reference-columns'),
        ({**TABLE, 'reference_columns': 'tx'}, '--reference-columns: given 2 columns; allowed: TIME X Y'),
        ({**TABLE, **POSES, 'angle_unit': 'foot'}, '--angle-unit: given foot; allowed: rad, deg'),
        ({**TABLE, **POSES, 'reference_covariance': 'abcdef'}, '--reference-covariance: given 6 columns; allowed: XX '),
        ({**TABLE, **POSES, 'reference_csv': ['a', 'b']}, '--reference-csv: given 2 tables for 1 drives'),
    ],
)
def test_contradictory_options_are_refused(options, text):
    with pytest.raises(ConfigError) as caught:
        wheel_options.check_wheel_options(DriveOptions(**options), options.get('bag'), options.get('csv'))
    assert str(caught.value).startswith(text)
