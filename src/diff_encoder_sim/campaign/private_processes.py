"""Processes of Dask that open no port to strangers. Importing this module imports Dask."""

from __future__ import annotations

from typing import Any

from distributed import Scheduler, Worker


class PrivateScheduler(Scheduler):
    """A scheduler without an HTTP server: that has no keys, and every user of the host could read it."""

    def start_http_server(self, *_: Any, **__: Any) -> None:
        """Open no port."""


class PrivateWorker(Worker):
    """A worker without an HTTP server."""

    def start_http_server(self, *_: Any, **__: Any) -> None:
        """Open no port."""
