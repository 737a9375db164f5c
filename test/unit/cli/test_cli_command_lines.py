"""--version and --help of every command that a user types."""

import importlib
import re
import sys

import pytest

from diff_encoder_sim.base.version import package_version
from places import ROOT

TOOLS = {
    'advise': 'cli.advise',
    'analyze': 'cli.analyze',
    'campaign': 'cli.campaign',
    'check_robot': 'cli.check_robot',
    'map_bag': 'cli.map_bag',
    'map_saver': 'ros.map_saver_node',
    'place_robot': 'ros.place_robot',
    'rasterise_world': 'cli.rasterise_world',
    'reencode': 'cli.reencode',
    'robot_description': 'cli.print_urdf',
    'robot_settings': 'cli.robot_settings',
    'trial_spec': 'cli.trial_spec',
}


@pytest.fixture(name='printed')
def fixture_printed(monkeypatch, capsys):
    """Runs a command in this process: what it prints, once it has ended with status 0."""

    def printed(name, *arguments):
        if TOOLS[name].startswith('ros.'):
            pytest.importorskip('rospy')
            pytest.importorskip('diff_encoder_sim.msg')
        monkeypatch.setattr(sys, 'argv', [name, *arguments])
        with pytest.raises(SystemExit) as ended:
            importlib.import_module(f'diff_encoder_sim.{TOOLS[name]}').main()
        assert not ended.value.code
        return capsys.readouterr().out

    return printed


def test_no_command_is_forgotten():
    """The executables in scripts/ whose modules read a command line, and those in this test."""
    found = {}
    for script in (ROOT / 'scripts').iterdir():
        if script.is_file() and not script.suffix:
            ((name, module),) = re.findall(r"^run_command\('(.*)', '(.*)'\)$", script.read_text(), re.MULTILINE)
            assert name == script.name
            if module.startswith('cli.') or 'tool_parser(' in source(module):
                found[name] = module
    assert found == TOOLS


def source(module):
    return (ROOT / 'src' / 'diff_encoder_sim' / f'{module.replace(".", "/")}.py').read_text()


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
