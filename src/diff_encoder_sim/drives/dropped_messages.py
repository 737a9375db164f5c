"""Messages of a drive that could not be used."""

from __future__ import annotations

from collections import Counter
from typing import Counter as CounterType
from typing import Dict, Iterator

from diff_encoder_sim.base.errors import InputFault


class DroppedMessages:
    """Counts dropped messages by topic, and keeps why the first of each was dropped."""

    def __init__(self) -> None:
        self._first: Dict[str, str] = {}
        self._counts: CounterType[str] = Counter()

    def add(self, topic: str, fault: InputFault) -> None:
        """Count one message."""
        self._counts[topic] += 1
        self._first.setdefault(topic, str(fault))

    def lines(self) -> Iterator[str]:
        """Describe them, in one line for each topic."""
        for topic, count in self._counts.items():
            yield f'{topic}: {count} messages dropped; the first: {self._first[topic]}'
