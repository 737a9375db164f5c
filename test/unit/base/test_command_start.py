"""Ctrl-C at any moment of a command: one line and status 130."""

import os
import signal
import subprocess
import sys
import time

import pytest

from diff_encoder_sim.base.command_start import OF_NODES
from places import SOURCE

PARSER = """
import os, signal, sys, time

def parse():
    if sys.argv[1] == 'wrong':
        sys.exit('wrong arguments')
    if sys.argv[1] == 'parse':
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(20)
"""
MODULE = """
'''node: does something.'''
import os, signal, sys, time
print('imported')
stage = sys.argv[1]

def here(name):
    if stage == name:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(20)

class Swallows:
    def __del__(self):
        here('finalizer')

try:
    here('import')
except BaseException:  # as libraries do that have a fallback
    pass
Swallows()

def main():
    import atexit
    atexit.register(here, 'exit')
    try:
        here('main')
    finally:
        print('tidied up')
"""
COMMAND = 'from diff_encoder_sim.base.command_start import run_command; run_command("tool", "interrupted_tool"{})'
WITH_PARSER, WITHOUT = COMMAND.format(', parser="interrupted_arguments"'), COMMAND.format('')


@pytest.fixture(name='ending')
def fixture_ending(tmp_path):
    """Runs a command that is interrupted at a stage: status, stdout and stderr."""
    (tmp_path / 'interrupted_tool.py').write_text(MODULE)
    (tmp_path / 'interrupted_arguments.py').write_text(PARSER)
    findable = f'import diff_encoder_sim; diff_encoder_sim.__path__.append({str(tmp_path)!r})'

    def ending(stage, command=WITH_PARSER):
        process = subprocess.run(
            [sys.executable, '-c', f'{findable}; {command}', stage],
            env={**os.environ, 'PYTHONPATH': str(SOURCE)},
            capture_output=True,
            text=True,
            timeout=15,
        )
        return process.returncode, process.stdout, process.stderr

    return ending


@pytest.mark.parametrize(
    ('stage', 'printed'), [('parse', ''), ('import', ''), ('finalizer', ''), ('exit', 'tidied up\n')]
)
def test_a_stop_before_or_after_the_tool_ends_the_process_whatever_catches_exceptions(ending, stage, printed):
    status, out, err = ending(stage)
    assert (status, err) == (130, 'tool: stopped\n')
    assert out in ('', f'imported\n{printed}')  # what was not flushed yet is lost


def test_a_stop_of_the_tool_lets_it_tidy_up(ending):
    assert ending('main') == (130, 'imported\ntidied up\n', 'tool: stopped\n')


@pytest.mark.parametrize('command', [WITH_PARSER, WITHOUT])
def test_a_tool_that_is_not_stopped_ends_as_ever(command, ending):
    assert ending('none', command) == (0, 'imported\ntidied up\n', '')


def test_wrong_arguments_are_told_before_the_tool_is_imported(ending):
    assert ending('wrong') == (1, '', 'wrong arguments\n')
    assert ending('wrong', WITHOUT) == (0, 'imported\ntidied up\n', '')


@pytest.mark.parametrize('option', ['-h', '--help'])
def test_a_node_is_described_and_does_not_start(option, ending):
    described = f'imported\nnode: does something.\n\n{OF_NODES}\n'
    assert ending(option, WITHOUT) == (0, described, '')


def test_a_real_command_stopped_while_it_imports_its_libraries():
    script = SOURCE.parent / 'scripts' / 'analyze'
    process = subprocess.Popen(
        [sys.executable, '-X', 'importtime', str(script), 'results'],
        env={**os.environ, 'PYTHONPATH': str(SOURCE)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    for line in process.stderr:  # one for each import that is done
        if 'numpy' in line:
            process.send_signal(signal.SIGINT)
            break
    began_s = time.monotonic()
    out, err = process.communicate(timeout=15)
    own = [line for line in err.splitlines() if not line.startswith('import time:')]
    assert (process.returncode, out, own) == (130, '', ['analyze: stopped'])
    assert time.monotonic() - began_s < 5.0
