"""A path among parameters is one that a file can have."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.robots.robot_file import RobotFileParams
from diff_encoder_sim.trials.campaign_cells import CampaignParams

LONG = 'x' * 5000
DEEP = 'folder/' * 1000
CAMPAIGN = {'name': 'c', 'tests': ['SL'], 'ppr': [90]}


@pytest.mark.parametrize('path', [LONG, DEEP, 'a/' + 'x' * 256, 'a\0b'])
@pytest.mark.parametrize(
    ('params_class', 'mapping', 'key'),
    [
        (RobotFileParams, lambda path: {'urdf': path}, 'urdf'),
        (RobotFileParams, lambda path: {'urdf': 'a', 'packages': ['b', path]}, 'packages.1'),
        (TestDefinition, lambda path: {'name': 't', 'world': path, 'drive': [{'straight': 1}]}, 'world'),
        (CampaignParams, lambda path: {**CAMPAIGN, 'tests': [path]}, 'tests.0'),
        (CampaignParams, lambda path: {**CAMPAIGN, 'robot': path}, 'robot'),
    ],
)
def test_a_path_that_no_file_can_have_is_named_with_file_and_key(params_class, mapping, key, path):
    with pytest.raises(ConfigError, match=rf'^f\.yaml: {key}: given .*; allowed: a file name, or a path') as error:
        params_class.from_mapping(mapping(path), 'f.yaml')
    assert len(str(error.value)) < 300


def test_so_is_the_image_of_a_map(tmp_path):
    path = tmp_path / 'm.yaml'
    path.write_text(f'image: {LONG}\nresolution: 0.05\norigin: [0, 0, 0]\n')
    with pytest.raises(ConfigError, match=r'm\.yaml: image: given .*; allowed: a file name, or a path'):
        load_map(path)


def test_usual_paths_are_kept():
    path = '/home/somebody/' + 'x' * 255 + '/robot.urdf'
    assert RobotFileParams.from_mapping({'urdf': path}, '').urdf == path
