"""Reads the messages of a ROS 2 bag's SQLite database in the order of their recording."""

from __future__ import annotations

import contextlib
import sqlite3
import urllib.parse
from pathlib import Path
from typing import Any, Collection, Dict, Iterator, List

from diff_encoder_sim.base.errors import InputFault, in_one_line
from diff_encoder_sim.serialization.bag_messages import BagConnection, Message
from diff_encoder_sim.serialization.bounded_decompression import LARGEST_CHUNK, decompressed

MAGIC = b'SQLite format 3\0'

_TABLES = {'topics', 'messages'}


class Sqlite3Stream:
    """The topics of a database, and its messages, as often as they are asked for."""

    is_cdr = True

    def __init__(self, path: Path, compression: str = '') -> None:
        """Read the topics.

        Args:
            path: of a file that begins with `MAGIC`.
            compression: of each message by itself, as for `decompressed`.

        Raises:
            InputFault: it cannot be read, or has other tables.
        """
        self._uri = f'file:{urllib.parse.quote(str(path.resolve()))}?mode=ro&immutable=1'
        self._compression = compression
        self.topics: Dict[str, str] = {}  # types by topic
        self.definitions: Dict[str, str] = {}  # by type, as recorded; older recorders leave them out
        self.fault = ''  # why not all of it can be read
        try:
            # Of views, the content is computed: a small file could have any number of messages.
            tables = {name for (name,) in self._rows("SELECT name FROM sqlite_master WHERE type = 'table'")}
            if not tables >= _TABLES:
                raise InputFault(f'tables {sorted(tables)}; expected {sorted(_TABLES)}')
            for topic, kind, encoding in self._rows('SELECT name, type, serialization_format FROM topics ORDER BY id'):
                if encoding == 'cdr':
                    self.topics.setdefault(str(topic), str(kind))
            if 'message_definitions' in tables:
                query = 'SELECT topic_type, encoded_message_definition FROM message_definitions'
                self.definitions = {str(kind): str(text) for kind, text in self._rows(query)}
        except (sqlite3.Error, UnicodeError) as error:
            raise InputFault(in_one_line(error)) from None

    @property
    def connections(self) -> List[BagConnection]:
        """Return the topics in the order of the file."""
        return [BagConnection(*topic) for topic in self.topics.items()]

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Yield the messages of some topics by their time of recording, as far as they can be read."""
        wanted = [topic for topic in self.topics if topic in topics]
        marks = ', '.join('?' for _ in wanted)
        # A column, too, may be computed, and a blob that is nothing but zeros takes no place in the file.
        data = f'CASE WHEN length(data) <= {LARGEST_CHUNK} THEN data END'
        query = (
            f'SELECT name, timestamp, {data} FROM messages JOIN topics ON topic_id = topics.id '
            f'WHERE name IN ({marks}) ORDER BY timestamp, messages.id'
        )
        try:
            for topic, time_ns, data in self._rows(query, *wanted):
                if data is None:
                    raise InputFault(f'a message on {topic} has more than {LARGEST_CHUNK} bytes')
                yield Message(topic, int(time_ns), decompressed(self._compression, bytes(data)))
        except (sqlite3.Error, UnicodeError, ValueError, TypeError) as error:
            self.fault = f'damaged: {in_one_line(error)}'

    def _rows(self, query: str, *values: str) -> Iterator[Any]:
        with contextlib.closing(sqlite3.connect(self._uri, uri=True)) as database:
            yield from database.execute(query, values)
