"""Bags of trials that have messages in common."""

from __future__ import annotations

from typing import Any, Callable, Dict, Sequence, Tuple

from diff_encoder_sim.drives.common_messages import CommonMessage, CommonMessages
from diff_encoder_sim.drives.trial_bag import AT_ONCE, EARLIEST_NS, TrialBag


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
