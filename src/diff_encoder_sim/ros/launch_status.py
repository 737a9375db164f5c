"""Makes roslaunch exit with a status that tells whether the trial succeeded.

roslaunch ends with status 0 however a required node dies (ros_comm issue 919, never solved). So
a watcher outside of roslaunch's reach waits for the trial's word. Hearing none, it lets
roslaunch stop every node in good order and then ends roslaunch itself by a signal, which shells
see as a failure. docs/adr/0003-exit-status.md has the alternatives.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import List, Optional

SUCCESS = b'succeeded'
# Not one of those that roslaunch handles; a shell reports it as status 128 + 10.
FAILURE_SIGNAL = signal.SIGUSR1
POLL_PERIOD_S = 0.003


class LaunchStatus:
    """The trial's side: says `succeed` before it ends, or roslaunch fails."""

    def __init__(self) -> None:
        """Start the watcher, if this process was started by roslaunch."""
        self._watcher: Optional[subprocess.Popen] = None
        roslaunch_pid = os.getppid()
        if _is_roslaunch(roslaunch_pid):
            self._watcher = subprocess.Popen(
                [sys.executable, '-m', __name__, str(roslaunch_pid)], stdin=subprocess.PIPE, start_new_session=True
            )

    def succeed(self) -> None:
        """Let roslaunch end with status 0."""
        if self._watcher is not None and self._watcher.stdin is not None:
            self._watcher.stdin.write(SUCCESS)
            self._watcher.stdin.close()


def watch(roslaunch_pid: int) -> None:
    """The watcher's side: read the word, and fail roslaunch at its very end without it."""
    word = sys.stdin.buffer.read()  # ends when the trial says it or dies
    if word == SUCCESS:
        return
    while _is_roslaunch(roslaunch_pid):
        if not _living_children(roslaunch_pid):
            os.kill(roslaunch_pid, FAILURE_SIGNAL)
            return
        time.sleep(POLL_PERIOD_S)


def _is_roslaunch(pid: int) -> bool:
    try:
        return b'roslaunch' in Path(f'/proc/{pid}/cmdline').read_bytes()
    except OSError:
        return False


def _living_children(pid: int) -> List[int]:
    """Processes started by `pid`, its threads included, that have not exited yet."""
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
