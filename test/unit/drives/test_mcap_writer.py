"""MCAP files: chunks as they are complete, little memory, and an index that says where everything is."""

import io
import tracemalloc

import pytest

from diff_encoder_sim.drives.mcap_stream import McapStream
from diff_encoder_sim.drives.mcap_writer import CHUNK_SIZE, McapWriter
from diff_encoder_sim.drives.message_types import CLOCK
from diff_encoder_sim.drives.sensor_messages import encode_clock
from diff_encoder_sim.drives.typestore import ros2_definition, to_cdr

MESSAGE = to_cdr(encode_clock(7), CLOCK)


def write(file, times_ns, topics=('/clock',), message=MESSAGE):
    writer = McapWriter(file)
    channels = [writer.add_channel(topic, CLOCK, ros2_definition(CLOCK).text, {}) for topic in topics]
    for index, time_ns in enumerate(times_ns):
        writer.write(channels[index % len(channels)], time_ns, message)
    writer.finish()
    return file


class Sink(io.BytesIO):
    """Counts, and keeps nothing."""

    size = 0

    def write(self, content):
        self.size += len(content)
        return len(content)

    def tell(self):
        return self.size


def test_the_index_leads_to_every_message(tmp_path):
    """By mcap's reader, which goes by the index: over a time range, in several chunks, of two topics."""
    from mcap.reader import make_reader

    file = write(io.BytesIO(), range(1, 50_001), ('/clock', '/other'))
    file.seek(0)
    summary = make_reader(file).get_summary()
    assert len(summary.chunk_indexes) > 2 and summary.statistics.channel_message_counts == {0: 25_000, 1: 25_000}
    assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (1, 50_000)
    found = [
        (channel.topic, message.log_time, message.sequence)
        for _, channel, message in make_reader(file).iter_messages(
            topics=['/other'], start_time=40_000, end_time=40_011
        )
    ]
    assert found == [('/other', time_ns, time_ns // 2) for time_ns in range(40_000, 40_011, 2)]


@pytest.mark.parametrize('count', [0, 1])
def test_few_messages_are_a_file_too(tmp_path, count):
    path = tmp_path / 'a.mcap'
    path.write_bytes(write(io.BytesIO(), range(1, count + 1)).getvalue())
    stream = McapStream(path)
    assert stream.topics == {'/clock': CLOCK} and stream.fault == ''
    assert [message[:3] for message in stream.messages(['/clock'])] == [('/clock', 1, MESSAGE)] * count


def test_memory_does_not_grow_with_the_file():
    tracemalloc.start()
    try:
        sink = write(Sink(), range(1, 30_001), message=bytes(1000))
        assert sink.size > 25 * CHUNK_SIZE and tracemalloc.get_traced_memory()[1] < 8 * CHUNK_SIZE
    finally:
        tracemalloc.stop()
