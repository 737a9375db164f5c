"""--version and --help of every command that a user types, and the one command that pip installs."""

import importlib
import os
import re
import subprocess
import sys

import pytest

from diff_encoder_sim.base.package_files import package_version
from diff_encoder_sim.cli import console
from places import ROOT, SOURCE

TOOLS = {
    **{
        name: f'cli.{name}'
        for name in (
            *(
                'advise',
                'analyze',
                'calibrate',
                'campaign',
                'check_robot',
                'conformance',
                'map_bag',
                'rasterise_world',
                'reencode',
            ),
            *('robot_description', 'robot_settings', 'trial_spec'),
        )
    },
    'map_saver': 'ros.maps:map_saver',
    'conformance_node': 'ros.conformance_node:conformance_node',
    'place_robot': 'ros.external_programs:place_robot',
}
COMMANDS = sorted(name for name, module in TOOLS.items() if module.startswith('cli.'))
START = r"^run_command\('(\w+)', '([\w.:]+)'(?:, LaunchStatus\(\))?\)$"

# Each takes a part of a second to import.
SLOW = (
    *('numpy', 'pydantic', 'yaml', 'numba', 'scipy', 'dask', 'distributed', 'pybullet', 'altair', 'vl_convert'),
    *('rosbags', 'PIL', 'rospy'),
)
REPORT = f'import atexit, sys; atexit.register(lambda: print([name for name in {SLOW} if name in sys.modules]))'
RUN = f'{REPORT}; import runpy; sys.argv = sys.argv[1:]; runpy.run_path(sys.argv[0], run_name="__main__")'
CONSOLE = "import sys; from diff_encoder_sim.cli.console import main; sys.argv[0] = '/bin/diff-encoder-sim'; {}"


@pytest.fixture(name='printed')
def fixture_printed(monkeypatch, capsys):
    """Runs a command in this process: what it prints, once it has ended with status 0."""

    def printed(name, *arguments):
        if TOOLS[name].startswith('ros.'):
            pytest.importorskip('rospy')
            pytest.importorskip('diff_encoder_sim.msg')
        monkeypatch.setattr(sys, 'argv', [name, *arguments])
        with pytest.raises(SystemExit) as ended:
            module, _, function = TOOLS[name].partition(':')
            getattr(importlib.import_module(f'diff_encoder_sim.{module}'), function or 'main')()
        assert not ended.value.code
        return capsys.readouterr().out

    return printed


def test_no_command_is_forgotten():
    """The executables in scripts/ whose modules read a command line, and those in this test."""
    found = {}
    for script in (ROOT / 'scripts').iterdir():
        if script.is_file() and not script.suffix:
            ((name, module),) = re.findall(START, script.read_text(), re.MULTILINE)
            assert name == script.name
            file, _, function = module.partition(':')
            path = SOURCE / 'diff_encoder_sim' / f'{file.replace(".", "/")}.py'
            parse = f'parse_{function}' if function else 'parse'
            if re.search(rf'^def {parse}\(|^{parse} = | import {parse}$', path.read_text(), re.MULTILINE):
                found[name] = module
    assert found == TOOLS


@pytest.mark.parametrize('name', TOOLS)
def test_version_is_the_packages(name, printed):
    assert printed(name, '--version') == f'{name} (diff_encoder_sim) {package_version()}\n'


@pytest.mark.parametrize('name', TOOLS)
def test_help_describes_every_option_and_has_an_example(name, printed, monkeypatch):
    monkeypatch.setenv('COLUMNS', '100')
    text = printed(name, '--help')
    assert text.startswith(f'usage: {name} ') and f'\n{name}: ' in text
    assert f'\nexamples:\n  rosrun diff_encoder_sim {name} ' in text
    assert all(len(line) <= 100 for line in text.split('\nexamples:')[0].splitlines())
    for option in re.findall(r'^  (?:-\w(?: \w+)?, )?(--?[\w-]+)(.*(?:\n {6,}.*)?)', text, re.MULTILINE):
        assert len(re.sub(r'[A-Z|_]+', '', option[1]).split()) >= 2, option


def imports_none(*command):
    """Status, stdout and stderr of a command that imports none of the slow libraries."""
    environment = {**os.environ, 'PYTHONPATH': str(SOURCE)}
    done = subprocess.run([sys.executable, '-c', *command], env=environment, capture_output=True, text=True)
    assert done.stdout.endswith('[]\n')
    return done.returncode, done.stderr


@pytest.mark.parametrize('name', COMMANDS)
@pytest.mark.parametrize(('option', 'expected'), [('--help', 0), ('--no-such-option', 2)])
def test_help_and_wrong_options_wait_for_no_library(name, option, expected):
    status, error = imports_none(RUN, str(ROOT / 'scripts' / name), option)
    assert status == expected and bool(error) == (expected == 2)


@pytest.fixture(name='ending')
def fixture_ending(monkeypatch, capsys):
    """Runs the command in this process: status, stdout and stderr."""

    def ending(*arguments):
        monkeypatch.setattr(sys, 'argv', ['/bin/diff-encoder-sim', *arguments])
        with pytest.raises(SystemExit) as ended:
            console.main()
        return (ended.value.code or 0, *capsys.readouterr())

    return ending


def test_every_command_without_ros_is_there_but_for_those_that_launch_files_call():
    scripts = [path for path in (ROOT / 'scripts').iterdir() if path.is_file() and not path.suffix]
    tools = {path.name for path in scripts if f"run_command('{path.name}', 'cli." in path.read_text()}
    assert tools - set(console.COMMANDS) == {'robot_description', 'robot_settings', 'trial_spec'}
    assert set(console.COMMANDS) <= tools


@pytest.mark.parametrize('words', [['--help'], ['campaign', '--help'], ['map-bag', '--version']])
def test_what_needs_no_library_imports_none(words):
    assert imports_none(CONSOLE.format(f'{REPORT}; main()'), *words) == (0, '')


def test_version_and_help(ending):
    assert ending('--version') == (0, f'diff-encoder-sim (diff_encoder_sim) {package_version()}\n', '')
    status, text, _ = ending('--help')
    assert status == 0
    commands = [name.replace('_', '-') for name in console.COMMANDS]
    assert re.findall(r'^  ([a-z][a-z-]+)  +\w', text, re.MULTILINE) == commands


@pytest.mark.parametrize('name', ['map-bag', 'map_bag'])
def test_a_commands_help_names_it_as_it_is_called(name, ending):
    status, text, _ = ending(name, '--help')
    assert status == 0 and text.startswith('usage: diff-encoder-sim map-bag ') and 'rosrun' not in text


def test_a_mistake_is_one_line_that_names_the_command_as_it_was_called(ending, tmp_path):
    status, out, _ = ending('check-robot', str(tmp_path / 'none.urdf'))
    assert status.startswith('diff-encoder-sim check-robot: ') and '\n' not in status
    assert out == ''


@pytest.mark.parametrize('arguments', [[], ['campaing']])
def test_without_a_command_that_exists_the_commands_are_named(arguments, ending):
    status, out, err = ending(*arguments)
    assert (status, out) == (2, '') and err.startswith('usage: diff-encoder-sim COMMAND ...\n')
    assert arguments == [] or ("'campaing'" in err and 'check-robot' in err)
