"""Reads the messages of a ROS 2 bag's SQLite database in the order of their recording."""

from __future__ import annotations

import contextlib
import sqlite3
import urllib.parse
from pathlib import Path
from typing import Any, Collection, Dict, Iterator, List

from diff_encoder_sim.base.errors import InputFault, in_one_line
from diff_encoder_sim.base.stamps import LATEST_NS
from diff_encoder_sim.drives.bag_messages import BagConnection, Message
from diff_encoder_sim.drives.bounded_decompression import LARGEST_CHUNK, BoundedSum

MAGIC = b'SQLite format 3\0'

_TABLES, _DEFINITIONS = {'topics', 'messages'}, 'message_definitions'


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
        self._size = path.stat().st_size
        self._uri = f'file:{urllib.parse.quote(str(path.resolve()))}?mode=ro&immutable=1'
        self._compression = compression
        self._topic_of: Dict[int, str] = {}  # by its number in the file
        self.topics: Dict[str, str] = {}  # types by topic
        self.definitions: Dict[str, str] = {}  # by type, as recorded; older recorders leave them out
        self.fault = ''  # why not all of it can be read
        try:
            # Of views and virtual tables, the content is computed: a small file could have any number of messages.
            query = "SELECT name FROM sqlite_master WHERE type = 'table' AND sql NOT LIKE 'CREATE VIRTUAL%'"
            tables = {name for (name,) in self._rows(query)}
            if not tables >= _TABLES:
                raise InputFault(f'tables {sorted(tables)}; expected {sorted(_TABLES)}')
            for table in sorted(tables & {*_TABLES, _DEFINITIONS}):
                self._check_columns(table)
            query = "SELECT id, name, type, serialization_format FROM topics WHERE typeof(id) = 'integer' ORDER BY id"
            for number, topic, kind, encoding in self._rows(query):
                if encoding == 'cdr':
                    self._topic_of[number] = str(topic)
                    self.topics.setdefault(str(topic), str(kind))
            if _DEFINITIONS in tables:
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
        wanted = ', '.join(str(number) for number, topic in self._topic_of.items() if topic in topics)
        # SQLite returns numbers where blobs are expected, and a blob of zeros takes no place in the file.
        query = (
            "SELECT topic_id, timestamp, CASE WHEN typeof(data) = 'blob' AND "
            f"length(data) <= {LARGEST_CHUNK} AND typeof(timestamp) = 'integer' AND timestamp >= 0 AND "
            f'timestamp < {LATEST_NS} THEN data END FROM messages WHERE topic_id IN ({wanted}) ORDER BY timestamp, id'
        )
        total, left = BoundedSum(self._size), self._size
        try:
            for number, time_ns, data in self._rows(query):
                topic = self._topic_of[number]
                left -= 1 + len(data or b'')
                try:
                    if data is None:
                        raise InputFault(f'has no time before 2^32 s, or no blob of at most {LARGEST_CHUNK} bytes')
                    content = total.decompressed(self._compression, data)
                except InputFault as fault:
                    self.fault = f'damaged: a message on {topic} {fault}'
                    continue
                if left < 0:  # damaged pages may refer to each other in circles
                    raise InputFault('has more messages than its size allows')
                yield Message(topic, time_ns, content)
        except (sqlite3.Error, UnicodeError, InputFault) as error:
            self.fault = f'damaged: {in_one_line(error)}'

    def _check_columns(self, table: str) -> None:
        """Refuse columns whose values are computed.

        Raises:
            InputFault: the table has one.
        """
        generated = [name for _, name, _, _, _, _, hidden in self._rows(f'PRAGMA table_xinfo({table})') if hidden]
        if generated:
            raise InputFault(f'table {table}: generated columns {", ".join(generated)}; expected none')

    def _rows(self, query: str) -> Iterator[Any]:
        with contextlib.closing(sqlite3.connect(self._uri, uri=True)) as database:
            yield from database.execute(query)
