"""Writes a trial's bag as rosbag record would from the nodes of a live trial."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Optional, Tuple, Type, Union

from diff_encoder_sim.base.atomic_files import UNFINISHED_SUFFIX
from diff_encoder_sim.drives.bag_files import OPENERS, BagFile, Prepared
from diff_encoder_sim.drives.topics import BagFormat, RecordMode, recorded_topics

EARLIEST_NS = 1  # the format has no message at time 0; a trial's first messages are recorded a nanosecond later

AT_ONCE = 1000  # messages are encoded and written together: one by one takes two to three times as long (caches)

_Waiting = Tuple[str, str, int, Callable[..., bytes], Tuple[Any, ...]]  # topic, node, time [ns], encoder, its values


class TrialBag:
    """A bag that is written in a with statement: equal bytes by equal calls, and no file after an exception."""

    def __init__(self, path: Union[str, Path], mode: RecordMode, bag_format: BagFormat = 'ros1') -> None:
        """Prepare a bag that replaces a file of that name once it is complete; mode 'none' writes no file."""
        self._path = Path(path)
        self._unfinished = Path(f'{path}{UNFINISHED_SUFFIX}')
        self._topics = recorded_topics(mode)
        self._open = OPENERS[bag_format]
        self._publishers: Dict[Tuple[str, str], int] = {}  # by topic and node
        self._waiting: List[_Waiting] = []
        self._file: Optional[BagFile] = None

    def wants(self, topic: str) -> bool:
        """Return whether the mode records a topic, so that its message is needed."""
        return topic in self._topics

    def publish(self, topic: str, node: str, time_ns: int, encode: Callable[..., bytes], *values: Any) -> None:
        """Record a message if the mode records its topic; the seq of a leading header is filled in, from 1.

        `node` is the publisher's name as in `topics.TOPICS`; the time is not before that of the previous message.
        `encode` makes a ROS 1 message of the values; it is called later, when these must not have changed. OSError,
        which names the bag and keeps the errno, if the file cannot be written.
        """
        if topic in self._topics:
            self._waiting.append((topic, node, time_ns, encode, values))
            if len(self._waiting) >= AT_ONCE:
                with self._naming_errors():
                    self.write_waiting()

    def write_waiting(self) -> None:
        """Encode and write the messages that wait; OSError if that fails."""
        waiting, self._waiting = self._waiting, []
        file = self._file
        assert file is not None  # in a with statement
        prepared: List[Prepared] = []
        for topic, node, time_ns, encode, values in waiting:
            publisher = self._publishers.get((topic, node))
            if publisher is None:  # its description is between messages
                file.write_prepared(prepared)
                publisher, prepared = file.add_publisher(self._topics[topic], node), []
                self._publishers[topic, node] = publisher
            prepared.append(file.prepare(publisher, max(time_ns, EARLIEST_NS), encode(*values)))
        file.write_prepared(prepared)

    def __enter__(self) -> TrialBag:
        """Open the file under its unfinished name; OSError, as of `publish`, if it cannot be created."""
        if self._topics:
            try:
                with self._naming_errors():
                    self._path.parent.mkdir(parents=True, exist_ok=True)
                    self._discard()  # that of a process that was killed
                    self._file = self._open(self._unfinished)
            except OSError:
                self._discard()
                raise
        return self

    def __exit__(self, error_type: Optional[Type[BaseException]], *_: object) -> None:
        if self._file is None:
            return
        try:
            if error_type is None:
                with self._naming_errors():
                    self.write_waiting()
                    self._file.close()
                    os.replace(str(self._unfinished), str(self._path))
        finally:
            self._discard()

    def _discard(self) -> None:
        with contextlib.suppress(OSError):  # closing writes the buffer, and on a full disk fails once more
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
