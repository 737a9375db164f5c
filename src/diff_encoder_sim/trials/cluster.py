"""The workers that a campaign runs on: processes of this host, or a Dask cluster by address."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, Dict, Iterator, NamedTuple, Optional, cast

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import ConfigError, in_one_line
from diff_encoder_sim.trials.dask_settings import DASK_CONFIG, silence_dask

if TYPE_CHECKING:
    from distributed import Client
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
