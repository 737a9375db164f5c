"""Messages that several bags have in common: what is made of them for one serves the others."""

from __future__ import annotations

from typing import Any, Callable, Dict, Hashable, List, NamedTuple, Tuple, TypeVar

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
        self._made: Dict[Hashable, Any] = {}

    def encoded(self, begin: int, end: int) -> List[bytes]:
        """Return some of the messages, encoded for ROS 1."""
        return [message.encode(*message.values) for message in self.messages[begin:end]]

    def made(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return what `make` returned when it was called with this key for the first time since `clear`."""
        if key not in self._made:
            self._made[key] = make()
        made: T = self._made[key]
        return made

    def clear(self) -> None:
        """Remove the messages, which every bag has."""
        self.messages.clear()
        self._made.clear()
