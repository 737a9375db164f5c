"""How command-line tools end."""

import io
import signal
import sys

import pytest

from diff_encoder_sim.base.command_line import run_tool, tool_parser
from diff_encoder_sim.base.errors import ConfigError


def raising(error):
    def tool():
        raise error

    return tool


def test_a_users_mistake_is_one_line():
    with pytest.raises(SystemExit) as caught:
        run_tool('analyze', raising(ConfigError('a.bag: no such bag')))
    assert caught.value.code == 'analyze: a.bag: no such bag'  # which Python prints, and exits with 1


@pytest.mark.parametrize(('error', 'status'), [(KeyboardInterrupt(), 128 + signal.SIGINT), (BrokenPipeError(), 0)])
def test_an_interrupt_and_a_closed_pipe_have_their_status(error, status, monkeypatch):
    monkeypatch.setattr(sys, 'stderr', io.StringIO())  # which is closed where the pipe is
    with pytest.raises(SystemExit) as caught:
        run_tool('analyze', raising(error))
    assert caught.value.code == status


def test_other_errors_are_not_hidden():
    with pytest.raises(ZeroDivisionError):
        run_tool('analyze', raising(ZeroDivisionError()))


def test_help_has_each_example_as_a_whole_command():
    text = tool_parser('analyze', 'Makes a report.', ['results/', 'a.bag b.bag'], notes='A note.').format_help()
    assert text.endswith(
        'examples:\n  rosrun diff_encoder_sim analyze results/\n  rosrun diff_encoder_sim analyze a.bag b.bag\n'
    )
    assert 'Makes a report.' in text and 'A note.' in text
