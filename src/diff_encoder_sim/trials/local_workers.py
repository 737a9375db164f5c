"""Worker processes of this host, which no other user of the host can reach."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import signal
import socket
import subprocess
import tempfile
import threading
import warnings
from typing import TYPE_CHECKING, Iterator, Optional, Sequence

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.processes import interrupts_blocked, python_command
from diff_encoder_sim.trials.cluster import Workers
from diff_encoder_sim.trials.dask_settings import DASK_CONFIG, LOOPBACK, silence_dask
from diff_encoder_sim.trials.worker_process import STARTED, WorkerSettings

if TYPE_CHECKING:
    from distributed.security import Security

dask = deferred('dask')
distributed = deferred('distributed')
private_processes = deferred('diff_encoder_sim.trials.private_processes')

log = logging.getLogger(__name__)

FAILED_STARTS = 5  # so many, one after another, and a worker is given up
LONGEST_ANSWER = 4096
# A trial is one thread's work: BLAS may not take the other workers' cores. Freed memory goes back to the system.
ENVIRONMENT = {
    'OMP_NUM_THREADS': '1',
    'MKL_NUM_THREADS': '1',
    'OPENBLAS_NUM_THREADS': '1',
    'MALLOC_TRIM_THRESHOLD_': '65536',
}


@contextlib.contextmanager
def local_workers(count: int) -> Iterator[Workers]:
    """Start a scheduler in this process, and `count` worker processes of one thread each; they end with the context.

    They speak TLS on loopback, by a key that only they have (docs/adr/0021-campaign-security.md). A worker that dies is
    replaced. When this process is killed, the workers end by themselves.
    """
    silence_dask()
    with contextlib.ExitStack() as opened:
        scratch = opened.enter_context(tempfile.TemporaryDirectory(prefix='campaign-'))
        # By default Dask shares $TMPDIR/dask-scratch-space with all users of the host, whoever created it.
        opened.enter_context(dask.config.set({**DASK_CONFIG, 'temporary-directory': scratch}))
        security = _new_key()
        with interrupts_blocked():  # in Dask's thread and ours: it comes to the main thread, which stops all
            scheduler = {
                'cls': private_processes.PrivateScheduler,
                'options': {'host': LOOPBACK, 'protocol': 'tls://', 'security': security, 'dashboard': False},
            }
            cluster = opened.enter_context(distributed.SpecCluster(scheduler=scheduler, security=security))
            settings = _settings(cluster.scheduler_address, security, scratch)
            processes = [KeptProcess(settings) for _ in range(count)]
            opened.callback(_stop, processes)
        client = opened.enter_context(distributed.Client(cluster, set_as_default=False))
        opened.callback(_stop, processes)  # before the client leaves: what they are at is of no use any more
        yield Workers(client, lambda: _problem(processes))


class KeptProcess:
    """A worker process, and its successors when it dies."""

    def __init__(self, settings: bytes) -> None:
        self._settings = settings
        self._process: Optional[subprocess.Popen[bytes]] = None
        self._is_stopped = False
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._keep_running, daemon=True)
        self.problem: Optional[str] = None  # of the last start
        self.is_given_up = False
        self._thread.start()

    def stop(self) -> None:
        """Kill the process: asked to end, it would finish its trial first."""
        with self._lock:
            self._is_stopped = True
            if self._process is not None:
                self._process.kill()

    def join(self) -> None:
        """Wait until the process is gone."""
        self._thread.join()

    def _keep_running(self) -> None:
        failed = 0
        while not self._is_stopped and failed < FAILED_STARTS:
            problem = self._run()
            failed = failed + 1 if problem else 0
            if failed == 1 and not self._is_stopped:
                log.warning('a worker process ended while it started (%s): trying again', problem)
            self.problem = problem
        self.is_given_up = not self._is_stopped

    def _run(self) -> Optional[str]:
        """Run one process until it ends; return why it did not start, or None when it did."""
        ours, theirs = socket.socketpair()
        with ours:
            try:
                with theirs, self._lock:
                    if self._is_stopped:
                        return None
                    self._process = _start(theirs)
            except OSError as error:
                return error.strerror
            answer = _exchange(ours, self._settings)
            status = self._process.wait()
        return None if answer == STARTED else answer.decode() or _ending(status)


def _new_key() -> Security:
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')  # of cryptography, which will leave Python 3.8
        security: Security = distributed.Security.temporary()
    return security


def _settings(scheduler: str, security: Security, scratch: str) -> bytes:
    """Return what a worker process reads first."""
    tls = security.get_tls_config_for_role('worker')
    settings = WorkerSettings(scheduler, tls['ca_file'], tls['cert'], tls['key'], scratch)
    return json.dumps(settings._asdict()).encode() + b'\n'


def _start(channel: socket.socket) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        python_command('trials.worker_process'),
        stdin=channel.fileno(),
        stdout=subprocess.DEVNULL,
        env={**os.environ, **ENVIRONMENT},
        start_new_session=True,  # signals of a terminal are for the client
    )


def _exchange(channel: socket.socket, settings: bytes) -> bytes:
    """Send a worker process its settings; return STARTED, why it does not start, or nothing if it died."""
    try:
        channel.sendall(settings)
        return channel.recv(LONGEST_ANSWER)
    except OSError:
        return b''


def _ending(status: int) -> str:
    return signal.Signals(-status).name if status < 0 else f'exit status {status}'


def _stop(processes: Sequence[KeptProcess]) -> None:
    for process in processes:
        process.stop()
    for process in processes:
        process.join()


def _problem(processes: Sequence[KeptProcess]) -> Optional[str]:
    """Return why no trial can run any more, or None."""
    if not all(process.is_given_up for process in processes):
        return None
    return f'no worker process starts on this host: {processes[0].problem}'
