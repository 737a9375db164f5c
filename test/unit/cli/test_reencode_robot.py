"""Which wheels a recorded drive is read with, and where each is from."""

from argparse import Namespace
from pathlib import Path

import pytest

from diff_encoder_sim.api.wheel_options import recorded_robot
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.drives.trial_definition import Trial
from places import ROOT

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
