"""Wheels and encoders that command lines name, where each is from, and options that contradict each other."""

import argparse
from argparse import Namespace
from pathlib import Path

import pytest
import yaml

from diff_encoder_sim.api.wheel_options import (
    PAPER_PPR,
    check_seed,
    check_wheel_options,
    chosen_encoders,
    given_encoders,
    parameters_with,
    ppr_of_text,
    recorded_robot,
)
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.reencode import parse
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.wheels.catalogue import encoder_names
from diff_encoder_sim.wheels.encoder_params import EncoderModel
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from places import CONFIG, ROOT

GEARMOTOR = EncoderModel(lines=12, side='motor', gear_ratio=34.014)


def given(ppr=None, encoder=None, own=None):
    options = argparse.Namespace(ppr=ppr, encoder=encoder)
    return chosen_encoders(given_encoders(options), EncoderParams(encoder=own) if own else EncoderParams())


def labels(**options):
    return [encoder.label for encoder in given(**options)]


def test_ideal_encoders_come_first_in_their_order():
    assert labels(ppr=['4096', '{left: 40, right: 90.5}']) == ['4096', '40-90.5']
    assert labels(ppr=['90'], encoder=['xl430', 'amt102']) == ['90', '4096 xl430', '8192 amt102']
    assert labels(encoder=['amt102']) == ['8192 amt102']
    assert labels() == [f'{ppr}' for ppr in PAPER_PPR]


def test_the_catalogue_is_every_encoder_of_the_package():
    assert [encoder.name for encoder in given(encoder=['catalogue'])] == encoder_names(CONFIG)


def test_the_robots_own_encoder_is_taken_where_it_has_a_resolution():
    [own] = given(own=GEARMOTOR)
    assert own.label == '1632.67' and own.resolution.startswith('12 lines x 4 x gear 34.014 = 1632.672 counts')
    assert labels(own=GEARMOTOR, encoder=['amt102']) == ['8192 amt102']


@pytest.mark.parametrize(
    ('options', 'message'),
    [
        ({'ppr': ['90', '90.0']}, '--ppr: given 90 twice; allowed: each once'),
        ({'encoder': ['catalogue', 'amt102']}, '--encoder: given 8192 amt102 twice; allowed: each once'),
        ({'encoder': ['amt10']}, "encoder: given 'amt10'; allowed: "),
        ({'ppr': ['90'], 'own': GEARMOTOR}, '--ppr: given 90 with encoder: 12 lines x 4 x gear 34.014 = 1632.672'),
    ],
)
def test_a_mistake_is_one_line(options, message):
    with pytest.raises(ConfigError) as caught:
        given(**options)
    assert str(caught.value).startswith(message) and '\n' not in str(caught.value)


@pytest.mark.parametrize('text', ['0', 'many', '{left: 40', '[40]'])
def test_what_is_no_ppr_is_refused_by_its_option(text):
    with pytest.raises(ConfigError, match='^--pulses-ppr: ppr'):
        ppr_of_text('--pulses-ppr', text)


def test_a_real_encoder_replaces_the_robots_and_keeps_what_is_not_its_own(tmp_path):
    content = {'name': 'a', 'source': ['b'], 'price': 'hobby', 'encoder': {'sensor': 'absolute', 'bits': 10}}
    (tmp_path / 'mine.yaml').write_text(yaml.safe_dump({**content, 'config': {'counter_modulus': 1024}}))
    [real] = given(encoder=[str(tmp_path / 'mine.yaml')])
    robot = EncoderParams(left_joint='l', rate=50.0, seed=7, encoder=GEARMOTOR)
    params, odometry = parameters_with(real, robot, OdometryParams(wheel_diameter=0.1, encoder=GEARMOTOR))
    assert params.encoder == odometry.encoder == EncoderModel(sensor='absolute', bits=10)
    assert (params.left_joint, params.rate, params.seed, params.counter_modulus) == ('l', 50.0, 7, 1024)
    assert (odometry.counter_modulus, odometry.wheel_diameter) == (1024, 0.1)
    assert params.counts_per_turn == odometry.counts_per_turn == real.ppr


TEST = TestDefinition.from_mapping({'name': 'T', 'world': 'w', 'drive': [{'straight': 1.0}]}, '')

TRIAL = Trial(test=TEST, wheel_diameter=0.15, wheel_separation=0.3, left_joint='l', right_joint='r')


def robot(trial=None, **options):
    usual = {
        'robot': None,
        'robot_args': [],
        'packages': [],
        'config': None,
        'ppr': None,
        'encoder': None,
        'seed': None,
    }
    return recorded_robot(Namespace(**{**usual, **options}), trial)


def wheels(found):
    return found.odometry.wheel_diameter, found.odometry.wheel_separation, found.encoder.left_joint


def test_without_any_word_they_are_guessed_and_said_to_be():
    found = robot()
    assert found.is_guessed() and '(config/config.yaml)' in found.text()


def test_a_bags_trial_says_what_they_are():
    found = robot(TRIAL)
    assert wheels(found) == (0.15, 0.3, 'l') and not found.is_guessed()
    assert found.text().startswith('wheels: diameter 0.15 m, separation 0.3 m, ')
    assert "(the bag's /trial)" in found.text()


def test_a_robot_goes_before_the_bag():
    found = robot(TRIAL, robot='burger')
    assert wheels(found) == (0.066, 0.16, 'wheel_left_joint')
    assert 'burger.yaml' in found.text()


@pytest.mark.parametrize('given', [None, 'burger'])
def test_a_yaml_file_goes_before_both(tmp_path, given):
    path = tmp_path / 'mine.yaml'
    path.write_text('wheel_diameter: 0.1\nodom_frame: odom\n')
    found = robot(TRIAL, robot=given, config=Path(path))
    assert found.odometry.wheel_diameter == 0.1 and found.sources['wheel_diameter'] == str(path)
    assert found.odometry.wheel_separation == (0.16 if given else 0.3)


