"""A command is named in messages as its user called it."""

import sys

import pytest

from diff_encoder_sim.base.command_line import as_called, as_typed, run_tool, tool_parser
from diff_encoder_sim.base.errors import ConfigError


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
