"""Executors of trials: a pool of processes on this host, or the workers of a Dask cluster."""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import importlib
import logging
import multiprocessing
import os
import signal
import sys
import tempfile
import types
import warnings
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import TYPE_CHECKING, Any, Callable, Dict, Iterator, Tuple, Type, TypeVar, Union, cast

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import CampaignFault, ConfigError, MissingLibrary, in_one_line
from diff_encoder_sim.base.processes import interrupts_blocked
from diff_encoder_sim.trials.trial_files import TrialFiles

if TYPE_CHECKING:
    from distributed import Client
    from distributed.security import Security

dask = deferred('dask')
distributed = deferred('distributed')

T = TypeVar('T')
log = logging.getLogger(__name__)


# ---- processes of this host

# A trial uses one thread, so BLAS must not use the cores of other workers. Freed memory is returned to the system.
ENVIRONMENT = {
    **dict.fromkeys(('OMP_NUM_THREADS', 'MKL_NUM_THREADS', 'OPENBLAS_NUM_THREADS'), '1'),
    'MALLOC_TRIM_THRESHOLD_': '65536',
    'PYTHONSAFEPATH': '1',  # Python 3.11+: no imports from the current folder, which another user may own
}
FAILED_STARTS = 5
PR_SET_PDEATHSIG = 1


class LocalWorkers:
    """A process pool that is replaced after a process died. Use from the main thread only."""

    lost: Tuple[Type[BaseException], ...] = (BrokenProcessPool,)

    def __init__(self, count: int, scratch: str) -> None:
        """Prepare `count` processes; `scratch` is a private folder for the files of trials."""
        self._count, self._scratch = count, scratch
        self._pool: Any = None  # a ProcessPoolExecutor between `_start` and `close`

    def submit(self, function: Callable[..., T], *arguments: Any) -> Future[T]:
        """Run a function in a process of the pool, which is replaced if broken; CampaignFault if no process starts."""
        for _ in range(FAILED_STARTS):
            with contextlib.suppress(BrokenProcessPool):
                if self._pool is None:
                    self._start()
                with _spawning():
                    future: Future[T] = self._pool.submit(function, *arguments)
                    return future
            self.close()
        raise CampaignFault('no worker process starts on this host')

    def count(self) -> int:
        """Return the number of processes."""
        return self._count

    def send(self, files: TrialFiles) -> TrialFiles:
        """Write the files once for all processes."""
        return files.materialise(self._scratch)

    def close(self) -> None:
        """Kill all processes; terminated ones would finish their trials first."""
        if self._pool is not None:
            for process in list((self._pool._processes or {}).values()):
                process.kill()
            self._pool.shutdown()
            self._pool = None

    def _start(self) -> None:
        """Start all processes and wait for the first."""
        self._pool = ProcessPoolExecutor(self._count, multiprocessing.get_context('spawn'), _begin, (os.getpid(),))
        try:
            with _spawning():
                started = [self._pool.submit(os.getpid) for _ in range(self._count)]
            started[0].result()
        except BrokenProcessPool:
            log.warning('a worker process ended while it started: trying again')
            raise


@contextlib.contextmanager
def local_workers(count: int) -> Iterator[LocalWorkers]:
    """Run tasks in `count` processes of this host, which end with the context and with this process, even if killed."""
    folder = tempfile.TemporaryDirectory(prefix='campaign-')
    with folder as scratch, contextlib.closing(LocalWorkers(count, scratch)) as workers:
        yield workers


@contextlib.contextmanager
def _spawning() -> Iterator[None]:
    """Set the environment of child processes, and leave SIGINT to this process and its script to this thread."""
    environment, main = dict(os.environ), sys.modules['__main__']
    with interrupts_blocked():
        try:
            os.environ.update(ENVIRONMENT)
            sys.modules['__main__'] = types.ModuleType('__main__')  # multiprocessing cannot import it from a file
            yield
        finally:
            sys.modules['__main__'] = main
            for name in ENVIRONMENT:
                del os.environ[name]
            os.environ.update(environment)


