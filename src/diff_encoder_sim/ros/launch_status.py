"""Makes roslaunch exit with status 0 only when the trial succeeded.

roslaunch exits with status 0 however a required node dies (ros_comm issue 919, never solved). So a watcher process,
which roslaunch does not know, waits until the trial reports its success. If the trial ends without that, the watcher
lets roslaunch stop all nodes and then ends roslaunch itself by a signal, which shells see as a failure.
docs/adr/0003-exit-status.md has the alternatives.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import List, Optional

from diff_encoder_sim.base.roslaunch_process import is_roslaunch

SUCCESS = b'succeeded'
# Not one of those that roslaunch handles; a shell reports it as status 128 + 10.
FAILURE_SIGNAL = signal.SIGUSR1
POLL_PERIOD_S = 0.003


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
    """Wait for the trial's report; without its success, end roslaunch by a signal when its nodes have ended."""
    report = sys.stdin.buffer.read()  # returns when the trial has reported, or has died
    if report == SUCCESS:
        return
    while is_roslaunch(roslaunch_pid):
        if not _living_children(roslaunch_pid):
            os.kill(roslaunch_pid, FAILURE_SIGNAL)
            return
        time.sleep(POLL_PERIOD_S)


def _living_children(pid: int) -> List[int]:
    """Return the processes that any thread of `pid` has started and that have not ended yet."""
    children: List[int] = []
    for file in Path(f'/proc/{pid}/task').glob('*/children'):
        try:
            children += [int(child) for child in file.read_text().split()]
        except OSError:
            continue  # the thread ended meanwhile
    return [child for child in children if _is_alive(child)]


def _is_alive(pid: int) -> bool:
    try:
        state = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0]
    except OSError:
        return False
    return state not in 'ZX'


if __name__ == '__main__':
    watch(int(sys.argv[1]))
