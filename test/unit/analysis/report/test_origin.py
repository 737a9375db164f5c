"""The origin of the results."""

import pytest

from campaign_manifest import manifest
from diff_encoder_sim.analysis.report.origin import encoder_section, provenance, robot_section
from paper_datasets import dataset
from synthetic_trials import dataset_of, synthetic_dataset


def test_the_origin_names_the_commands_and_the_host(tmp_path):
    origin = provenance(dataset([])._replace(manifest=manifest(), folder=tmp_path / 'results'))
    assert origin.commands == [
        "rosrun diff_encoder_sim campaign --config 'my file.yaml' --out results",
        f'rosrun diff_encoder_sim analyze {tmp_path}/results',
    ]
    run = dict(origin.runs[0].facts)
    assert run['commit'] == 'abc with changes' and run['versions'] == 'numpy 2.0'
    assert run['host'] == 'a chip, 2 of 4 cores, 8 GiB, Linux'
    assert 'world: hallway' in origin.configuration


def test_bags_alone_have_no_origin_but_the_libraries():
    origin = provenance(dataset([]))
    assert (origin.commands, origin.runs, origin.configuration) == ([], [], None)
    assert origin.facts[0].text.startswith('python ')


CHECK = {'name': 'torque', 'value': '100 %', 'is_ok': True, 'advice': ''}
ROBOT = {
    'name': 'r2',
    'file': 'r2.yaml',
    'found': [{'quantity': 'mass [kg]', 'value': '32', 'source': '<inertial>'}],
    'set': {'config.wheel_diameter': 0.1},
    'warnings': ['one wheel is flat'],
    'notes': [],
    'checks': [CHECK],
}


@pytest.fixture(name='section')
def fixture_section():
    def section(**changes):
        return robot_section(dataset_of([])._replace(manifest={**manifest(), 'robot': {**ROBOT, **changes}}))

    return section


def rows(table):
    return [row.entries for row in table.blocks[0].rows]


def test_what_was_found_is_shown_with_its_source(section):
    shown = section()
    assert rows(shown.found) == [['mass [kg]', '32', '<inertial>']]
    assert rows(shown.settings) == [['config.wheel_diameter', '0.1']]
    assert shown.warnings == ['one wheel is flat']


def test_the_conclusion_says_whether_the_results_can_be_trusted(section):
    assert section().conclusion == 'It passed all 1 checks of its self-check.'
    failed = section(checks=[{**CHECK, 'is_ok': False, 'advice': 'a stronger motor'}])
    assert failed.conclusion.startswith('Its self-check failed (torque)')
    assert rows(failed.checks) == [['torque', '100 %', 'NOT OK: a stronger motor']]
    assert section(checks=[]).conclusion == 'It was not checked.'


def test_there_is_none_without_a_robot_in_the_manifest(section):
    assert robot_section(dataset_of([])) is None
    assert robot_section(dataset_of([])._replace(manifest=manifest())) is None
    assert section(found=None) is None


def test_a_campaign_of_the_console_command_is_repeated_with_it(tmp_path):
    by_pip = {**manifest()['runs'][0], 'command': ['/venv/bin/diff-encoder-sim', 'campaign', '--out', 'results']}
    origin = provenance(dataset([])._replace(manifest={**manifest(), 'runs': [by_pip]}, folder=tmp_path))
    assert origin.commands == ['diff-encoder-sim campaign --out results', f'diff-encoder-sim analyze {tmp_path}']


AMT102 = {
    'label': '8192 amt102',
    'name': 'AMT102-V',
    'source': ['datasheet', 'manual'],
    'price': 'industrial',
    'resolution': '2048 lines x 4 = 8192 counts per wheel revolution',
    'counts_per_metre': 13037.97,
}


def with_encoders(**manifest):
    return synthetic_dataset(tests=('SL',), pprs=('40',), trials=1)._replace(manifest=manifest)


def test_each_encoder_is_a_row_with_what_its_counts_follow_from():
    [block] = encoder_section(with_encoders(encoders=[AMT102])).blocks
    [row] = block.rows
    resolution, source = AMT102['resolution'], 'datasheet; manual'
    assert row.entries == ['amt102 (8192 counts)', 'AMT102-V', 'industrial', resolution, '13038.0', source]


@pytest.mark.parametrize('manifest', [{}, {'encoders': {}}, {'encoders': [{}]}, {'encoders': ['a']}])
def test_there_is_none_without_encoders_nor_in_an_edited_manifest(manifest):
    assert encoder_section(with_encoders(**manifest)) is None
