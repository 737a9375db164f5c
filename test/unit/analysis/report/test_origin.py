"""The origin of the results."""

import pytest

from campaign_manifest import manifest
from diff_encoder_sim.analysis.report.origin import encoder_section, provenance, robot_section
from trial_tables import results_of, trial

MADE = results_of([trial('SL', '40')])


def test_the_origin_names_the_commands_and_the_host(tmp_path):
    origin = provenance(MADE._replace(manifest=manifest(), folder=tmp_path / 'results'))
    assert origin['commands'] == [
        "rosrun diff_encoder_sim campaign --config 'my file.yaml' --out results",
        f'rosrun diff_encoder_sim analyze {tmp_path}/results',
    ]
    run = dict(origin['runs'][0]['facts'])
    assert run['commit'] == 'abc with changes' and run['versions'] == 'numpy 2.0'
    assert run['host'] == 'a chip, 2 of 4 cores, 8 GiB, Linux'
    assert 'world: hallway' in origin['configuration']
    console = {**manifest()['runs'][0], 'command': ['/venv/bin/diff-encoder-sim', 'campaign', '--out', 'results']}
    origin = provenance(MADE._replace(manifest={'runs': [console]}, folder=tmp_path))
    assert origin['commands'] == ['diff-encoder-sim campaign --out results', f'diff-encoder-sim analyze {tmp_path}']


def test_bags_only_have_the_libraries_as_origin():
    origin = provenance(MADE)
    assert (origin['commands'], origin['runs'], origin['configuration']) == ([], [], None)
    assert origin['facts'][0][1].startswith('python ')
    assert encoder_section(MADE) is None and robot_section(MADE) is None


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
FAILED = {**CHECK, 'is_ok': False, 'advice': 'a stronger motor'}


def rows(table):
    return table.exact.values.tolist()


@pytest.mark.parametrize(
    ('checks', 'conclusion', 'checked'),
    [
        ([CHECK], 'It passed all 1 checks', [['torque', '100 %', 'ok']]),
        ([FAILED], 'Its self-check failed (torque)', [['torque', '100 %', 'NOT OK: a stronger motor']]),
        ([], 'It was not checked.', None),
    ],
)
def test_the_robot_has_its_checks_and_the_sources_of_its_values(checks, conclusion, checked):
    section = robot_section(MADE._replace(manifest={'robot': {**ROBOT, 'checks': checks}}))
    assert section['conclusion'].startswith(conclusion) and section['warnings'] == ['one wheel is flat']
    assert (section['checks'] if checked is None else rows(section['checks'])) == checked
    assert rows(section['found']) == [['mass [kg]', '32', '<inertial>']]
    assert rows(section['settings']) == [['config.wheel_diameter', '0.1']]


def test_each_encoder_is_a_row_with_what_its_counts_follow_from():
    amt102 = {'label': '8192 amt102', 'name': 'AMT102-V', 'price': 'industrial', 'resolution': '2048 lines x 4 = 8192'}
    amt102.update(source=['datasheet', 'manual'], counts_per_metre=13037.97)
    [row] = rows(encoder_section(MADE._replace(manifest={'encoders': [amt102]})))
    assert row[:3] == ['amt102 (8192 counts)', 'AMT102-V', 'industrial']
    assert row[3:] == ['2048 lines x 4 = 8192', '13038.0', 'datasheet; manual']