def _begin(parent: int) -> None:
    """End this process with its parent thread, and suppress the output of the physics."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.__stdout__.fileno() if sys.__stdout__ else 1)


# ---- a Dask cluster

CONNECT_TIMEOUT_S = 5
DASK_CONFIG = {'distributed.comm.timeouts.tcp': '15s'}  # longer than a trial blocks a host, shorter than a user waits
PACKAGES = ['numpy', 'numba']  # must be equal on all hosts for pickling of tasks and repeatable trials
COMPARED = ('python', 'dask', 'distributed', *PACKAGES)


class ClusterWorkers:
    """The workers of a Dask scheduler; Dask itself runs the tasks of a dead worker on others, a few times."""

    def __init__(self, client: Client) -> None:
        self._client, self._executor = client, client.get_executor(pure=False)
        self.lost: Tuple[Type[BaseException], ...] = (distributed.KilledWorker,)

    def submit(self, function: Callable[..., T], *arguments: Any) -> Future[T]:
        """Run a function on a worker."""
        return cast('Future[T]', self._executor.submit(function, *arguments))

    def count(self) -> int:
        """Return the number of threads of all workers, 0 without workers; CampaignFault if the scheduler is gone."""
        with contextlib.suppress(OSError):  # while a client reconnects, the scheduler has already dropped its tasks
            if self._client.status == 'running':
                return sum(self._client.nthreads().values())
        raise CampaignFault('the scheduler does not answer any more')

    def send(self, files: TrialFiles) -> Any:
        """Return the files as the result of a task, which Dask recomputes if its worker dies."""
        return self._client.submit(TrialFiles._make, files, pure=False)


# Both have `lost`, which the future of a task raises if its worker died, and send the files of trials as an argument of
# tasks that becomes TrialFiles on the worker.
Workers = Union[LocalWorkers, ClusterWorkers]


@contextlib.contextmanager
def connected_workers(address: str) -> Iterator[ClusterWorkers]:
    """Connect to a scheduler, such as tcp://host:8786, with Dask's TLS settings; ConfigError if versions differ."""
    try:
        importlib.import_module('distributed')  # a later import would reset its log levels
    except ModuleNotFoundError as error:
        allowed = 'pip install dask distributed, as the extra [cluster] does; or no --scheduler: the cores of this host'
        raise MissingLibrary(f'--scheduler: needs Dask: {error.name} is not installed; allowed: {allowed}') from None
    for name in ('distributed', 'distributed.client', 'tornado', 'tornado.application', 'asyncio'):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # a campaign reports problems in one line
    security = distributed.Security()
    with dask.config.set(DASK_CONFIG), warnings.catch_warnings():
        warnings.simplefilter('ignore')  # about versions, which are checked here
        try:  # before creating a Client, which fails late and with many lines
            asyncio.run(asyncio.wait_for(_identify(address, security), CONNECT_TIMEOUT_S))
        except Exception as error:  # many types, depending on address and server
            reason = in_one_line(error) if str(error) else f'no answer within {CONNECT_TIMEOUT_S} s'
            raise ConfigError(
                f'--scheduler: given {address!r}: {reason}; allowed: the address of a running Dask scheduler, such as '
                f'tcp://127.0.0.1:8786, or tls://127.0.0.1:8786 with certificates of Dask (docs/campaigns.md)'
            ) from None
        with distributed.Client(address, timeout=CONNECT_TIMEOUT_S, security=security, set_as_default=False) as client:
            versions = cast('Dict[str, Any]', client.get_versions(check=False, packages=PACKAGES))
            for name, there in {f'scheduler {address}': versions['scheduler'], **versions['workers']}.items():
                check_versions(there, versions['client'], name)
            threads = client.nthreads().values()
            if not threads:
                log.warning('%s has no workers yet; waiting for one', address)
            if any(count > 1 for count in threads):
                text = '%s has workers of several threads, which run one trial at a time: start more, with --nthreads 1'
                log.warning(text, address)
            yield ClusterWorkers(client)


async def _identify(address: str, security: Security) -> None:
    connection_args = security.get_connection_args('client')
    async with distributed.rpc(address, timeout=CONNECT_TIMEOUT_S, connection_args=connection_args) as scheduler:
        await scheduler.identity()


def check_versions(there: Dict[str, Any], here: Dict[str, Any], name: str) -> None:
    """Check that a scheduler or worker has the versions of this process, as Dask reports them; else ConfigError."""
    for package in COMPARED:
        parts = 2 if package == 'python' else None  # of 3.11.2.final.0 only 3.11 matters
        found, own = ('.'.join(str(each['packages'].get(package)).split('.')[:parts]) for each in (there, here))
        if found != own:
            allowed = 'the same versions on all hosts'
            raise ConfigError(f'--scheduler: {package} is {found} on {name}, {own} here; allowed: {allowed}')
