"""The workers that a campaign runs on: processes of this host, or a Dask cluster by address."""

from __future__ import annotations

import asyncio
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
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, Dict, Iterator, NamedTuple, Optional, Sequence, cast

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import ConfigError, in_one_line
from diff_encoder_sim.base.processes import interrupts_blocked, python_command
from diff_encoder_sim.trials.dask_settings import DASK_CONFIG, LOOPBACK, silence_dask
from diff_encoder_sim.trials.worker_process import STARTED, WorkerSettings

if TYPE_CHECKING:
    from distributed import Client
    from distributed.security import Security

if TYPE_CHECKING:
    from distributed.security import Security


dask = deferred('dask')
distributed = deferred('distributed')
versions_of_dask = deferred('distributed.versions')

log = logging.getLogger(__name__)

CONNECT_TIMEOUT_S = 5
# What must be equal everywhere for tasks to be understood, and for trials to be repeatable.
PACKAGES = ['numpy', 'numba']
COMPARED = ('python', 'dask', 'distributed', *PACKAGES)


class Workers(NamedTuple):
    """Where trials run."""

    client: Client
    problem: Callable[[], Optional[str]] = lambda: None  # why no trial can run any more, where that is known


class TlsFiles(NamedTuple):
    """Files in PEM format, by which the processes of a Dask cluster know each other."""

    ca: Path
    cert: Path
    key: Optional[Path]  # None: it is in the file of the certificate

    def security(self) -> Security:
        """Read the files.

        Raises:
            ConfigError: one is missing, or not what it should be.
        """
        for option, path in (('ca', self.ca), ('cert', self.cert), ('key', self.key or self.cert)):
            try:
                path.read_bytes()
            except OSError as error:
                raise ConfigError(f'--tls-{option}: given {str(path)!r}: {error.strerror}; allowed: a file') from None
        security: Security = distributed.Security(
            require_encryption=True,
            tls_ca_file=str(self.ca),
            tls_client_cert=str(self.cert),
            tls_client_key=str(self.key) if self.key else None,
        )
        try:
            security.get_connection_args('client')
        except (OSError, ValueError) as error:  # ssl.SSLError is an OSError
            given = ', '.join(str(path) for path in self if path)
            raise ConfigError(
                f'--tls-ca, --tls-cert, --tls-key: given {given}: {in_one_line(error)}; '
                f'allowed: certificates, and the key of --tls-cert, in PEM format'
            ) from None
        return security


@contextlib.contextmanager
def connected_workers(address: str, tls: Optional[TlsFiles] = None) -> Iterator[Workers]:
    """Connect to a running scheduler, such as tcp://host:8786; without `tls`, with what Dask's configuration has.

    Raises:
        ConfigError: no scheduler answers there, or its versions of Python or of libraries differ.
    """
    silence_dask()
    security = tls.security() if tls else distributed.Security()
    with dask.config.set(DASK_CONFIG), warnings.catch_warnings():
        warnings.simplefilter('ignore')  # about versions, which are checked here
        _check_scheduler(address, security)
        with distributed.Client(address, timeout=CONNECT_TIMEOUT_S, security=security, set_as_default=False) as client:
            _check_workers(client, address)
            yield Workers(client)


def _check_scheduler(address: str, security: Security) -> None:
    # Before a Client is made: of one that cannot connect the end is long and loud.
    try:
        versions = asyncio.run(asyncio.wait_for(_scheduler_versions(address, security), CONNECT_TIMEOUT_S))
    except Exception as error:  # many kinds, by address and by what answers there
        reason = in_one_line(error) if str(error) else f'no answer within {CONNECT_TIMEOUT_S} s'
        raise ConfigError(
            f'--scheduler: given {address!r}: {reason}; allowed: the address of a running Dask scheduler, such as '
            f'tcp://127.0.0.1:8786, or tls://127.0.0.1:8786 with --tls-ca and --tls-cert'
        ) from None
    check_versions(versions, f'scheduler {address}')


async def _scheduler_versions(address: str, security: Security) -> Dict[str, Any]:
    connection_args = security.get_connection_args('client')
    async with distributed.rpc(address, timeout=CONNECT_TIMEOUT_S, connection_args=connection_args) as scheduler:
        versions: Dict[str, Any] = await scheduler.versions(packages=PACKAGES)
        return versions


def check_versions(versions: Dict[str, Any], name: str) -> None:
    """Check that a peer has the versions that this process has.

    Raises:
        ConfigError: one differs.
    """
    here = _compared(versions_of_dask.get_versions(packages=PACKAGES))
    for package, version in _compared(versions).items():
        if version != here[package]:
            raise ConfigError(
                f'--scheduler: {package} is {version or "not installed"} on {name}, '
                f'{here[package]} here; allowed: the same versions on all hosts'
            )


def _compared(versions: Dict[str, Any]) -> Dict[str, str]:
    packages = {name: versions['packages'].get(name) for name in COMPARED}
    # Of Python 3.11.2.final.0 only 3.11 matters.
    return {**packages, 'python': '.'.join(str(packages['python']).split('.')[:2])}


def _check_workers(client: Client, address: str) -> None:
    versions = cast('Dict[str, Any]', client.get_versions(check=False, packages=PACKAGES))  # the client is synchronous
    for worker, there in versions['workers'].items():
        check_versions(there, f'worker {worker}')
    threads = client.nthreads().values()
    if not threads:
        log.warning('%s has no workers yet; waiting for one', address)
    if any(count > 1 for count in threads):
        log.warning(
            '%s has workers with several threads, but a worker runs one trial at a time: start more, with --nthreads 1',
            address,
        )


private_processes = deferred('diff_encoder_sim.trials.private_processes')


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
