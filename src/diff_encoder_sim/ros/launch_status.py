"""Makes roslaunch exit with status 0 only when the trial succeeded.

roslaunch exits with status 0 however a required node dies (ros_comm issue 919, never solved). So a watcher process,
which roslaunch does not know, waits until the trial reports its success. If the trial ends without that, the watcher
lets roslaunch stop all nodes and then ends roslaunch itself by SIGINT, which shells see as a failure without a word.
docs/adr/0003-exit-status.md has the alternatives.
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
    """The trial's side: roslaunch fails unless `succeed` is called."""

    def __init__(self) -> None:
        """Start the watcher, if this process was started by roslaunch."""
        self._watcher: Optional[subprocess.Popen[bytes]] = None
        roslaunch_pid = os.getppid()
        if is_roslaunch(roslaunch_pid):
            self._watcher = subprocess.Popen(
                [sys.executable, '-m', __name__, str(roslaunch_pid)], stdin=subprocess.PIPE, start_new_session=True
            )

    def succeed(self) -> None:
        """Let roslaunch end with status 0."""
        if self._watcher is not None and self._watcher.stdin is not None:
            self._watcher.stdin.write(SUCCESS)
            self._watcher.stdin.close()


def watch(roslaunch_pid: int) -> None:
    """Wait for the trial's report; without its success, end roslaunch by SIGINT when it has ended its nodes.

    roslaunch catches this signal until it has ended all nodes; then Python restores the signal's default action and
    spends some tenths of a second on freeing its objects.
    """
    report = sys.stdin.buffer.read()  # returns when the trial has reported, or has died
    if report == SUCCESS:
        return
    while is_roslaunch(roslaunch_pid):
        if not catches_signal(roslaunch_pid, signal.SIGINT):
            os.kill(roslaunch_pid, signal.SIGINT)
            return
        time.sleep(POLL_PERIOD_S)


if __name__ == '__main__':
    watch(int(sys.argv[1]))