def test_the_errors_of_encoders_are_those_of_the_bags_trial():
    assert robot().encoder.seed == 0
    assert robot(TRIAL.model_copy(update={'number': 7})).encoder.seed == 7
    assert robot(TRIAL, seed=9).encoder.seed == 9


def test_a_robots_encoder_has_a_resolution_that_gives_way(tmp_path):
    alto = ROOT / 'urdf' / 'alto.urdf.xacro'
    path = tmp_path / 'mine.yaml'
    path.write_text(f'urdf: {alto}\nset: {{config.encoder.lines: 500, config.encoder.edge_error: 0.1}}\n')
    own, by_ppr = (robot(robot=str(path), ppr=ppr).encoder.encoder for ppr in (None, ['40']))
    assert (own.lines, own.edge_error, by_ppr.lines, by_ppr.edge_error) == (500, 0.1, None, 0.1)


def test_recorded_counts_wrap_where_the_bag_says_and_computed_ones_do_not():
    found = robot(TRIAL.model_copy(update={'counter_modulus': 4096}))
    assert (found.counts_modulus, found.encoder.counter_modulus, found.odometry.counter_modulus) == (4096, 0, 0)
    assert found.counter_text() == "counts wrap at 4096: the bag's /trial"
    assert robot().counter_text() == 'counts do not wrap: config/config.yaml'


def test_a_file_that_says_where_counts_wrap_goes_before_the_bag_and_the_bag_before_a_robot(tmp_path):
    path, trial = tmp_path / 'mine.yaml', TRIAL.model_copy(update={'counter_modulus': 4096})
    path.write_text('counter_modulus: 256\n')
    by_file, by_robot = robot(trial, config=path, robot='kobuki'), robot(trial, robot='kobuki')
    assert (by_file.counts_modulus, by_robot.counts_modulus, by_robot.encoder.counter_modulus) == (256, 4096, 65536)
    assert robot(TRIAL, robot='kobuki').counts_modulus == 65536
    assert by_file.counter_text() == f'counts wrap at 256: {path}'
    path.write_text('wheel_diameter: 0.1\n')
    assert robot(trial, config=path).counts_modulus == 4096


LEFT_RIGHT = ['--ticks', '/lwheel', '/rwheel']


@pytest.mark.parametrize(
    ('arguments', 'text'),
    [
        ([], 'BAG, --csv: given neither; allowed: one of them'),
        (['a.bag', '--csv', 'a.csv'], 'BAG, --csv: given both; allowed: one of them'),
        (['a.bag', '--odom', '/o', '--pulses', '/p'], '--pulses, --odom: given both; allowed: one of them'),
        (
            ['a.bag', '--odom', '/o', *LEFT_RIGHT, '--csv', 'b'],
            '--ticks, --odom, --csv: given all; allowed: one of them',
        ),
        (['--csv', 'a.csv'], '--csv: given without --columns; expected --columns TIME LEFT RIGHT, as names or numbers'),
        (['a.bag', '--columns', '1', '2', '3'], '--columns: given with wheel angles of joints; allowed: with --csv'),
        (['a.bag', *LEFT_RIGHT, '--time-unit', 's'], '--time-unit: given with --ticks; allowed: with --csv'),
        (['a.bag', '--unit', 'rad'], '--unit: given with wheel angles of joints; allowed: with --ticks or --csv'),
        (['a.bag', '--odom', '/o', '--unit', 'rad'], '--unit: given with --odom; allowed: with --ticks or --csv'),
        (
            ['a.bag', '--ticks-modulus', '0'],
            '--ticks-modulus: given with wheel angles of joints; allowed: with --ticks or',
        ),
        (
            ['a.bag', '--reversed', 'left'],
            '--reversed: given with wheel angles of joints; allowed: with --ticks or --csv',
        ),
        (['a.bag', *LEFT_RIGHT, '--left', 'l'], '--left: given with --ticks; allowed: with --joint-states or --pulses'),
        (['a.bag', *LEFT_RIGHT, '--pulses-ppr', '9'], '--pulses-ppr: given with --ticks; allowed: with --pulses'),
    ],
)
def test_options_of_another_source_are_refused(arguments, text):
    with pytest.raises(ConfigError) as caught:
        check_wheel_options(parse(arguments))
    assert str(caught.value).startswith(text)


def check_seed_of(*arguments):
    options = parse(['a.bag', '--seed', '3', *map(str, arguments)])
    check_seed(options, recorded_robot(options, None))


@pytest.mark.parametrize('arguments', [[], ['--pulses', '/p'], [*LEFT_RIGHT, '--unit', 'rad']])
def test_a_seed_of_nothing_is_refused(arguments):
    with pytest.raises(ConfigError) as caught:
        check_seed_of(*arguments)
    assert str(caught.value).startswith('--seed: given 3, but nothing is random; allowed: with --encoder')


@pytest.mark.parametrize('config', ['encoder: {edge_error: 0.1}', 'report: {lost: 0.1}'])
def test_a_seed_is_of_errors_in_a_file(tmp_path, config):
    path = tmp_path / 'mine.yaml'
    path.write_text(f'{config}\n')
    check_seed_of('--config', path)


@pytest.mark.parametrize('arguments', [['--encoder', 'amt102'], ['--odom', '/odom'], [*LEFT_RIGHT, '--unit', 'm/s']])
def test_a_seed_is_of_a_real_encoder_and_of_angles_at_the_start(arguments):
    check_seed_of(*arguments)
