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

    def encoded(self) -> List[bytes]:
        """Return the messages, encoded for ROS 1."""
        return self.made('encoded', lambda: [message.encode(*message.values) for message in self.messages])

    def made(self, key: Hashable, make: Callable[[], List[T]]) -> List[T]:
        """Return what `make` made of the messages when it was called with this key for the first time since `clear`."""
        if key not in self._made:
            self._made[key] = make()
        made: List[T] = self._made[key]
        return made

    def clear(self) -> None:
        """Remove the messages, which every bag has."""
        self.messages.clear()
        self._made.clear()
