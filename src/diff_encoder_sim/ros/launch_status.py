"""Make roslaunch exit with status 0 only if the trial succeeded.

roslaunch exits with status 0 whenever a required node dies (ros_comm issue 919, unresolved). A watcher process outside
roslaunch waits for the report of the trial. If the trial did not succeed, the watcher lets roslaunch stop all nodes and
then ends roslaunch by SIGINT, which shells treat as a failure. Alternatives: docs/adr/0003-exit-status.md.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from typing import Optional

from diff_encoder_sim.base.processes import catches_signal, is_roslaunch

SUCCESS = b'succeeded'
POLL_PERIOD_S = 0.002


class LaunchStatus:
    """Report of the trial: roslaunch fails unless `succeed` is called."""

    def __init__(self) -> None:
        """Start the watcher, if roslaunch started this process."""
        self._watcher: Optional[subprocess.Popen[bytes]] = None
        roslaunch_pid = os.getppid()
        if is_roslaunch(roslaunch_pid):
            command = [sys.executable, '-m', __name__, str(roslaunch_pid)]
            self._watcher = subprocess.Popen(command, stdin=subprocess.PIPE, start_new_session=True)

    def succeed(self) -> None:
        """Make roslaunch exit with status 0."""
        if self._watcher is not None and self._watcher.stdin is not None:
            self._watcher.stdin.write(SUCCESS)
            self._watcher.stdin.close()


def watch(roslaunch_pid: int) -> None:
    """Wait for the report; without success, end roslaunch by SIGINT, which it catches until its nodes have stopped."""
    report = sys.stdin.buffer.read()  # returns when the trial has reported or died
    while report != SUCCESS and is_roslaunch(roslaunch_pid):
        if not catches_signal(roslaunch_pid, signal.SIGINT):
            os.kill(roslaunch_pid, signal.SIGINT)
            return
        time.sleep(POLL_PERIOD_S)


if __name__ == '__main__':
    watch(int(sys.argv[1]))
