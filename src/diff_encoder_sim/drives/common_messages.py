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
