"""Starts whole graphs for pytest, each with a master and a ROS_HOME of its own, and ends all of their processes."""

import contextlib
import os
import random
import re
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from test_rostests import processes_of, why_not  # one place knows what rostests need, and how to clean up

from places import ROOT

DATA = ROOT / 'test' / 'rostest' / 'data'
TIME_LIMIT_S = 120.0
CHECKING = ('trial.launch', 'mapping.launch')  # launch files that check the robot first

# What ROS itself warns of on a slow machine, of any graph: roscpp of a simulator that starts paused, rospy of a
# subscriber that came upon the same publisher twice while nodes were coming up and dropped one connection.
HARMLESS = ('no clock published', 'terminated before handshake header received')


def complaints(output):
    """Warnings and errors in a launch's output."""
    return [
        line
        for line in output.splitlines()
        if ('WARN' in line or 'ERROR' in line) and not any(text in line for text in HARMLESS)
    ]


def require_ros():
    """Skips the test where ROS is not at hand, or fails it where it should be."""
    reason = why_not()
    if reason and os.environ.get('ROSTESTS_REQUIRED'):
        pytest.fail(reason)
    if reason:
        pytest.skip(reason)


def free_port():
    """A port at which a master may listen again and again: none that Linux gives to ends of connections meanwhile."""
    ports = random.SystemRandom().sample(range(20_000, 32_000), 100)  # Linux takes 32768 and above for those
    for port in ports:
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(('127.0.0.1', port))
            return port
    raise OSError(f'no port is free of {ports}')


class Graph:
    """A master's address, and every process that was started under it."""

    def __init__(self, home):
        self.home = Path(home)
        self.home.mkdir(parents=True, exist_ok=True)
        self.port = free_port()
        self.environment = dict(
            os.environ,
            ROS_MASTER_URI=f'http://127.0.0.1:{self.port}',
            ROS_IP='127.0.0.1',
            ROS_HOME=str(self.home),
            ROS_LOG_DIR=str(self.home / 'log'),
            PYTHONUNBUFFERED='1',
            PWD=str(self.home),
        )
        self.environment.pop('ROS_HOSTNAME', None)
        self._count = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for number in (signal.SIGTERM, signal.SIGKILL):
            for pid in processes_of(self.home):
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, number)
            if self.is_gone(5.0):
                break

    def is_gone(self, within_s):
        """Whether every process has ended, at the latest after some time."""
        deadline = time.monotonic() + within_s
        while processes_of(self.home):
            if time.monotonic() > deadline:
                return False
            time.sleep(0.05)
        return True

    def start(self, *command):
        """A command under this master."""
        self._count += 1
        return Process(command, self.environment, self.home, self.home / (f'out-{self._count}.txt'))

    def run(self, *command):
        """A command, to its end: (exit code, output)."""
        process = self.start(*command)
        return process.wait(), process.output()

    def launch(self, launch_file, *arguments):
        # The robot's checks take seconds, and are tested by themselves.
        is_checked = Path(launch_file).name in CHECKING and not any('unchecked:=' in str(each) for each in arguments)
        unchecked = ['unchecked:=true'] if is_checked else []
        return self.start('roslaunch', '-p', str(self.port), str(launch_file), *arguments, *unchecked)

    def wait_for_clock(self, time_s):
        code, output = self.run(sys.executable, str(ROOT / 'test' / 'rostest' / 'wait_for_clock.py'), str(time_s))
        assert code == 0, output


class Process:
    """A started command whose output goes to a file."""

    def __init__(self, command, environment, folder, log):
        self._log = log
        with open(log, 'wb') as out:
            self._process = subprocess.Popen(
                [str(word) for word in command],
                env=environment,
                cwd=str(folder),
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def wait(self, timeout_s=TIME_LIMIT_S):
        try:
            return self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            pytest.fail(f'still running after {timeout_s:.0f} s:\n{self.output()}')

    def output(self):
        return self._log.read_text(errors='replace')

    def send_signal(self, number):
        self._process.send_signal(number)

    def pid_of(self, node):
        """Process id of a node that this roslaunch started."""
        return int(re.search(rf'process\[{node}-\d+\]: started with pid \[(\d+)\]', self.output()).group(1))
