"""Whatever an argument of a command is given, it is taken, or what is wrong is said in one readable line.

For every argument of every command that runs without ROS: commands are those of test_cli_command_lines.py, arguments
those of their parsers.
"""

import argparse
import importlib

import pytest
from test_cli_command_lines import COMMANDS, TOOLS

from advised_robots import straight_advice
from diff_encoder_sim.api import advice, campaigns, notes, robots
from diff_encoder_sim.base.errors import ConfigError
from places import ROOT, WORLDS
from reencoding_drives import drive, write_ros1

LONG_PATH = '/tmp/' + 'x' * 5000

ABSURD = [
    LONG_PATH,
    LONG_PATH + '.yaml',
    'folder/' * 1000 + 'my.bag',
    '9' * 5000,
    '1' + '0' * 400,
    '1e300',
    '1e-300',
    'nan',
    '0100',
    '\udcff\n',
    '',
    'config.ppr:=1e300',
    LONG_PATH + ':=1',
]

# Arguments with which a command goes on to the end, or to where trials would run.
GOOD = {
    'advise': ['--candidates', '{tmp}/small.yaml', '--out', '{tmp}/out', '--unchecked'],
    'analyze': ['{tmp}/nothing.bag'],
    'campaign': ['--config', '{tmp}/small.yaml', '--out', '{tmp}/out', '--unchecked'],
    'check_robot': ['{tmp}/nothing.yaml'],
    'map_bag': ['{tmp}/drive.bag'],
    'rasterise_world': [str(WORLDS / 'hallway.world'), '--resolution', '1.0', '--out', '{tmp}/map'],
    'reencode': ['{tmp}/drive.bag'],
    'robot_description': ['alto'],
    'robot_settings': ['alto'],
    'trial_spec': ['--test', 'SL', '--bag', 'none', '--unchecked', 'true'],
}


class _Parser(Exception):
    """What `arguments_of` is after."""


def module_of(name):
    return importlib.import_module(f'diff_encoder_sim.{TOOLS[name]}')


def arguments_of(name, monkeypatch):
    """The command's arguments that take a value, from its own parser."""

    def stop(parser, *_):
        raise _Parser(parser)

    with monkeypatch.context() as patched:
        patched.setattr(argparse.ArgumentParser, 'parse_args', stop)
        with pytest.raises(_Parser) as caught:
            module_of(name).main([])
    return [action for action in caught.value.args[0]._actions if action.nargs != 0]


@pytest.fixture
def quick_loading(monkeypatch):
    """No trial is run, no odometry drawn, and equal campaigns and robots are loaded and checked once."""

    def workers(*_):
        raise ConfigError('would run')

    for module in (advice, campaigns):
        monkeypatch.setattr(module, 'workers', workers)
        monkeypatch.setattr(module, 'load_campaign', once(module.load_campaign))
    monkeypatch.setattr(advice, 'study_odometry', lambda *_: straight_advice())
    monkeypatch.setattr(notes, 'check_robot', once(notes.check_robot))
    monkeypatch.setattr(robots, 'load_robot', once(robots.load_robot))


def once(load):
    results = {}

    def loaded(*arguments, **named):
        key = repr((arguments, named))
        if key not in results:
            results[key] = load(*arguments, **named)
        return results[key]

    return loaded


def with_argument(good, action, value):
    """The command line with an argument replaced, or added."""
    if not action.option_strings:
        return [*(word for index, word in enumerate(good) if index > 0 or word.startswith('-')), value]
    option, *values = action.option_strings[-1:] + [value] * (action.nargs if isinstance(action.nargs, int) else 1)
    if option in good:
        at = good.index(option)
        return [*good[:at], option, *values, *good[at + 2 :]]
    return [*good, option, *values]


def ending(name, arguments, capsys):
    """What a command prints of an error, or nothing."""
    try:
        module_of(name).main(arguments)
    except SystemExit as ended:
        printed = capsys.readouterr().err
        return printed + ended.code if isinstance(ended.code, str) else printed if ended.code else ''
    return ''


def test_every_command_is_tried():
    assert COMMANDS == sorted(GOOD)


@pytest.mark.heavy
@pytest.mark.parametrize('name', COMMANDS)
def test_absurd_arguments_are_taken_or_refused_in_one_line(name, tmp_path, monkeypatch, capsys, quick_loading):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('PWD', str(tmp_path))
    write_ros1(tmp_path / 'drive.bag', drive())
    (tmp_path / 'small.yaml').write_text('{name: small, tests: [SL], ppr: [90], nav: scripted}')
    good = [word.format(tmp=tmp_path) for word in GOOD[name]]
    actions = arguments_of(name, monkeypatch)
    assert actions
    for action in actions:
        for value in ABSURD:
            text = ending(name, with_argument(good, action, value), capsys)
            shown = f'{action.dest} {value[:20]!r}: {text[-500:]}'
            assert 'Traceback' not in text, shown
            last = text.splitlines()[-1:] or ['']
            assert len(last[0]) < 1500, shown
            assert last[0].replace('\t', '').isprintable(), shown


@pytest.mark.parametrize(
    ('name', 'arguments', 'words'),
    [
        ('campaign', ['--config', LONG_PATH + '.yaml', '--out', 'o'], 'File name too long'),
        ('campaign', ['--config', 'quick', '--out', 'o', '--robot', LONG_PATH], 'a path of at most 4095 bytes'),
        ('campaign', ['--config', 'quick', '--out', LONG_PATH], 'File name too long'),
        ('advise', ['--candidates', LONG_PATH], 'File name too long'),
        ('analyze', [LONG_PATH], 'File name too long'),
        ('reencode', [LONG_PATH], 'File name too long'),
        ('map_bag', [LONG_PATH], 'File name too long'),
        ('check_robot', [LONG_PATH], 'File name too long'),
        ('rasterise_world', [LONG_PATH], 'File name too long'),
        ('robot_settings', [LONG_PATH], 'File name too long'),
        ('robot_settings', ['alto', 'moon.gravity:=1'], 'moon.gravity: unknown key'),
        ('trial_spec', ['--test', LONG_PATH], 'File name too long'),
        ('trial_spec', ['--test', 'SL', '--ppr', '1' + '0' * 400], 'allowed: 0.001 to 1e9 [per revolution]'),
        ('trial_spec', ['--test', 'SL', '--ppr', '0100'], 'ppr: given 0100, which YAML 1.1 takes for 64'),
        ('reencode', ['drive.bag', '--ppr', '1:30'], '--ppr: given 1:30, which YAML 1.1 takes for 90'),
        ('advise', ['--tolerance', '1e-300'], "given '1e-300'; allowed: 1e-6 to 1000 [m]"),
        ('advise', ['--trials', '9' * 5000], 'allowed: a whole number, 1 to 1000000'),
        ('advise', ['--workers', '9' * 30], 'allowed: a whole number, 1 to 1024'),
        ('map_bag', ['drive.bag', '--seed', '-1'], 'allowed: a whole number, 0 to'),
    ],
)
def test_what_is_wrong_is_said(name, arguments, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = ending(name, arguments, capsys)
    assert words in text.splitlines()[-1]
    assert len(text.splitlines()[-1]) < 1000


def test_the_package_is_the_checkouts():
    """Else another installation would be tried."""
    assert str(ROOT) in module_of('campaign').__file__
