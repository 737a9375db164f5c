"""How tools are called, end and describe themselves, and numbers among their arguments."""

import argparse
import sys

import pytest

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.command_line import (
    as_called,
    as_typed,
    number_within,
    run_tool,
    tool_parser,
    whole_number_within,
)
from diff_encoder_sim.base.errors import ConfigError, in_one_line
from diff_encoder_sim.base.package_files import package_version


def ending(error):
    """What a tool that raises `error` exits with."""

    def tool():
        raise error

    with pytest.raises(SystemExit) as ended:
        run_tool('tool', tool)
    return ended.value.code


def test_a_users_mistake_is_one_line_and_status_1():
    assert ending(ConfigError('ppr: given 0; allowed: greater than 0')) == 'tool: ppr: given 0; allowed: greater than 0'


def test_a_reader_that_has_seen_enough_is_no_error():
    assert ending(BrokenPipeError()) == 0


def test_other_errors_are_not_hidden():
    with pytest.raises(ZeroDivisionError):
        run_tool('tool', lambda: 1 / 0)


def test_version_names_command_and_package(capsys):
    with pytest.raises(SystemExit) as ended:
        tool_parser('tool', 'tool: do it.', ['x']).parse_args(['--version'])
    assert ended.value.code == 0
    assert capsys.readouterr().out == f'tool (diff_encoder_sim) {package_version()}\n'


@pytest.mark.parametrize(
    ('program', 'called', 'typed'),
    [
        ('/ws/devel/lib/diff_encoder_sim/map_bag', 'map_bag', 'rosrun diff_encoder_sim map_bag'),
        ('scripts/map_bag', 'map_bag', 'rosrun diff_encoder_sim map_bag'),
        ('/home/me/venv/bin/diff-encoder-sim', 'diff-encoder-sim map-bag', 'diff-encoder-sim map-bag'),
    ],
)
def test_a_command_has_the_name_that_was_typed(monkeypatch, program, called, typed):
    monkeypatch.setattr(sys, 'argv', [program, 'map-bag'])
    assert as_called('map_bag') == called
    assert as_typed('map_bag') == typed


def test_errors_and_help_have_it(monkeypatch):
    monkeypatch.setattr(sys, 'argv', ['diff-encoder-sim'])

    def tool():
        raise ConfigError('no')

    with pytest.raises(SystemExit) as ended:
        run_tool('map_bag', tool)
    assert ended.value.code == 'diff-encoder-sim map-bag: no'
    text = tool_parser('map_bag', 'map_bag: build a map.', ['x.bag']).format_help()
    assert text.startswith('usage: diff-encoder-sim map-bag ')
    assert '\n\ndiff-encoder-sim map-bag: build a map.\n' in text
    assert text.endswith('examples:\n  diff-encoder-sim map-bag x.bag\n')


@pytest.mark.parametrize('text', ['0', 'nan', 'ninety', '1e300'])
def test_numbers_are_within_their_bounds(text):
    parse = number_within(Between(1e-3, 1e9, 'm'))
    with pytest.raises(argparse.ArgumentTypeError, match=r'^given .*; allowed: 0\.001 to 1e9 \[m\]$'):
        parse(text)
    assert parse('1632.67') == 1632.67


@pytest.mark.parametrize('text', ['0', '1.5', '1001'])
def test_counts_are_whole_numbers_within_their_bounds(text):
    parse = whole_number_within(Between(1, 1000))
    with pytest.raises(argparse.ArgumentTypeError, match='^given .*; allowed: a whole number, 1 to 1000$'):
        parse(text)
    assert parse('30') == 30


@pytest.mark.parametrize(
    ('error', 'line'),
    [(ValueError('one\n  two\tthree'), 'one two three'), (MemoryError(), 'MemoryError'), (KeyError('a'), "'a'")],
)
def test_any_error_is_one_line(error, line):
    assert in_one_line(error) == line
