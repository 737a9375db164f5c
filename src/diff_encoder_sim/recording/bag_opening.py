"""Opening a bag, with what is wrong with it in one line."""

from __future__ import annotations

import contextlib
import struct
from pathlib import Path
from typing import Iterator, Union

from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.rosbag1 import ReaderError
from rosbags.typesys import TypesysError

from diff_encoder_sim.base.errors import ConfigError, in_one_line

# What rosbags and its decompressors raise where bytes of a bag have changed.
DAMAGE = (TypesysError, OSError, RuntimeError, ValueError, LookupError, AssertionError, struct.error, MemoryError)


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
        with contextlib.ExitStack() as opened:
            with naming_damage(path):
                reader = opened.enter_context(AnyReader([path]))
            yield reader
    except (AnyReaderError, ReaderError, EOFError) as error:
        raise ConfigError(f'{path}: not a readable bag: {in_one_line(error)}') from None


@contextlib.contextmanager
def naming_damage(path: Path) -> Iterator[None]:
    """While messages are read: one line about a bag of which bytes have changed.

    Raises:
        ConfigError: in place of what rosbags raises.
    """
    try:
        yield
    except ConfigError:
        raise
    except DAMAGE as error:
        said = ' '.join(str(error).split())
        raise ConfigError(
            f'{path}: a damaged bag: {type(error).__name__} {said}; expected it as it was recorded'
        ) from None
