"""Ctrl-C at any moment of a command: one line and status 130."""

import os
import subprocess
import sys

import pytest

from diff_encoder_sim.base.command_start import OF_NODES
from places import SOURCE

COMMAND_FILE = """
import os, signal, sys, time

def parse():
    if sys.argv[1] == 'wrong':
        sys.exit('wrong arguments')
    if sys.argv[1] == 'parse':
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(20)

API = 'interrupted_tool'

def main():
    from diff_encoder_sim.interrupted_tool import main
    main()
"""
MODULE = """
'''node: does something.'''
import os, signal, sys, time
if '--help' not in sys.argv:
    print('imported')
stage = sys.argv[1]

def here(name):
    if stage == name:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(20)

try:
    here('import')
except BaseException:  # as libraries do that have a fallback
    pass

def main():
    import atexit
    atexit.register(here, 'exit')
    try:
        here('main')
    finally:
        print('tidied up')
"""
START = 'from diff_encoder_sim.base.command_start import run_command; run_command("tool", "interrupted_{}")'
WITH_PARSER, WITHOUT = START.format('command'), START.format('tool')


@pytest.fixture(name='ending')
def fixture_ending(tmp_path):
    """Runs a command that is interrupted at a stage: status, stdout and stderr."""
    (tmp_path / 'interrupted_tool.py').write_text(MODULE)
    (tmp_path / 'interrupted_command.py').write_text(COMMAND_FILE)
    findable = f'import diff_encoder_sim; diff_encoder_sim.__path__.append({str(tmp_path)!r})'

    def ending(stage, command=WITH_PARSER, stdout=subprocess.PIPE):
        process = subprocess.run(
            [sys.executable, '-c', f'{findable}; {command}', stage],
            env={**os.environ, 'PYTHONPATH': str(SOURCE)},
            stdout=stdout,
            stderr=subprocess.PIPE,
            text=True,
            timeout=15,
        )
        return process.returncode, process.stdout, process.stderr

    return ending


@pytest.mark.parametrize(('stage', 'printed'), [('parse', ''), ('import', ''), ('exit', 'tidied up\n')])
def test_a_stop_before_or_after_the_tool_ends_the_process_whatever_catches_exceptions(ending, stage, printed):
    status, out, err = ending(stage)
    assert (status, err) == (130, 'tool: stopped\n')
    assert out in ('', f'imported\n{printed}')  # what was not flushed yet is lost


def test_a_stop_of_the_tool_lets_it_tidy_up(ending):
    assert ending('main') == (130, 'imported\ntidied up\n', 'tool: stopped\n')


def test_a_tool_that_is_not_stopped_ends_as_ever_and_wrong_arguments_before_it_is_imported(ending):
    for stage, command in (('none', WITH_PARSER), ('none', WITHOUT)):
        assert ending(stage, command) == (0, 'imported\ntidied up\n', '')
    assert ending('wrong') == (1, '', 'wrong arguments\n')


def test_a_node_is_described_and_does_not_start(ending):
    assert ending('--help', WITHOUT) == (0, f'node: does something.\n\n{OF_NODES}\n', '')


@pytest.mark.parametrize('unbuffered', ['', '1'])
def test_output_that_cannot_be_written_is_one_line_and_a_closed_pipe_none(ending, unbuffered, monkeypatch):
    monkeypatch.setenv('PYTHONUNBUFFERED', unbuffered)
    reader, closed = os.pipe()
    os.close(reader)
    for out, status, told in ((os.open('/dev/full', os.O_WRONLY), 1, 'No space left on device\n'), (closed, 0, '')):
        ended, _, err = ending('--help', WITHOUT, out)
        os.close(out)
        assert ended == status and err.endswith(told) and len(err.splitlines()) == len(told.splitlines())
