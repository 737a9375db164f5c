"""Writes a trial's bag as rosbag record would from the nodes of a live trial."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from types import TracebackType
from typing import (
    Any,
    Callable,
    Dict,
    Hashable,
    Iterator,
    List,
    NamedTuple,
    Optional,
    Sequence,
    Tuple,
    Type,
    TypeVar,
    Union,
)

from diff_encoder_sim.base.atomic_files import UNFINISHED_SUFFIX
from diff_encoder_sim.drives.bag_files import OPENERS, BagFile, Prepared
from diff_encoder_sim.drives.topics import BagFormat, RecordMode, recorded_topics

T = TypeVar('T')


class CommonMessage(NamedTuple):
    """A message that is not yet encoded."""

    publisher: int  # index into `CommonMessages.publishers`
    time_ns: int
    seq: int  # of its publisher, from 1
    encode: Callable[..., bytes]  # returns it for ROS 1, by the values
    values: Tuple[Any, ...]


class CommonMessages:
    """Messages that wait to be written into several bags, in which others stand between them."""

    def __init__(self) -> None:
        self.publishers: List[Tuple[str, str]] = []  # topic and node
        self.messages: List[CommonMessage] = []
        self._made: Dict[Hashable, List[Any]] = {}

    def encoded(self) -> List[bytes]:
        """Return the messages, encoded for ROS 1."""
        return self.made('encoded', lambda first: [each.encode(*each.values) for each in self.messages[first:]])

    def made(self, key: Hashable, make: Callable[[int], List[T]]) -> List[T]:
        """Return what `make` makes of each message; it is called for the first one that has come since the last call.

        Those before are kept, by a key, until `clear`.
        """
        made: List[T] = self._made.setdefault(key, [])
        if len(made) < len(self.messages):
            made += make(len(made))
        return made

    def clear(self) -> None:
        """Remove the messages, which every bag has."""
        self.messages.clear()
        self._made.clear()


# The format has no message at time 0; a trial's first messages are recorded a nanosecond later.
EARLIEST_NS = 1

# So many messages wait to be encoded and written together. One by one, between steps of the physics, each finds the
# processor's caches without its code, and takes two to three times as long.
AT_ONCE = 1000

# How many common messages come before a message, its topic, node and time [ns], what encodes it, and its values.
_Waiting = Tuple[int, str, str, int, Callable[..., bytes], Tuple[Any, ...]]


class TrialBag:
    """A bag that is written in a with statement, after which the file has its name.

    When an exception ends the statement there is no file. Equal calls write equal bytes.
    """

    def __init__(self, path: Union[str, Path], mode: RecordMode, bag_format: BagFormat = 'ros1') -> None:
        """Prepare a bag that replaces a file of that name once it is whole; mode 'none' writes no file."""
        self._path = Path(path)
        self._unfinished = self._path.with_name(self._path.name + UNFINISHED_SUFFIX)
        self._topics = recorded_topics(mode)
        self._open = OPENERS[bag_format]
        self._publishers: Dict[Tuple[str, str], int] = {}  # by topic and node
        self._waiting: List[_Waiting] = []
        self._common = CommonMessages()  # none, as long as nobody shares any
        self._common_written = 0
        self._file: Optional[BagFile] = None

    def wants(self, topic: str) -> bool:
        """Return whether the mode records a topic, so that its message need not be made otherwise."""
        return topic in self._topics

    def publish(self, topic: str, node: str, time_ns: int, encode: Callable[..., bytes], *values: Any) -> None:
        """Record a message as `write` does, but encode and write it later, together with others.

        Args:
            topic: its full name.
            node: its full name, as in `topics.TOPICS`.
            time_ns: of the simulated clock, not before the time of the message before.
            encode: returns the message of the values.
            values: which do not change any more.

        Raises:
            OSError: the file cannot be written; the error names the bag and keeps the errno.
            ValueError: the node does not publish a topic.
        """
        if topic in self._topics:
            self._waiting.append((len(self._common.messages), topic, node, time_ns, encode, values))
            if len(self._waiting) >= AT_ONCE:
                self.write_waiting()

    def share(self, common: CommonMessages) -> None:
        """Record, from the first of them, messages that other bags have too, among those that are published here.

        Each of their publishers has published a message here before. See `TrialBags`.
        """
        self._common, self._common_written = common, 0

    def write_waiting(self) -> None:
        """Write what was published up to now.

        Raises:
            OSError: the file cannot be written; the error names the bag and keeps the errno.
            ValueError: a node does not publish its topic.
        """
        with self._naming_errors():
            self._write_waiting()

    def _write_waiting(self) -> None:
        waiting, self._waiting = self._waiting, []
        prepared: List[Prepared] = []
        for place, topic, node, time_ns, encode, values in waiting:
            if place != self._common_written:
                prepared += self._common_before(place)
            publisher = self._publishers.get((topic, node))
            if publisher is None:  # its description goes between messages
                self._write(prepared)
                publisher, prepared = self._advertise(topic, node), []
            prepared.append(self._opened().prepare(publisher, max(time_ns, EARLIEST_NS), encode(*values)))
        prepared += self._common_before(len(self._common.messages))
        self._write(prepared)

    def _common_before(self, place: int) -> Sequence[Prepared]:
        """Return the common messages before a place that are not written yet."""
        begin, self._common_written = self._common_written, place
        if begin == place:
            return ()
        publishers = tuple([self._publishers[publisher] for publisher in self._common.publishers])
        made = self._common.made((self._open, publishers), lambda first: self._prepare_common(publishers, first))
        return made[begin:place]

    def _prepare_common(self, publishers: Tuple[int, ...], first: int) -> List[Prepared]:
        prepare, common = self._opened().prepare, self._common
        return [
            prepare(publishers[message.publisher], message.time_ns, encoded, message.seq)
            for message, encoded in zip(common.messages[first:], common.encoded()[first:])
        ]

    def _write(self, messages: Sequence[Prepared]) -> None:
        if messages:
            self._opened().write(messages)

    def write(self, topic: str, node: str, message: bytes, time_ns: int) -> None:
        """Record a message as `node` publishes it at `time_ns`, if the mode records the topic.

        Args:
            topic: its full name.
            node: its full name, as in `topics.TOPICS`.
            message: serialized; the seq of a leading header is filled in, from 1.
            time_ns: of the simulated clock, not before the time of the message before.

        Raises:
            OSError: the file cannot be written; the error names the bag and keeps the errno.
            ValueError: the node does not publish the topic.
        """
        if topic in self._topics:
            with self._naming_errors():
                self._write_waiting()
                publisher = self._publishers.get((topic, node))
                if publisher is None:
                    publisher = self._advertise(topic, node)
                self._write([self._opened().prepare(publisher, max(time_ns, EARLIEST_NS), message)])

    def _advertise(self, topic: str, node: str) -> int:
        recorded = self._topics[topic]
        if node not in recorded.nodes:
            raise ValueError(f'{node} does not publish {topic}; expected one of {recorded.nodes}')
        publisher = self._publishers[topic, node] = self._opened().add_publisher(recorded, node)
        return publisher

    def _opened(self) -> BagFile:
        if self._file is None:
            raise ValueError(f'{self._path}: not open; expected to be used in a with statement')
        return self._file

    def __enter__(self) -> TrialBag:
        """Open the file under its unfinished name.

        Raises:
            OSError: the file cannot be made; the error names the bag and keeps the errno.
        """
        if not self._topics:
            return self
        try:
            with self._naming_errors():
                self._path.parent.mkdir(parents=True, exist_ok=True)
                with contextlib.suppress(FileNotFoundError):
                    self._unfinished.unlink()  # of a process that was killed
                self._file = self._open(self._unfinished)
        except OSError:
            self._discard()
            raise
        return self

    def __exit__(
        self, error_type: Optional[Type[BaseException]], _: Optional[BaseException], __: Optional[TracebackType]
    ) -> None:
        if self._file is None:
            return
        if error_type is not None:
            self._discard()
            return
        try:
            with self._naming_errors():
                self._write_waiting()
                self._file.close()
                os.replace(str(self._unfinished), str(self._path))
        except BaseException:  # an interrupt, for one
            self._discard()
            raise

    def _discard(self) -> None:
        # Closing writes what is buffered, and on a full disk fails once more.
        with contextlib.suppress(OSError):
            if self._file is not None:
                self._file.abandon()
        with contextlib.suppress(OSError):
            self._unfinished.unlink()

    @contextlib.contextmanager
    def _naming_errors(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise OSError(error.errno, f'bag cannot be written: {error.strerror}', str(self._path)) from None


class TrialBags:
    """Publishes a message into each of some bags that record the same topics, as into one.

    Its publishers publish by it alone.
    """

    def __init__(self, bags: Sequence[TrialBag]) -> None:
        self._bags, self._common = bags, CommonMessages()
        self._numbers: Dict[Tuple[str, str], int] = {}  # of publishers, by topic and node
        self._seqs: Dict[int, int] = {}  # newest, by publisher
        for bag in bags:
            bag.share(self._common)

    def wants(self, topic: str) -> bool:
        """Return whether the bags record a topic."""
        return self._bags[0].wants(topic)

    def publish(self, topic: str, node: str, time_ns: int, encode: Callable[..., bytes], *values: Any) -> None:
        """Record a message in each bag; see `TrialBag`. It is encoded once."""
        if not self.wants(topic):
            return
        publisher = self._numbers.get((topic, node))
        if publisher is None:
            self._begin_publisher(topic, node, time_ns, encode(*values))
            return
        seq = self._seqs[publisher] = self._seqs[publisher] + 1
        self._common.messages.append(CommonMessage(publisher, max(time_ns, EARLIEST_NS), seq, encode, values))
        if len(self._common.messages) >= AT_ONCE:
            self._write_waiting()

    def _begin_publisher(self, topic: str, node: str, time_ns: int, message: bytes) -> None:
        """Publish its first message, before which its description goes, into each bag."""
        self._write_waiting()
        number = self._numbers[topic, node] = len(self._common.publishers)
        self._common.publishers.append((topic, node))
        self._seqs[number] = 1
        for bag in self._bags:
            bag.publish(topic, node, time_ns, bytes, message)

    def _write_waiting(self) -> None:
        for bag in self._bags:
            bag.write_waiting()
        self._common.clear()
        for bag in self._bags:
            bag.share(self._common)
