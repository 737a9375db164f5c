"""How fast simulated time may run: by the wall clock, and by what the graph can follow."""

from __future__ import annotations

import logging
import threading
import time
from typing import Callable, Dict, List, Sequence

import rospy

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.ros.encoded_topics import encoded_stamp_ns

log = logging.getLogger(__name__)

# Simulated time that lags behind the wall clock by more is not caught up with.
LARGEST_LAG_S = 0.2

# A topic that does not come within this wall time is not waited for until its next message.
LONGEST_WAIT_S = 2.0


class WallPacer:
    """Keeps simulated time at a fixed multiple of wall time; 0 sets no limit."""

    def __init__(self, real_time_factor: float) -> None:
        self._real_time_factor = real_time_factor
        self._wall_start_s = 0.0
        self._sim_start_ns = 0

    def restart(self, sim_time_ns: int) -> None:
        """Count from here: after a pause or a reset."""
        self._wall_start_s = time.monotonic()
        self._sim_start_ns = sim_time_ns

    def wait(self, sim_time_ns: int) -> None:
        """Sleep until the wall clock has come to `sim_time_ns`."""
        if self._real_time_factor == 0:
            return
        sim_s = (sim_time_ns - self._sim_start_ns) / NANOSECONDS_PER_SECOND
        lead_s = self._wall_start_s + sim_s / self._real_time_factor - time.monotonic()
        if lead_s > 0:
            time.sleep(lead_s)
        elif lead_s < -LARGEST_LAG_S:
            self.restart(sim_time_ns)


class GraphPacer:
    """Holds simulated time back until stamped topics have come to it, so that it never runs ahead of the graph."""

    def __init__(
        self,
        topics: Sequence[str],
        expected_ns: Callable[[int], int],
        is_from_start: bool = True,
        topics_once_begun: Sequence[str] = (),
    ) -> None:
        """Subscribe to the topics.

        Args:
            topics: topics to wait for.
            expected_ns: from a simulated time, the stamp that every topic must have reached before it; negative: none.
            is_from_start: wait for `topics` from time 0; else from the first message of each.
            topics_once_begun: more topics, waited for from their first message in any case.
        """
        self._expected_ns = expected_ns
        self._moved = threading.Condition()
        self._newest_ns: Dict[str, int] = {}
        self._waited_ns = -1  # the newest stamp that has been waited for; negative: none
        self._begin_with_time = frozenset(topics if is_from_start else ())
        self._absent = set(self._begin_with_time)
        # AnyMsg and the header alone: any stamped message will do.
        self._subscribers = [
            rospy.Subscriber(topic, rospy.AnyMsg, self._on_message, callback_args=topic, tcp_nodelay=True)
            for topic in [*topics, *topics_once_begun]
        ]

    def restart(self) -> None:
        """Forget the stamps of before a reset."""
        with self._moved:
            self._newest_ns, self._absent = {}, set(self._begin_with_time)
            self._waited_ns = -1

    def wait(self, sim_time_ns: int) -> None:
        """Block until every topic has come to what is expected before `sim_time_ns`."""
        expected_ns = self._expected_ns(sim_time_ns)
        if expected_ns <= self._waited_ns:
            return  # for most ticks
        with self._moved:
            self._waited_ns = expected_ns
            if not self._moved.wait_for(lambda: not self._behind(expected_ns), LONGEST_WAIT_S):
                for topic in self._behind(expected_ns):
                    log.warning(
                        '%s: no message of simulated time %.2f s within %.0f s of wall time; '
                        'time runs on without waiting for it',
                        topic,
                        expected_ns / NANOSECONDS_PER_SECOND,
                        LONGEST_WAIT_S,
                    )
                    self._newest_ns.pop(topic, None)
                    self._absent.discard(topic)

    def _behind(self, expected_ns: int) -> List[str]:
        return [topic for topic, newest_ns in self._newest_ns.items() if newest_ns < expected_ns] + list(self._absent)

    def _on_message(self, message: rospy.AnyMsg, topic: str) -> None:
        stamp_ns = encoded_stamp_ns(message._buff)  # rospy's own name for the bytes of an AnyMsg
        with self._moved:
            self._absent.discard(topic)
            self._newest_ns[topic] = stamp_ns
            self._moved.notify_all()
