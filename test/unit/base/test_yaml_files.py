"""YAML means what its author reads; what would not is an error that names file and line."""

import pytest
import yaml

from diff_encoder_sim.base import yaml_files
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.yaml_files import load_yaml, yaml_value
from places import ROOT, SOURCE

SHIPPED = sorted((ROOT / 'config').rglob('*.yaml'))

# The text of line 2, and a pattern of the error: first what changes silently in YAML 1.1.
REFUSED = {
    'a: 0100': 'line 2: given 0100, which YAML 1.1 takes for 64',
    'a: 1:30': 'line 2: .*1:30.* 90',
    'a: 1_000': 'line 2: .*1_000.* 1000, or text in quotes',
    'a: yes': 'line 2: .*yes.* true',
    'a: 2020-01-02': 'line 2: .*a date; allowed: text in quotes',
    'a: [1, {b: 010}]': 'line 2: .*010.* 8',
    'on: 1': 'line 2: given the key on; allowed: .*quotes',
    'first: 2': 'line 2: first: given twice, first in line 1',
    'x: {b: 1, b: 2}': 'line 2: b: given twice, first in line 2',
    'a: \x07': 'not valid YAML: control characters',
    'a: [1': r'line \d: not valid YAML',
    'a: !!python/object/apply:os.system ["false"]': 'line 2: not valid YAML: could not determine a constructor',
    'a: *b': 'line 2: not valid YAML: found undefined alias',
}

PLAIN = {
    'a: 0x10': 16,
    'a: .5': 0.5,
    'a: 1.5e-3': 0.0015,
    'a: -.inf': float('-inf'),
    'a: true': True,
    'a: "0100"': '0100',
    "a: '2020-01-02'": '2020-01-02',
    'a: ~': None,
    'a: 08': '08',
    'a: 1e5': '1e5',
    'a: [1, {b: c}]': [1, {'b': 'c'}],
    'b: &b {x: 1, y: 2}\na: {<<: *b, y: 3}': {'x': 1, 'y': 3},
}


@pytest.fixture(name='load')
def fixture_load(tmp_path):
    def load(text):
        path = tmp_path / 'given.yaml'
        path.write_text(text, encoding='utf-8')
        return load_yaml(path)

    return load


@pytest.mark.parametrize('text', REFUSED)
def test_what_is_no_yaml_or_would_change_silently_is_named_with_file_and_line(load, text):
    with pytest.raises(ConfigError, match=rf'/given\.yaml(: |, ){REFUSED[text]}') as error:
        load(f'first: 1\n{text}\n')
    assert '\n' not in str(error.value)


@pytest.mark.parametrize('text', list(PLAIN))
def test_plain_values_are_as_ros_reads_them(load, text):
    assert load(text)['a'] == PLAIN[text] == yaml.safe_load(text)['a']


@pytest.mark.parametrize('path', SHIPPED, ids=lambda path: path.name)
def test_the_packages_own_files_are_as_ros_reads_them(path):
    assert load_yaml(path) == yaml.safe_load(path.read_text(encoding='utf-8'))


def test_a_file_that_is_missing_or_no_mapping_is_named(load, tmp_path):
    with pytest.raises(ConfigError, match=r'nowhere\.yaml: cannot be read: No such file'):
        load_yaml(tmp_path / 'nowhere.yaml')
    with pytest.raises(ConfigError, match='given a list; allowed: a mapping'):
        load('- a\n- b\n')


def test_arguments_are_read_as_files_are_and_else_text():
    assert yaml_value('{left: 90, right: 1024}', 'ppr') == {'left': 90, 'right': 1024}
    with pytest.raises(ConfigError, match=r'^ppr: given 0100, which YAML 1\.1 takes for 64; allowed: 64, or'):
        yaml_value('0100', 'ppr')
    for text in ('{left: 90', 'a: b: c', '*a'):
        assert yaml_value(text, 'ppr') == text


def test_only_this_module_loads_yaml():
    """Another loader would take 0100 for 64."""
    loading = [
        str(path)
        for folder in (SOURCE, ROOT / 'docs', ROOT / 'scripts')
        for path in folder.rglob('*')
        if path.is_file() and path.suffix in ('.py', '') and path != SOURCE / 'diff_encoder_sim/base/yaml_files.py'
        if any(word in path.read_text(encoding='utf-8') for word in ('yaml.safe_load', 'yaml.load', 'safe_load('))
    ]
    assert loading == []
    assert yaml_files.SafeLoader is getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
