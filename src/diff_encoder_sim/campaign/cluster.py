"""The workers that a campaign runs on: processes of this host, or a Dask cluster by address."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import warnings
from typing import Any, Dict, Iterator, cast

import dask
from distributed import Client, LocalCluster, rpc
from distributed.security import Security
from distributed.versions import get_versions

from diff_encoder_sim.base.errors import ConfigError

log = logging.getLogger(__name__)

CONNECT_TIMEOUT_S = 5
# Longer than any trial keeps a worker's host from answering, shorter than a user waits.
LOST_PEER_TIMEOUT = '15s'
DASK_CONFIG = {'distributed.comm.timeouts.tcp': LOST_PEER_TIMEOUT}

# What must be equal everywhere for tasks to be understood, and for trials to be repeatable.
PACKAGES = ['numpy', 'numba']
COMPARED = ('python', 'dask', 'distributed', *PACKAGES)


@contextlib.contextmanager
def local_client(workers: int) -> Iterator[Client]:
    """Start `workers` processes on loopback, one thread each; they end with the context.

    BLAS has one thread in each: Dask's nannies see to that. The workers end by themselves when
    this process is killed.
    """
    _silence()
    with dask.config.set(DASK_CONFIG), _interrupts_stay_here():
        cluster = LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            host='127.0.0.1',
            dashboard_address=None,
            memory_limit=0,
            silence_logs=logging.CRITICAL,
        )
    try:
        with Client(cluster, set_as_default=False) as client:
            try:
                yield client
            finally:
                _kill_workers(cluster)
    finally:
        cluster.close()


@contextlib.contextmanager
def connected_client(address: str) -> Iterator[Client]:
    """Connect to a running scheduler, such as tcp://host:8786.

    Raises:
        ConfigError: no scheduler answers there, or its versions of Python or of libraries differ.
    """
    _silence()
    with dask.config.set(DASK_CONFIG), warnings.catch_warnings():
        warnings.simplefilter('ignore')  # about versions, which are checked here
        _check_scheduler(address)
        with Client(address, timeout=CONNECT_TIMEOUT_S, set_as_default=False) as client:
            _check_workers(client, address)
            yield client


def _check_scheduler(address: str) -> None:
    # Before a Client is made: of one that cannot connect the end is long and loud.
    try:
        versions = asyncio.run(asyncio.wait_for(_scheduler_versions(address), CONNECT_TIMEOUT_S))
    except Exception as error:  # many kinds, by address and by what answers there
        reason = str(error) or f'no answer within {CONNECT_TIMEOUT_S} s'
        raise ConfigError(
            f'--scheduler: given {address!r}: {reason}; allowed: the address of a '
            f'running Dask scheduler, such as tcp://127.0.0.1:8786'
        ) from None
    check_versions(versions, f'scheduler {address}')


async def _scheduler_versions(address: str) -> Dict[str, Any]:
    security = Security().get_connection_args('client')  # from Dask's own configuration
    async with rpc(address, timeout=CONNECT_TIMEOUT_S, connection_args=security) as scheduler:
        versions: Dict[str, Any] = await scheduler.versions(packages=PACKAGES)
        return versions


def check_versions(versions: Dict[str, Any], name: str) -> None:
    """Check that a peer has the versions that this process has.

    Raises:
        ConfigError: one differs.
    """
    here = _compared(get_versions(packages=PACKAGES))
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


def _kill_workers(cluster: LocalCluster) -> None:
    """Kill the workers: asked to close, they would finish their trials first."""
    for nanny in cluster.workers.values():
        nanny.auto_restart = False
        with contextlib.suppress(ProcessLookupError, TypeError):
            os.kill(nanny.pid, signal.SIGKILL)


@contextlib.contextmanager
def _interrupts_stay_here() -> Iterator[None]:
    """Keep Ctrl-C, which goes to all processes of a terminal, from the ones that are started.

    Threads that begin in this context, and the processes that they start at any time, have SIGINT
    blocked: this process stops them.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _silence() -> None:
    # The engine reports what is a problem for the campaign, in one line.
    for name in ('distributed', 'distributed.client', 'tornado', 'asyncio'):
        logging.getLogger(name).setLevel(logging.CRITICAL)
