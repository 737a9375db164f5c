"""Opens bags of every kind as streams of messages, and finds them in folders."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Iterator, List, Union

from diff_encoder_sim.base.errors import ConfigError, InputFault, in_one_line
from diff_encoder_sim.drives.ros1_stream import MAGIC, Ros1Stream
from diff_encoder_sim.drives.ros2_stream import METADATA, Ros2Stream, open_file, open_folder

__all__ = ['BagSource', 'bags_in', 'is_bag_folder', 'open_source']

BagSource = Union[Ros1Stream, Ros2Stream]

_SUFFIXES = ('.bag', '.mcap', '.db3')


def is_bag_folder(path: Path) -> bool:
    """Return whether a folder is a bag of ROS 2."""
    return (path / METADATA).is_file()


def bags_in(folder: Path) -> List[Path]:
    """Return the bags in a folder and the folders in it: files of ROS 1, folders and files of ROS 2."""
    if is_bag_folder(folder):
        return [folder]
    found = [path.parent for path in folder.rglob(METADATA)]
    files = [path for path in folder.rglob('*') if path.suffix in _SUFFIXES and path.is_file()]
    return sorted([*found, *(path for path in files if path.parent not in found)])


@contextlib.contextmanager
def open_source(path: Path) -> Iterator[BagSource]:
    """Open a bag to stream from: a file of ROS 1, or a file or folder of ROS 2.

    Raises:
        ConfigError: it is missing, cannot be read, or has no message.
    """
    if not path.exists():
        raise ConfigError(f'{path}: no such bag')
    with contextlib.ExitStack() as opened:
        try:
            source = opened.enter_context(open_folder(path)) if path.is_dir() else _open_file(path)
        except (InputFault, OSError) as error:
            raise ConfigError(f'{path}: not a readable bag: {in_one_line(error)}') from None
        if not source.topics:
            raise ConfigError(f'{path}: no message in it{source.fault and f" ({source.fault})"}')
        yield source


def _open_file(path: Path) -> BagSource:
    with open(path, 'rb') as file:
        is_ros1 = file.read(len(MAGIC)) == MAGIC
    return Ros1Stream(path) if is_ros1 else Ros2Stream([open_file(path)])
