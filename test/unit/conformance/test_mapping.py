"""Mapping files of the conformance suite: errors by key, and values of the robot in parameters."""

import math
import re

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.base.params import load_params
from diff_encoder_sim.conformance.mapping import NodeMapping, Settings, Wheels, parameters_of
from odometry_subjects import ANGLES, COUNTS, mapping_of

FILES = sorted((package_folder() / 'config' / 'conformance').glob('*.yaml'))


@pytest.mark.parametrize(
    ('changes', 'texts'),
    [
        ({'input': {}}, ['input', 'left_count and right_count']),
        (
            {'input': {'/ticks.data[0]': 'left_count', '/ticks.data[1]': 'right_rad'}},
            ['input', 'left_rad and right_rad'],
        ),
        ({'input': [1]}, ['input']),
        ({'counter_bits': [12]}, ['counter_bits', '8, 16']),
        ({'pace': 'quick'}, ['pace', 'quick', 'fast']),
        ({'rate': 0}, ['rate', '0', '1 to 1000 [Hz]']),
        ({'rate': math.nan}, ['rate', 'nan']),
        ({'start_timeout': 1e9}, ['start_timeout', '1 to 60 [s]']),
        ({'command': 3}, ['command', '3']),
        ({'odom': '/odom\nx'}, ['odom']),
        ({'publish_tf': 'perhaps'}, ['publish_tf', 'perhaps']),
        ({'odometry': '/odom'}, ['odometry']),
    ],
)
def test_a_mistake_gets_one_line_with_its_key(changes, texts):
    with pytest.raises(ConfigError) as error:
        NodeMapping.from_mapping({'input': COUNTS, **changes}, 'node.yaml')
    message = str(error.value)
    assert '\n' not in message and all(text in message for text in ['node.yaml', *texts]), message


@pytest.mark.parametrize('path', FILES, ids=lambda path: path.stem)
def test_all_values_of_the_robot_in_shipped_files_are_known(path):
    mapping = load_params(NodeMapping, path)
    assert not re.findall(r'\{\w+\}', str(parameters_of(mapping, Wheels(), Settings(256, 1e-4))))


def test_texts_in_braces_become_numbers_at_any_depth_and_others_stay():
    about = {
        'radius': '{wheel_radius}',
        'deep': {'least': '{counter_min}', 'most': '{counter_max}'},
        'x': ['{ppr}', '{y}'],
    }
    mapping = mapping_of(COUNTS, parameters={'/node': about})
    (found,) = parameters_of(mapping, Wheels(wheel_diameter=0.3), Settings(65536, 0.0)).values()
    assert found == {'radius': 0.15, 'deep': {'least': -32768, 'most': 32767}, 'x': ['{ppr}', '{y}']}


def test_only_counts_wrap_and_angles_that_are_counted_give_exact_poses():
    counts, angles, continuous = mapping_of(COUNTS), mapping_of(ANGLES), mapping_of(ANGLES, encoder=False)
    assert [each.reads_counts for each in (counts, angles, continuous)] == [True, False, False]
    assert [each.is_exact for each in (counts, angles, continuous)] == [True, True, False]
