"""A ROS 2 bag as `ros2 bag record` leaves it: a folder with metadata.yaml beside the files of the messages."""

from __future__ import annotations

import contextlib
import tempfile
from pathlib import Path
from typing import Collection, Iterator, List, NamedTuple, Sequence, Union

from diff_encoder_sim.base.errors import ConfigError, in_one_line
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.drives import mcap_records, sqlite3_stream
from diff_encoder_sim.drives.bag_messages import BagConnection, Message
from diff_encoder_sim.drives.bounded_decompression import BoundedSum, open_zstd
from diff_encoder_sim.drives.mcap_stream import McapStream
from diff_encoder_sim.drives.sqlite3_stream import Sqlite3Stream

METADATA = 'metadata.yaml'

# Of a file that is compressed as a whole, which is decompressed into a temporary folder [bytes].
LARGEST_FILE = 1 << 32
_PIECE = 1 << 20

FileStream = Union[McapStream, Sqlite3Stream]


class Ros2Folder:
    """The files of one bag, one after the other."""

    is_cdr = True

    def __init__(self, files: Sequence[FileStream]) -> None:
        self._files = files
        self.topics = {topic: kind for file in files for topic, kind in file.topics.items()}
        self.definitions = {kind: text for file in files for kind, text in file.definitions.items()}
        self.fault = self._faults()  # why not all of it can be read

    @property
    def connections(self) -> List[BagConnection]:
        """Return the topics in the order of the files."""
        return [BagConnection(*topic) for topic in self.topics.items()]

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages of some topics in the order of the files."""
        for file in self._files:
            yield from file.messages(topics)
        self.fault = self._faults()

    def _faults(self) -> str:
        return '; '.join(file.fault for file in self._files if file.fault)


def file_stream(path: Path, beginning: bytes, compression: str = '') -> FileStream:
    """Open a file of a ROS 2 bag by how it begins.

    Raises:
        InputFault: it cannot be read.
        ConfigError: it is neither MCAP nor SQLite.
    """
    if beginning.startswith(mcap_records.MAGIC):
        return McapStream(path)
    if beginning.startswith(sqlite3_stream.MAGIC):
        return Sqlite3Stream(path, compression)
    raise ConfigError(
        f'{path}: not a readable bag: neither of ROS 1 nor MCAP nor SQLite; '
        'expected a file of ROS 1, or a folder, .db3 or .mcap of ROS 2'
    )


@contextlib.contextmanager
def open_folder(folder: Path) -> Iterator[Ros2Folder]:
    """Open the files that metadata.yaml names, those next to it alone.

    Raises:
        ConfigError: there is no metadata.yaml, or a file is missing or cannot be read.
        InputFault: a file cannot be read.
    """
    with contextlib.ExitStack() as opened:
        about = _described(folder / METADATA)
        files = []
        for path in (folder / Path(name).name for name in about.names):
            whole = opened.enter_context(_decompressed(path)) if about.mode == 'file' else path
            files.append(file_stream(whole, beginning(whole), about.compression if about.mode == 'message' else ''))
        yield Ros2Folder(files)


def beginning(path: Path) -> bytes:
    """Return the first bytes of a file, by which its kind is known.

    Raises:
        ConfigError: it cannot be read.
    """
    try:
        with open(path, 'rb') as file:
            return file.read(64)
    except OSError as error:
        raise ConfigError(f'{path}: cannot be read: {error.strerror}') from None


@contextlib.contextmanager
def _decompressed(path: Path) -> Iterator[Path]:
    """Decompress a file into a temporary folder for as long as the context lasts."""
    with tempfile.TemporaryDirectory(prefix='diff_encoder_sim_') as folder:
        whole = Path(folder) / path.stem
        try:
            size, largest = 0, min(BoundedSum(path.stat().st_size).bound, LARGEST_FILE)
            with open(path, 'rb') as file, open(whole, 'wb') as out:
                content = open_zstd(file)
                while size <= largest:
                    piece = content.read(_PIECE)
                    if not piece:
                        break
                    size += out.write(piece)
        except Exception as error:  # zstd has its own, which differ by version
            raise ConfigError(f'{path}: cannot be decompressed: {in_one_line(error)}') from None
        if size > largest:
            allowed = f'at most {largest} bytes; ros2 bag convert can write it without compression'
            raise ConfigError(f'{path}: becomes larger than that; allowed: {allowed}')
        yield whole


class _Metadata(NamedTuple):
    """What is read of metadata.yaml."""

    names: List[str]
    mode: str  # what is compressed: 'file', 'message' or ''
    compression: str


def _described(path: Path) -> _Metadata:
    about = load_yaml(path).get('rosbag2_bagfile_information')
    names = about.get('relative_file_paths') if isinstance(about, dict) else None
    if not isinstance(about, dict) or not isinstance(names, list) or not names:
        raise ConfigError(f'{path}: not a readable bag: no relative_file_paths; expected what ros2 bag record writes')
    mode, compression = (str(about.get(f'compression_{key}') or '').lower() for key in ('mode', 'format'))
    mode = '' if mode == 'none' else mode
    if mode not in ('', 'file', 'message') or (mode and compression != 'zstd'):
        raise ConfigError(
            f'{path}: not a readable bag: compression {mode} {compression}; allowed: zstd of file or message'
        )
    return _Metadata([str(name) for name in names], mode, compression)
