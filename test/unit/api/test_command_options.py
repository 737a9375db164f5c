"""Keyword arguments are the options of the commands."""

from pathlib import Path

import pytest

from diff_encoder_sim.api.command_options import command_line, parsed
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.cli.campaign_arguments import parse

GIVEN = ['--config', 'quick', '--out', 'x']


def test_values_lists_and_flags_are_words():
    options = {
        'out': Path('a b'),
        'ppr': [40, 1632.67],
        'robot_arg': 'x:=1',
        'unchecked': True,
        'resume': False,
        'robot': None,
    }
    words = ['--out', 'a b', '--ppr', '40', '1632.67', '--robot-arg', 'x:=1', '--unchecked']
    assert command_line(options) == words


def test_they_are_parsed_as_the_commands():
    assert parsed(parse, [*GIVEN, '--trials', '3']).trials == 3


@pytest.mark.parametrize(
    ('words', 'named'),
    [(['--trials', '0'], "--trials: given '0'"), (['--trails', '1'], '--trails'), (['--ppr'], '--ppr')],
)
def test_a_mistake_is_an_error_of_one_line(words, named, capsys):
    with pytest.raises(ConfigError) as error:
        parsed(parse, [*GIVEN, *words])
    assert named in str(error.value) and '\n' not in str(error.value)
    assert capsys.readouterr() == ('', '')
