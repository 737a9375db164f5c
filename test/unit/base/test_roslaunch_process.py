"""Which processes are roslaunch, and whether ours was started by one that only lists what is in a launch file."""

import os
import signal
import subprocess
import sys

import pytest

from diff_encoder_sim.base.processes import catches_signal, is_roslaunch, parent_only_lists


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


def test_a_process_is_roslaunch_by_its_command_line(process):
    assert is_roslaunch(process('/opt/ros/noetic/bin/roslaunch', 'diff_encoder_sim', 'trial.launch'))
    assert not is_roslaunch(process('rosrun', 'diff_encoder_sim', 'campaign'))


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


def test_a_process_that_is_gone_is_not_roslaunch():
    ended = subprocess.Popen([sys.executable, '-c', ''])
    ended.wait()
    assert not is_roslaunch(ended.pid)


@pytest.mark.parametrize(
    ('words', 'lists'),
    [
        (['roslaunch', '--nodes', 'trial.launch'], True),
        (['roslaunch', '--find-node=/amcl', 'trial.launch'], True),
        (['roslaunch', 'trial.launch'], False),
        (['rosrun', '--nodes'], False),
    ],
)
def test_a_roslaunch_that_only_lists_is_known(words, lists, process, monkeypatch):
    pid = process(*words)
    monkeypatch.setattr(os, 'getppid', lambda: pid)
    assert parent_only_lists() is lists
