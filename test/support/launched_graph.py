"""Starts whole graphs for pytest, each with a master and a ROS_HOME of its own, and ends all of their processes."""

import contextlib
import importlib.util
import os
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from places import ROOT

DATA = ROOT / 'test' / 'rostest' / 'data'
TIME_LIMIT_S = 120.0
CHECKING = ('trial.launch', 'mapping.launch')  # launch files that check the robot first

# Warnings of ROS itself on a slow machine: roscpp of a simulator that starts paused, rospy of a subscriber that dropped
# one of two connections to a publisher.
HARMLESS = ('no clock published', 'terminated before handshake header received')


def complaints(output):
    """Warnings and errors in a launch's output."""
    lines = [line for line in output.splitlines() if 'WARN' in line or 'ERROR' in line]
    return [line for line in lines if not any(text in line for text in HARMLESS)]


def messages_of(path):
    """{topic: [(type, bytes, md5sum)]} of a bag."""
    import rosbag

    messages = {}
    with rosbag.Bag(str(path)) as bag:
        for topic, (kind, content, md5sum, *_), _ in bag.read_messages(raw=True):
            messages.setdefault(topic, []).append((kind, content, md5sum))
    return messages


def require_ros():
    """Skips the test where ROS is not at hand, or fails it where it should be."""
    names = ('rospy', 'diff_encoder_sim.msg')
    if any(importlib.util.find_spec(name) is None for name in names) or shutil.which('rostest') is None:
        reason = 'no ROS here: source .ws/devel/setup.bash, or run scripts/test.sh'
        (pytest.fail if os.environ.get('ROSTESTS_REQUIRED') else pytest.skip)(reason)


def ros_environment(home, **more):
    """The environment of a graph; its ROS_HOME marks all of its processes."""
    environment = dict(os.environ, ROS_IP='127.0.0.1', ROS_HOME=str(home), ROS_LOG_DIR=str(home / 'log'), **more)
    environment.update(PYTHONUNBUFFERED='1', PWD=str(home))
    environment.pop('ROS_HOSTNAME', None)
    return environment


def end_processes_of(home):
    """roslaunch gives each node a session of its own, so processes are found by their ROS_HOME."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        for pid in processes_of(home):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, number)
        if is_gone(home, 5.0):
            return


def processes_of(home):
    marker = b'ROS_HOME=' + os.fsencode(str(home)) + b'\0'
    found = []
    for entry in Path('/proc').glob('[0-9]*/environ'):
        with contextlib.suppress(OSError):  # ended meanwhile, or another user's
            if marker in entry.read_bytes():
                found.append(int(entry.parent.name))
    return found


def is_gone(home, within_s):
    """Whether every process has ended, at the latest after some time."""
    deadline = time.monotonic() + within_s
    while processes_of(home):
        if time.monotonic() > deadline:
            return False
        time.sleep(0.05)
    return True


def free_port():
    """A port at which a master may listen again and again: Linux takes 32768 and above for ends of connections."""
    for port in random.SystemRandom().sample(range(20_000, 32_000), 100):
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(('127.0.0.1', port))
            return port
    raise OSError('no port is free')


class Graph:
    """A master's address, and every process that was started under it."""

    def __init__(self, home):
        self.home = Path(home)
        self.home.mkdir(parents=True, exist_ok=True)
        self.port = free_port()
        self.environment = ros_environment(self.home, ROS_MASTER_URI=f'http://127.0.0.1:{self.port}')
        self._count = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        end_processes_of(self.home)

    def is_gone(self, within_s=10.0):
        return is_gone(self.home, within_s)

    def start(self, *command):
        """A command under this master."""
        self._count += 1
        return Process(command, self.environment, self.home, self.home / f'out-{self._count}.txt')

    def run(self, *command):
        """A command, to its end: (exit code, output)."""
        process = self.start(*command)
        return process.wait(), process.output()

    def launch(self, launch_file, *arguments):
        # The robot's checks take seconds, and are tested by themselves.
        is_checked = Path(launch_file).name in CHECKING and not any('unchecked:=' in str(each) for each in arguments)
        unchecked = ['unchecked:=true'] if is_checked else []
        return self.start('roslaunch', '-p', str(self.port), str(launch_file), *arguments, *unchecked)

    def start_view(self):
        """What rviz:=true starts, except RViz itself."""
        wait = 'until rosparam get /trial > /dev/null 2>&1; do sleep 0.2; done'
        return self.start('sh', '-c', f'{wait}; exec {sys.executable} {ROOT}/scripts/trial_view_node')

    def start_master(self):
        core = self.start('roscore', '-p', str(self.port))
        wait_until(lambda: self.master.getPid() > 0, core)

    @property
    def master(self):
        import rosgraph

        return rosgraph.Master('/test', self.environment['ROS_MASTER_URI'])

    def wait_for_clock(self, time_s):
        code, output = self.run(sys.executable, ROOT / 'test' / 'rostest' / 'wait_for_clock.py', time_s)
        assert code == 0, output

    def add_packages(self, folder, programs):
        """Packages {name: {program: text}} that roslaunch finds before those that are installed."""
        for package, texts in programs.items():
            (folder / package).mkdir(parents=True)
            (folder / package / 'package.xml').write_text(
                f'<package><name>{package}</name><version>1.0.0</version><description>a stand-in</description>'
                '<maintainer email="a@b.c">a</maintainer><license>BSD</license></package>'
            )
            for program, text in texts.items():
                (folder / package / program).write_text(text)
                (folder / package / program).chmod(0o755)
        self.environment['ROS_PACKAGE_PATH'] = '{}:{}'.format(folder, os.environ['ROS_PACKAGE_PATH'])


def wait_until(condition, launch, timeout_s=60.0):
    """Until a condition holds; the master may not be up yet."""
    deadline = time.monotonic() + timeout_s
    while True:
        with contextlib.suppress(OSError):
            if condition():
                return
        assert time.monotonic() < deadline, launch.output()
        time.sleep(0.05)


class Process:
    """A started command whose output goes to a file."""

    def __init__(self, command, environment, folder, log):
        self._log = log
        with open(log, 'wb') as out:
            pipes = dict(stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT)
            about = dict(env=environment, cwd=str(folder), start_new_session=True)
            self._process = subprocess.Popen([str(word) for word in command], **pipes, **about)

    def wait(self, timeout_s=TIME_LIMIT_S):
        try:
            return self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            pytest.fail(f'still running after {timeout_s:.0f} s:\n{self.output()}')

    def has_ended(self):
        return self._process.poll() is not None

    def end(self):
        """Ctrl-C."""
        self.send_signal(signal.SIGINT)
        return self.wait(30.0)

    def output(self):
        return self._log.read_text(errors='replace')

    def wait_for_text(self, text, timeout_s=60.0):
        wait_until(lambda: text in self.output(), self, timeout_s)

    def send_signal(self, number):
        self._process.send_signal(number)

    def pid_of(self, node):
        """Process id of a node that this roslaunch started."""
        return int(re.search(rf'process\[{node}-\d+\]: started with pid \[(\d+)\]', self.output()).group(1))
