"""YAML means what its author reads; what would not is an error that names file and line."""

import pytest
import yaml

from diff_encoder_sim.base import yaml_files
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.yaml_files import load_yaml, yaml_value
from places import ROOT, SOURCE

SHIPPED = sorted((ROOT / 'config').rglob('*.yaml')) + sorted((ROOT / 'maps').glob('*.yaml'))

# What changes silently in YAML 1.1: the text of line 2, words of the error.
CHANGED = {
    'octal': ('a: 0100', ['0100', 'YAML 1.1', '64']),
    'sexagesimal': ('a: 1:30', ['1:30', '90']),
    'thousands': ('a: 1_000', ['1_000', '1000', 'quotes']),
    'yes': ('a: yes', ['yes', 'true', 'quotes']),
    'date': ('a: 2020-01-02', ['2020-01-02', 'a date', 'quotes']),
    'in a list': ('a: [1, {b: 010}]', ['010', '8']),
    'a key that is true': ('on: 1', ['the key on', 'quotes']),
    'duplicate': ('first: 2', ['first', 'twice', 'line 1']),
    'duplicate below': ('x: {b: 1, b: 2}', ['b', 'twice', 'line 2']),
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
}


def load(tmp_path, text):
    path = tmp_path / 'given.yaml'
    path.write_text(text, encoding='utf-8')
    return load_yaml(path)


def refusal(tmp_path, text):
    with pytest.raises(ConfigError) as error:
        load(tmp_path, text)
    assert '\n' not in str(error.value)
    assert len(str(error.value)) < 1000
    return str(error.value)


@pytest.mark.parametrize('name', list(CHANGED))
def test_what_would_change_silently_is_named_with_file_and_line(tmp_path, name):
    text, words = CHANGED[name]
    line = refusal(tmp_path, f'first: 1\n{text}\n')
    assert line.startswith(f'{tmp_path}/given.yaml, line 2: ')
    for word in words:
        assert word in line


@pytest.mark.parametrize('text', list(PLAIN))
def test_plain_values_are_as_ros_reads_them(tmp_path, text):
    assert load(tmp_path, text)['a'] == PLAIN[text] == yaml.safe_load(text)['a']


@pytest.mark.parametrize('path', SHIPPED, ids=lambda path: path.name)
def test_the_packages_own_files_are_as_ros_reads_them(path):
    assert load_yaml(path) == yaml.safe_load(path.read_text(encoding='utf-8'))


def test_merged_keys_may_be_replaced(tmp_path):
    assert load(tmp_path, 'b: &b {x: 1, y: 2}\nc: {<<: *b, y: 3}')['c'] == {'x': 1, 'y': 3}


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('a: \x07', 'not valid YAML: control characters'),
        ('a: !foo 1', 'line 1: not valid YAML: could not determine a constructor'),
        ('a: *b', 'line 1: not valid YAML: found undefined alias'),
        ('a: 1\n---\nb: 1', 'line 2: not valid YAML'),
    ],
)
def test_what_is_no_yaml_is_named(tmp_path, text, words):
    assert words in refusal(tmp_path, text)


def test_arguments_are_read_as_files_are():
    assert yaml_value('{left: 90, right: 1024}', 'ppr') == {'left': 90, 'right': 1024}
    with pytest.raises(ConfigError, match=r'^ppr: given 0100, which YAML 1\.1 takes for 64; allowed: 64, or'):
        yaml_value('0100', 'ppr')


@pytest.mark.parametrize('text', ['{left: 90', 'a: b: c', '*a'])
def test_arguments_that_are_no_yaml_are_text(text):
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
