"""This process and others: garbage collection, Ctrl-C, roslaunch, git."""

import os
import signal
import subprocess
import sys
import threading

import pytest

from diff_encoder_sim.base.processes import catches_signal, git, interrupts_blocked, is_roslaunch, parent_only_lists
from places import ROOT


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


def test_git_reports_where_there_is_a_repository(tmp_path):
    assert git(tmp_path / 'nowhere', 'status') is None
    assert git(ROOT, 'rev-parse', '--is-inside-work-tree') == 'true'


def blocked():
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])


def test_ctrl_c_waits_for_the_end_of_the_context_and_never_reaches_its_threads_and_processes():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    seen = []
    ask = 'import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))'
    with pytest.raises(KeyboardInterrupt):
        with interrupts_blocked():
            signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
            thread = threading.Thread(target=lambda: seen.append(blocked()))
            thread.start()
            seen.append(subprocess.check_output([sys.executable, '-c', ask], text=True))
            thread.join()
    signal.signal(signal.SIGINT, before)
    assert sorted(map(str, seen)) == ['True', 'True\n'] and not blocked()


@pytest.mark.parametrize(
    ('words', 'is_launch', 'lists'),
    [
        (['/opt/ros/noetic/bin/roslaunch', 'trial.launch'], True, False),
        (['roslaunch', '--find-node=/amcl', 'trial.launch'], True, True),
        (['rosrun', 'diff_encoder_sim', 'campaign'], False, False),
    ],
)
def test_a_roslaunch_and_one_that_only_lists_are_known(words, is_launch, lists, process, monkeypatch):
    pid = process(*words)
    monkeypatch.setattr(os, 'getppid', lambda: pid)
    assert (is_roslaunch(pid), parent_only_lists()) == (is_launch, lists)


def test_python_catches_ctrl_c_until_it_ends(process):
    pid = process()
    assert catches_signal(pid, signal.SIGINT) and not catches_signal(pid, signal.SIGUSR1)
    assert catches_signal(2**22 + 1, signal.SIGINT)  # of one that is gone it is not known
