"""Opening a bag, with what is wrong with it in one line."""
from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Iterator, Union

from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.rosbag1 import ReaderError

from diff_encoder_sim.errors import ConfigError


@contextlib.contextmanager
def open_bag(path: Union[str, Path]) -> Iterator[AnyReader]:
    """A bag to read from.

    Raises:
        ConfigError: it is missing, or no readable bag.
    """
    path = Path(path)
    if not path.exists():
        raise ConfigError(f'{path}: no such bag')
    try:
        with AnyReader([path]) as reader:
            yield reader
    except (AnyReaderError, ReaderError, EOFError) as error:
        raise ConfigError(f'{path}: not a readable bag: {error}') from None
