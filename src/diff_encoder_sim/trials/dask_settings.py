"""How this package uses Dask, in each of its processes."""

from __future__ import annotations

import importlib
import logging

LOOPBACK = '127.0.0.1'
# Longer than any trial keeps a worker's host from answering, shorter than a user waits.
LOST_PEER_TIMEOUT = '15s'
DASK_CONFIG = {
    'distributed.comm.timeouts.tcp': LOST_PEER_TIMEOUT,
    'distributed.scheduler.http.routes': [],
    'distributed.worker.http.routes': [],
    # It samples what trials do a hundred times a second, and keeps that for an hour.
    'distributed.worker.profile.enabled': False,
}


def silence_dask() -> None:
    """Keep Dask's own log from the terminal: the engine reports what is a problem for the campaign, in one line."""
    # Imported later, Dask would set its log's levels anew, and lose defaults where our settings are undone.
    importlib.import_module('distributed')
    for name in ('distributed', 'distributed.client', 'tornado', 'tornado.application', 'asyncio'):
        logging.getLogger(name).setLevel(logging.CRITICAL)
