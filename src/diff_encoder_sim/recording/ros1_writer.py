"""rosbags' writer of ROS 1 bags, with the records of messages made in one piece: a trial has hundreds a second."""

from __future__ import annotations

import struct

from rosbags.rosbag1 import Writer

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND

# The format's http://wiki.ros.org/Bags/Format/2.0: a header of fields, each after its length, then the data.
_OP, _CONN, _TIME = b'op=\x02', b'conn=', b'time='
_HEADER = struct.Struct(f'<II{len(_OP)}sI{len(_CONN)}sII{len(_TIME)}s')
_NUMBER, _TIME_SIZE = 4, 8
_FIELDS = _HEADER.size - _NUMBER + _TIME_SIZE
_TIME_AND_LENGTH = struct.Struct('<3I')


def record_header(connection_id: int) -> bytes:
    """Return how the records of a connection's messages begin: all up to the time."""
    conn, time = len(_CONN) + _NUMBER, len(_TIME) + _TIME_SIZE
    return _HEADER.pack(_FIELDS, len(_OP), _OP, conn, _CONN, connection_id, time, _TIME)


class Ros1Writer(Writer):
    """Writes the same bytes as rosbags' own."""

    def write_message(self, connection_id: int, header: bytes, time_ns: int, message: bytes) -> None:
        """Write a message of a connection; its header is that of `record_header`."""
        chunk = self.chunks[-1]
        place = chunk.data.tell()
        chunk.connections[connection_id].append((time_ns, place))
        chunk.start = min(chunk.start, time_ns)
        chunk.end = max(chunk.end, time_ns)
        seconds, nanoseconds = divmod(time_ns, NANOSECONDS_PER_SECOND)
        record = header + _TIME_AND_LENGTH.pack(seconds, nanoseconds, len(message)) + message
        chunk.data.write(record)
        if place + len(record) > self.chunk_threshold:
            self.write_chunk(chunk)
