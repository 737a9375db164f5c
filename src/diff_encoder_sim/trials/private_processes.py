"""Processes of Dask that open no port to other users and leave sys.path alone. Importing this module imports Dask."""

from __future__ import annotations

import sys
from typing import Any

from distributed import Scheduler, Worker


class _OwnPath:
    """Keep Dask's folder of temporary files, which it puts first, out of sys.path."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        path = list(sys.path)
        super().__init__(*arguments, **options)
        sys.path[:] = path


class PrivateScheduler(_OwnPath, Scheduler):
    """A scheduler without an HTTP server: that has no keys, and every user of the host could read it."""

    def start_http_server(self, *_: Any, **__: Any) -> None:
        """Open no port."""


class PrivateWorker(_OwnPath, Worker):
    """A worker without an HTTP server."""

    def start_http_server(self, *_: Any, **__: Any) -> None:
        """Open no port."""
