"""A worker process of this host: what local_workers starts. It ends with the process that started it."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import socket
import threading
from typing import NamedTuple

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import in_one_line
from diff_encoder_sim.trials.dask_settings import DASK_CONFIG, LOOPBACK, silence_dask

dask = deferred('dask')
distributed = deferred('distributed')
private_processes = deferred('diff_encoder_sim.trials.private_processes')

STARTED = b'started'
STANDARD_INPUT = 0


class WorkerSettings(NamedTuple):
    """What a worker process is told, on its standard input, as one line of JSON."""

    scheduler: str  # address
    ca: str  # certificates and key as PEM
    cert: str
    key: str
    scratch: str  # a folder for temporary files, which are removed


def main() -> None:
    """Run a worker until it is killed; its parent reads whether it has started."""
    parent = socket.socket(fileno=STANDARD_INPUT)
    settings = WorkerSettings(**json.loads(parent.makefile().readline()))
    threading.Thread(target=_end_with, args=(parent, settings.scratch), daemon=True).start()
    silence_dask()
    dask.config.set(DASK_CONFIG)
    try:
        asyncio.run(_work(settings, parent))
    except Exception as error:  # of many kinds: no port, no memory, no disk
        parent.sendall(in_one_line(error).encode())


async def _work(settings: WorkerSettings, parent: socket.socket) -> None:
    security = distributed.Security(
        require_encryption=True, tls_ca_file=settings.ca, tls_worker_cert=settings.cert, tls_worker_key=settings.key
    )
    async with private_processes.PrivateWorker(
        settings.scheduler,
        host=LOOPBACK,
        security=security,
        nthreads=1,
        memory_limit=0,
        dashboard=False,
        local_directory=settings.scratch,
    ) as worker:
        parent.sendall(STARTED)
        await worker.finished()


def _end_with(parent: socket.socket, scratch: str) -> None:
    """End this process when its parent has ended, in whatever way."""
    parent.recv(1)  # returns when the other end is closed
    shutil.rmtree(scratch, ignore_errors=True)
    os._exit(1)
