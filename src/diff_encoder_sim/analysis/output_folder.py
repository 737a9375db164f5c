"""Writes the output folder of an analysis: all of it or nothing, and only over an earlier analysis."""

from __future__ import annotations

import contextlib
import os
import shutil
import uuid
from pathlib import Path
from typing import Iterator

from diff_encoder_sim.base.errors import ConfigError

REPORT = 'report.html'

# Lists the files that analyze wrote, one a line; a folder with other files is not replaced.
CONTENTS = '.analysis'


@contextlib.contextmanager
def output_folder(path: Path) -> Iterator[Path]:
    """Yield a folder to write into, which replaces `path` when the context ends without an error.

    Raises:
        ConfigError: `path` has something in it that analyze did not write, or cannot be written.
    """
    path = path.resolve()
    _check_replaceable(path)
    # Beside it, so that relative links stay right and one rename puts it in place.
    made = path.with_name(f'.{path.name}-{uuid.uuid4().hex[:8]}')
    missing = [parent for parent in made.parents if not parent.exists()]
    try:
        with _named_errors(path):
            made.mkdir(parents=True)
            yield made
            names = sorted(str(file.relative_to(made)) for file in made.rglob('*'))
            (made / CONTENTS).write_text('\n'.join(names), encoding='utf-8')
            _replace(path, made)
    finally:
        shutil.rmtree(str(made), ignore_errors=True)  # moved by now, unless there was an error
        with contextlib.suppress(OSError):  # likewise: the first that is not empty stays
            for parent in missing:
                parent.rmdir()


def _check_replaceable(path: Path) -> None:
    with _named_errors(path):
        if path.exists() and not path.is_dir():
            raise ConfigError(f'{path}: not a folder; expected a new or empty one')
        contents = path / CONTENTS
        ours = contents.read_text(encoding='utf-8').split('\n') if contents.is_file() else []
        known = {CONTENTS, *ours}
        # The first is enough: the path may be a whole home folder.
        other = next(
            (name for name in (str(file.relative_to(path)) for file in path.rglob('*')) if name not in known), None
        )
    if other is not None:
        raise ConfigError(
            f'{path}: holds {other!r}, which analyze did not write; expected '
            f'a new or empty folder, or an earlier analysis: --out names another'
        )


def _replace(path: Path, made: Path) -> None:
    old = made.with_name(f'{made.name}-old')
    if path.exists():
        os.rename(str(path), str(old))
    os.rename(str(made), str(path))
    shutil.rmtree(str(old), ignore_errors=True)


@contextlib.contextmanager
def _named_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ConfigError(f'{path}: cannot be written: {error.strerror or error}') from None
