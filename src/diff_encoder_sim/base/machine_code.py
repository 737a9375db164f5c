"""Where the machine code of numba's kernels is kept.

numba keeps it in __pycache__ beside the source, else in the user's cache, and ends the program where it can write
neither. Here an installation that cannot be written is no fault: the code that it has is used, for somebody who may
write there has run a command; and more is kept in a folder of the user's own, or nowhere, which is said.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import shutil
import tempfile
from pathlib import Path
from typing import List, Optional

from diff_encoder_sim.base.own_folder import is_temporary, own_folder

FOLDER_VARIABLE = 'NUMBA_CACHE_DIR'
SAID_VARIABLE = 'DIFF_ENCODER_SIM_KERNELS_NOT_KEPT'  # of this process and those that it starts
PACKAGE = Path(os.path.abspath(__file__)).parents[1]

log = logging.getLogger(__name__)


def machine_code_folder() -> Optional[str]:
    """Return the folder that numba shall use: '' for the one that it selects itself, None for none at all."""
    given = os.environ.get(FOLDER_VARIABLE)
    if given and _can_be_written(Path(given)):
        return given
    if all(_can_be_written(room / '__pycache__') for room in _rooms()):
        return ''
    own = own_folder()
    if own is not None:
        with contextlib.suppress(OSError):  # a full disk
            return str(_copy_of_code(own))
    say_once(
        "%s, the user's cache and the folder for temporary files cannot be written (TMPDIR names another): "
        'each process compiles the kernels anew, which takes it half a minute',
        PACKAGE,
    )
    return None


def say_once(reason: str, *arguments: object) -> None:
    """Warn that machine code is not kept: once, not for each kernel, nor by each worker that this process starts."""
    if os.environ.get(SAID_VARIABLE) is None:
        os.environ[SAID_VARIABLE] = 'yes'
        log.warning(reason, *arguments)


def _rooms() -> List[Path]:
    return [path.parent for path in PACKAGE.glob('*/__init__.py')]


def _can_be_written(folder: Path) -> bool:
    there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    return os.access(str(there), os.W_OK | os.X_OK)


def _copy_of_code(own: Path) -> Path:
    """Return a folder below the user's own one that has begun as a copy of the installation's machine code.

    Its name changes with what the installation has. It is made under another name, as two processes may begin at once.

    Raises:
        OSError: it cannot be made.
    """
    files = sorted(file for room in _rooms() for file in (room / '__pycache__').glob('*.nb[ci]'))
    state = [str(PACKAGE), *(f'{file.name} {file.stat().st_mtime_ns}' for file in files)]
    folder = own / f'kernels-{hashlib.sha256(" ".join(state).encode()).hexdigest()[:16]}'
    if folder.is_dir():
        return folder
    unfinished = Path(tempfile.mkdtemp(dir=str(own)))
    for file in files:
        target = unfinished / _numbas_name(file.parents[1])
        target.mkdir(exist_ok=True)
        shutil.copyfile(str(file), str(target / file.name))
    try:
        unfinished.rename(folder)
    except OSError:
        shutil.rmtree(str(unfinished))
        if not folder.is_dir():
            raise
    else:
        _say_where(folder)
    return folder


def _numbas_name(room: Path) -> str:
    """Return the name of the folder in NUMBA_CACHE_DIR where numba looks for the code of a folder's modules."""
    return f'{room.name}_{hashlib.sha1(str(room).encode()).hexdigest()}'


def _say_where(folder: Path) -> None:
    if is_temporary(folder.parent):
        log.warning("%s and the user's cache cannot be written: compiled kernels are kept in %s", PACKAGE, folder)
