"""This process and others: garbage collection, Ctrl-C, roslaunch, git."""

import gc
import os
import signal
import subprocess
import sys
import threading

import pytest

from diff_encoder_sim.base.processes import (
    catches_signal,
    git,
    interrupts_blocked,
    is_roslaunch,
    parent_only_lists,
    without_collection,
)


@pytest.fixture(name='process')
def fixture_process():
    """Starts processes with given words in their command line: their ids."""
    started = []

    def process(*words):
        command = [sys.executable, '-c', 'print("runs", flush=True); input()', *words]
        started.append(subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE))
        started[-1].stdout.readline()  # just after its start a process has no command line yet
        return started[-1].pid

    yield process
    for each in started:
        each.communicate(b'\n')


@pytest.fixture(autouse=True)
def restored():
    yield
    gc.enable()


def test_it_is_off_within_and_on_after():
    with without_collection():
        assert not gc.isenabled()
    assert gc.isenabled()


def test_it_stays_off_where_it_was_off():
    gc.disable()
    with without_collection():
        pass
    assert not gc.isenabled()


def test_git_reports_a_commit_where_there_is_one(tmp_path):
    assert git(tmp_path, 'rev-parse', 'HEAD') is None
    assert git(tmp_path / 'nowhere', 'status') is None
    subprocess.run(['git', 'init', '-q', str(tmp_path)], check=True)
    assert git(tmp_path, 'rev-parse', '--is-inside-work-tree') == 'true'


def blocked():
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])


@pytest.fixture(name='pythons_ctrl_c')
def fixture_pythons_ctrl_c():
    """Python's handler of SIGINT, whichever a command that another test has run left behind."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures('pythons_ctrl_c')
def test_it_waits_until_the_end_of_the_context():
    passed = []
    with pytest.raises(KeyboardInterrupt):
        with interrupts_blocked():
            signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
            passed.append('the context')
    assert passed and not blocked()


def test_threads_and_processes_of_the_context_never_get_it():
    seen = []
    ask = 'import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))'
    with interrupts_blocked():
        thread = threading.Thread(target=lambda: seen.append(blocked()))
        thread.start()
        process = subprocess.run([sys.executable, '-c', ask], capture_output=True, text=True)
    thread.join()
    assert (seen, process.stdout) == ([True], 'True\n')


def test_a_process_is_roslaunch_by_its_command_line(process):
    assert is_roslaunch(process('/opt/ros/noetic/bin/roslaunch', 'diff_encoder_sim', 'trial.launch'))
    assert not is_roslaunch(process('rosrun', 'diff_encoder_sim', 'campaign'))


@pytest.mark.parametrize(
    ('words', 'lists'),
    [
        (['roslaunch', '--nodes', 'trial.launch'], True),
        (['roslaunch', '--find-node=/amcl', 'trial.launch'], True),
        (['roslaunch', 'trial.launch'], False),
    ],
)
def test_a_roslaunch_that_only_lists_is_known(words, lists, process, monkeypatch):
    pid = process(*words)
    monkeypatch.setattr(os, 'getppid', lambda: pid)
    assert parent_only_lists() is lists


def test_python_catches_ctrl_c_until_it_ends():
    script = (
        'import sys; hold = type("", (), {"__del__": lambda _: (print(1, flush=True), input())})(); sys.hold = hold'
    )
    pipes = {'stdin': subprocess.PIPE, 'stdout': subprocess.PIPE}
    ending = subprocess.Popen(
        [sys.executable, '-c', f'import signal; {script}; print(0, flush=True); input()'], **pipes
    )
    ending.stdout.readline()
    assert catches_signal(ending.pid, signal.SIGINT)
    assert not catches_signal(ending.pid, signal.SIGUSR1)
    ending.stdin.write(b'\n')
    ending.stdin.flush()
    ending.stdout.readline()
    assert not catches_signal(ending.pid, signal.SIGINT)
    ending.communicate(b'\n')
    assert catches_signal(ending.pid, signal.SIGINT)  # of one that is gone it is not known
