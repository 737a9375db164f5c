"""The bag of a live trial: messages as they come, each with its publisher's description."""

from __future__ import annotations

import contextlib
from functools import partial
from pathlib import Path
from typing import Any, Dict, Mapping, Tuple

import lz4.frame
from rosbags.rosbag1.writer import WriteChunk

from diff_encoder_sim.drives.ros1_writer import Ros1Writer, record_header


class RecordedBag(Ros1Writer):
    """A ROS 1 bag compressed by LZ4, as rosbag's library writes it in a fifth of the time; not thread-safe."""

    def __init__(self, path: Path) -> None:
        """Open a file, which may be there from a recorder that was killed.

        Raises:
            OSError: it cannot be made.
        """
        with contextlib.suppress(FileNotFoundError):
            path.unlink()
        super().__init__(path)
        self.set_compression(self.CompressionFormat.LZ4)
        # rosbag reads only frames as it writes them itself.
        self.compressor = partial(lz4.frame.compress, block_linked=False, store_size=False, content_checksum=True)
        self.open()
        self._publishers: Dict[Tuple[str, ...], Tuple[int, bytes]] = {}

    def record(self, topic: str, publisher: Mapping[str, str], time_ns: int, content: bytes) -> None:
        """Write a serialized message; `publisher` is the header of its connection.

        Raises:
            OSError: the file cannot be written.
        """
        key = (topic, publisher['md5sum'], publisher.get('callerid', ''), publisher.get('latching', '0'))
        known = self._publishers.get(key)
        if known is None:
            known = self._publishers[key] = self._advertise(topic, publisher)
        self.write_message(*known, time_ns, content)

    def _advertise(self, topic: str, publisher: Mapping[str, str]) -> Tuple[int, bytes]:
        connection = self.add_connection(
            topic,
            publisher['type'].replace('/', '/msg/'),  # as rosbags spells it
            msgdef=publisher['message_definition'],
            md5sum=publisher['md5sum'],
            callerid=publisher.get('callerid'),
            latching=int(publisher.get('latching', '0')),
        )
        return connection.id, record_header(connection.id)

    def write_chunk(self, chunk: WriteChunk) -> None:
        """Write a chunk whose index is in the order of time, also where time was reset."""
        for places in chunk.connections.values():
            places.sort()
        super().write_chunk(chunk)

    def abandon(self) -> None:
        """Close the file as it is."""
        bio: Any = self.bio
        if bio is not None:
            bio.close()
