"""YAML means what its author reads; what would not is an error that names file and line."""

import resource
import subprocess
import sys
import time

import pytest
import yaml

from diff_encoder_sim.base import yaml_files
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.yaml_files import LONGEST_FILE, load_yaml, yaml_value
from places import ROOT, SOURCE

SHIPPED = sorted((ROOT / 'config').rglob('*.yaml')) + sorted((ROOT / 'maps').glob('*.yaml'))

# What changes silently in YAML 1.1: the text of line 2, words of the error.
CHANGED = {
    'octal': ('a: 0100', ['0100', 'YAML 1.1', '64']),
    'negative octal': ('a: -010', ['-010', '-8']),
    'octal of a tag': ('a: !!int 010', ['010', '8']),
    'sexagesimal': ('a: 1:30', ['1:30', '90']),
    'sexagesimal with a fraction': ('a: 1:30.5', ['1:30.5', '90.5']),
    'thousands': ('a: 1_000', ['1_000', '1000', 'quotes']),
    'binary': ('a: 0b11', ['0b11', '3']),
    'yes': ('a: yes', ['yes', 'true', 'quotes']),
    'off': ('a: Off', ['Off', 'false']),
    'date': ('a: 2020-01-02', ['2020-01-02', 'a date', 'quotes']),
    'no date': ('a: 2020-13-45', ['2020-13-45']),
    'in a list': ('a: [1, {b: 010}]', ['010', '8']),
    'a key that is true': ('on: 1', ['the key on', 'quotes']),
    'a key that is a number': ('1: 1', ['the key 1']),
    'a key that is a list': ('[a]: 1', ['the key', 'list']),
    'more digits than Python reads': ('a: ' + '1' * 5000, ['1111', '...']),
    'duplicate': ('first: 2', ['first', 'twice', 'line 1']),
    'duplicate in quotes': ('"first": 2', ['first', 'twice', 'line 1']),
    'duplicate below': ('x: {b: 1, b: 2}', ['b', 'twice', 'line 2']),
}

PLAIN = {
    'a: 0': 0,
    'a: -12': -12,
    'a: +7': 7,
    'a: 0x10': 16,
    'a: .5': 0.5,
    'a: 5.': 5.0,
    'a: 1.5e-3': 0.0015,
    'a: -.inf': float('-inf'),
    'a: true': True,
    'a: False': False,
    'a: "0100"': '0100',
    "a: 'yes'": 'yes',
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


def tenfold(first, link):
    return first + ''.join(link.format(n, ','.join([f'*a{n - 1}'] * 10)) for n in range(1, 12))


BOMBS = {
    'lists of aliases': (tenfold('a0: &a0 [x]\n', 'a{0}: &a{0} [{1}]\n'), 'more than 100,000 values'),
    'merged aliases': (tenfold('a0: &a0 {x: 1}\n', 'a{0}: &a{0} {{<<: [{1}]}}\n'), 'more than 100,000 values'),
    'deep aliases': (
        'a0: &a0 [x]\n' + ''.join(f'a{n}: &a{n} [*a{n - 1}]\n' for n in range(1, 100)),
        'deeper than 50 levels',
    ),
    'an alias in itself': ('a: &a [*a]', 'contains itself'),
    'brackets': ('a: ' + '[' * 900_000, 'nest'),
    'braces': ('{a: ' * 200_000, 'deeper than 50 levels'),
    'dashes': ('- ' * 400_000, 'deeper than 50 levels'),
    'question marks': ('? ' * 400_000, 'deeper than 50 levels'),
    'many values': ('a: [' + '1,' * 400_000 + ']', 'more than 100,000 values'),
    'a long text': ('a: "' + 'x' * LONGEST_FILE + '"', 'longer than 1,000,000 characters'),
}


@pytest.mark.parametrize('name', list(BOMBS))
def test_a_bomb_ends_at_once(tmp_path, name):
    text, words = BOMBS[name]
    began_s = time.perf_counter()
    assert words in refusal(tmp_path, text)
    assert time.perf_counter() - began_s < 2.0


def test_an_endless_file_is_not_read_to_its_end():
    """In a process of its own, whose memory has a limit."""
    code = 'from diff_encoder_sim.base.yaml_files import load_yaml; load_yaml("/dev/zero")'
    result = subprocess.run(
        [sys.executable, '-c', code],
        env={'PYTHONPATH': str(SOURCE)},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (2 * 1024**3,) * 2),
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert result.stderr.splitlines()[-1].endswith(
        '/dev/zero: longer than 1,000,000 characters; allowed: a file of parameters'
    )


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


def test_a_path_that_no_system_takes_is_shortened():
    with pytest.raises(ConfigError, match=r'^/xxxx.*\.\.\.x+: cannot be read: File name too long$') as error:
        load_yaml('/' + 'x' * 5000)
    assert len(str(error.value)) < 400


def test_arguments_are_read_as_files_are():
    assert yaml_value('{left: 90, right: 1024}', 'ppr') == {'left': 90, 'right': 1024}
    with pytest.raises(ConfigError, match=r'^ppr: given 0100, which YAML 1\.1 takes for 64; allowed: 64, or'):
        yaml_value('0100', 'ppr')


@pytest.mark.parametrize('text', ['{left: 90', '[' * 5000, '\udcff', 'a: b: c', '*a', '!foo 1'])
def test_arguments_that_are_no_yaml_are_text(text):
    assert yaml_value(text, 'ppr') == text


def test_the_pure_python_loader_says_the_same(tmp_path):
    """Where PyYAML was built without libyaml."""
    code = (
        'import sys, yaml\n'
        'del yaml.CSafeLoader\n'
        'from diff_encoder_sim.base.yaml_files import SafeLoader, load_yaml\n'
        'assert SafeLoader is yaml.SafeLoader\n'
        'load_yaml(sys.argv[1])\n'
    )
    path = tmp_path / 'f.yaml'
    path.write_text('a: 1\na: 0100\n')
    command = [sys.executable, '-c', code, str(path)]
    result = subprocess.run(command, env={'PYTHONPATH': str(SOURCE)}, capture_output=True, text=True)
    assert result.stderr.splitlines()[-1].endswith(
        f'{path}, line 2: a: given twice, first in line 1; allowed: each key once'
    )


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
