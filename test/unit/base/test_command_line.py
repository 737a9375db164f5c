"""How tools are called, end and describe themselves, and numbers among their arguments."""

import argparse
import sys

import pytest

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.command_line import as_called, as_typed, number_within, tool_parser, user_errors
from diff_encoder_sim.base.errors import ConfigError, in_one_line


@pytest.mark.parametrize(
    ('error', 'code'),
    [
        (ConfigError('ppr: given 0; allowed: greater than 0'), 'tool: ppr: given 0; allowed: greater than 0'),
        (BrokenPipeError(), 0),
    ],
)
def test_a_users_mistake_is_one_line_and_a_closed_pipe_no_error(error, code):
    with pytest.raises(SystemExit) as ended, user_errors('tool'):
        raise error
    assert ended.value.code == code


def test_other_errors_are_not_hidden():
    with pytest.raises(ZeroDivisionError), user_errors('tool'):
        raise ZeroDivisionError


@pytest.mark.parametrize(
    ('program', 'called', 'typed'),
    [
        ('/ws/devel/lib/diff_encoder_sim/map_bag', 'map_bag', 'rosrun diff_encoder_sim map_bag'),
        ('/home/me/venv/bin/diff-encoder-sim', 'diff-encoder-sim map-bag', 'diff-encoder-sim map-bag'),
    ],
)
def test_a_command_has_the_name_that_was_typed(monkeypatch, program, called, typed):
    monkeypatch.setattr(sys, 'argv', [program, 'map-bag'])
    assert (as_called('map_bag'), as_typed('map_bag')) == (called, typed)
    text = tool_parser('map_bag', 'map_bag: build a map.', ['x.bag']).format_help()
    assert text.startswith(f'usage: {called} ') and f'\n\n{called}: build a map.\n' in text
    assert text.endswith(f'examples:\n  {typed} x.bag\n')


@pytest.mark.parametrize(
    ('kind', 'text', 'value'), [(float, '1632.67', 1632.67), (int, '30', 30)] + [(float, bad, None) for bad in
    ('0', 'nan', 'ninety', '1e300')] + [(int, bad, None) for bad in ('0', '1.5', '10001')]
)  # fmt: skip
def test_numbers_are_within_their_bounds(kind, text, value):
    parse = number_within(Between(1, 10000, 'm'), kind)
    if value is not None:
        assert parse(text) == value
        return
    with pytest.raises(argparse.ArgumentTypeError, match=r'^given .*; allowed: (a whole number, )?1 to 10000 \[m\]$'):
        parse(text)


def test_any_error_is_one_line():
    assert in_one_line(ValueError('one\n  two\tthree')) == 'one two three'
    assert in_one_line(MemoryError()) == 'MemoryError'
