"""How this package uses Dask, in each of its processes."""

from __future__ import annotations

import logging
from typing import Any

from distributed import Scheduler, Worker

LOOPBACK = '127.0.0.1'
# Longer than any trial keeps a worker's host from answering, shorter than a user waits.
LOST_PEER_TIMEOUT = '15s'
DASK_CONFIG = {
    'distributed.comm.timeouts.tcp': LOST_PEER_TIMEOUT,
    'distributed.scheduler.http.routes': [],
    'distributed.worker.http.routes': [],
}


class PrivateScheduler(Scheduler):
    """A scheduler without an HTTP server: that has no keys, and every user of the host could read it."""

    def start_http_server(self, *_: Any, **__: Any) -> None:
        """Open no port."""


class PrivateWorker(Worker):
    """A worker without an HTTP server."""

    def start_http_server(self, *_: Any, **__: Any) -> None:
        """Open no port."""


def silence_dask() -> None:
    """Keep Dask's own log from the terminal: the engine reports what is a problem for the campaign, in one line."""
    for name in ('distributed', 'distributed.client', 'tornado', 'tornado.application', 'asyncio'):
        logging.getLogger(name).setLevel(logging.CRITICAL)
