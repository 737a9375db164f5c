"""The one command that pip installs."""

import os
import re
import subprocess
import sys

import pytest
from test_cli_command_lines import REPORT

from diff_encoder_sim.base.package_files import package_version
from diff_encoder_sim.cli.console import COMMANDS, main
from places import ROOT, SOURCE

START = "import sys; from diff_encoder_sim.cli.console import main; sys.argv[0] = '/bin/diff-encoder-sim'; {}"


@pytest.fixture(name='ending')
def fixture_ending(monkeypatch, capsys):
    """Runs the command in this process: status, stdout and stderr."""

    def ending(*arguments):
        monkeypatch.setattr(sys, 'argv', ['/bin/diff-encoder-sim', *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        return (ended.value.code or 0, *capsys.readouterr())

    return ending


def test_every_command_without_ros_is_there_but_for_those_that_launch_files_call():
    scripts = [path for path in (ROOT / 'scripts').iterdir() if path.is_file() and not path.suffix]
    tools = {path.name for path in scripts if f"run_command('{path.name}', 'cli." in path.read_text()}
    assert tools - set(COMMANDS) == {'robot_description', 'robot_settings', 'trial_spec'}
    assert set(COMMANDS) <= tools


@pytest.mark.parametrize('words', [['--help'], ['campaign', '--help'], ['map-bag', '--version']])
def test_what_needs_no_library_imports_none(words):
    command = [sys.executable, '-c', START.format(f'{REPORT}; main()'), *words]
    environment = {**os.environ, 'PYTHONPATH': str(SOURCE)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, '') and done.stdout.endswith('\n[]\n')


def test_version_and_help(ending):
    assert ending('--version') == (0, f'diff-encoder-sim (diff_encoder_sim) {package_version()}\n', '')
    status, text, _ = ending('--help')
    assert status == 0
    assert re.findall(r'^  ([a-z][a-z-]+)  +\w', text, re.MULTILINE) == [name.replace('_', '-') for name in COMMANDS]


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
