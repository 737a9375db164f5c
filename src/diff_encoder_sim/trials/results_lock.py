"""The lock by which one process at a time writes into a results folder."""

from __future__ import annotations

import fcntl
import io
import logging
from pathlib import Path

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.results_layout import LOCK

log = logging.getLogger(__name__)


def locked(folder: Path) -> io.FileIO:
    """Lock a folder until the returned file is closed, or this process ends in whatever way.

    Raises:
        ConfigError: another process has locked it.
        OSError: the lock's file cannot be made.
    """
    file = io.FileIO(str(folder / LOCK), 'ab')
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        raise ConfigError(f'{folder}: another campaign is writing here; allowed: one at a time') from None
    except OSError as error:
        log.warning(
            '%s: this file system has no locks (%s): do not start a second campaign with this folder',
            folder,
            error.strerror,
        )
    return file
