"""Pace of simulated time: by the wall clock, and by the responses of the graph."""

from __future__ import annotations

import logging
import threading
import time
from typing import Callable, Collection, Dict, List, Mapping, Optional

import rospy
from geometry_msgs.msg import Twist

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.message_decoders import encoded_stamp_ns
from diff_encoder_sim.navigation.navigator_inputs import STOP, Command, ControlRate
from diff_encoder_sim.simulation.state import STATES_RATE_HZ, TICK_NS
from diff_encoder_sim.wheels.report_link import BoundarySampler

log = logging.getLogger(__name__)

LARGEST_LAG_S = 0.2  # behind the wall clock, above which simulated time does not catch up
LONGEST_SLEEP_S = 0.1  # after which the pacer looks whether the node ends
LONGEST_WAIT_S = 2.0  # wall time after which a silent topic is ignored until its next message


class WallPacer:
    """Keeps simulated time at a fixed multiple of wall time; 0 sets no limit."""

    def __init__(self, real_time_factor: float, start_ns: int = 0) -> None:
        self._real_time_factor = real_time_factor
        self.restart(start_ns)

    def restart(self, sim_time_ns: int) -> None:
        """Restart from this time, after a pause or a reset."""
        self._wall_start_s, self._sim_start_ns = time.monotonic(), sim_time_ns

    def wait(self, sim_time_ns: int) -> None:
        """Sleep until the wall clock has reached `sim_time_ns`, or the node ends."""
        if self._real_time_factor == 0:
            return
        sim_s = (sim_time_ns - self._sim_start_ns) / NANOSECONDS_PER_SECOND
        due_s = self._wall_start_s + sim_s / self._real_time_factor
        if time.monotonic() - due_s > LARGEST_LAG_S:
            self.restart(sim_time_ns)
        while time.monotonic() < due_s and not rospy.is_shutdown():
            time.sleep(min(max(due_s - time.monotonic(), 0.0), LONGEST_SLEEP_S))


class GraphPacer:
    """Delays simulated time until stamped topics have reached it.

    `expected_ns` has by topic the stamp that it must have reached before a simulated time; negative: none. Topics of
    `from_start` are waited for from time 0, the others from their first message.
    """

    def __init__(self, expected_ns: Mapping[str, Callable[[int], int]], from_start: Collection[str]) -> None:
        self._expected_ns, self._from_start = expected_ns, from_start
        self._moved = threading.Condition()
        self.restart()
        for topic in expected_ns:  # AnyMsg with only the header parsed accepts any stamped message
            rospy.Subscriber(topic, rospy.AnyMsg, self._on_message, callback_args=topic, tcp_nodelay=True)

    def restart(self) -> None:
        """Clear the stamps after a reset."""
        with self._moved:
            self._newest_ns: Dict[str, int] = dict.fromkeys(self._from_start, -1)

    def wait(self, sim_time_ns: int) -> None:
        """Block until every topic has received the expected messages before `sim_time_ns`."""
        expected_ns = {topic: expected(sim_time_ns) for topic, expected in self._expected_ns.items()}

        def behind() -> List[str]:
            return [topic for topic, newest_ns in self._newest_ns.items() if newest_ns < expected_ns[topic]]

        with self._moved:
            if not self._moved.wait_for(lambda: not behind(), LONGEST_WAIT_S):
                for topic in behind():
                    what = topic, expected_ns[topic] / NANOSECONDS_PER_SECOND, LONGEST_WAIT_S
                    log.warning(
                        '%s: no message of simulated time %.2f s within %.0f s of wall time; continuing without it',
                        *what,
                    )
                    del self._newest_ns[topic]

    def _on_message(self, message: rospy.AnyMsg, topic: str) -> None:
        with self._moved:
            self._newest_ns[topic] = encoded_stamp_ns(message._buff)  # the bytes of an AnyMsg
            self._moved.notify_all()


GRAPH_LEAD_NS = 20_000_000  # of the physics over odometry and poses, which lets both compute in parallel
# robot_state_publisher publishes the laser's frame 20 ms after the start of time; earlier scans get no response.
FIRST_SCAN_LEAD_NS = 50_000_000


class ExpectedStamps:
    """Latest stamps required before simulated time advances to a given time; negative: none."""

    def __init__(self, report_rate_hz: float, scan_period_ns: int, report_delay_ns: int = 0) -> None:
        """Set the rates; reports arrive up to `report_delay_ns` after their boundary."""
        self._report_delay_ns = report_delay_ns
        self.reports = BoundarySampler(report_rate_hz, TICK_NS)
        self.states = BoundarySampler(STATES_RATE_HZ, TICK_NS)
        self._scan_period_ns = scan_period_ns

    def report_before(self, sim_time_ns: int) -> int:
        """Return the stamp of the latest encoder report that odometry must have processed."""
        return self.reports.newest_ns(sim_time_ns - self._report_delay_ns - GRAPH_LEAD_NS)

    def state_before(self, sim_time_ns: int) -> int:
        """Return the stamp of the latest /gazebo/model_states that must have been processed."""
        return self.states.newest_ns(sim_time_ns - GRAPH_LEAD_NS)

    def scan_before(self, sim_time_ns: int) -> int:
        """Return the stamp of the latest scan to process before newer odometry, with which tf2 rounds differently."""
        if sim_time_ns < FIRST_SCAN_LEAD_NS:
            return -1
        newest_ns = self.reports.newest_ns(sim_time_ns - self._report_delay_ns)
        return self.reports.newest_ns(newest_ns - TICK_NS) // self._scan_period_ns * self._scan_period_ns


IDLE_PATIENCE_S = 0.02  # wall time


class CommandGate:
    """Applies one command per report, at a reproducible simulated time.

    Commands have no stamp, and their delay depends on the load of the host: the simulation waits for the command to a
    report, which takes effect GRAPH_LEAD_NS after it. A controller responds to all reports, or if it is slower to those
    of its `ControlRate`, `is_from_start` with the first. Of period 0, commands take effect on arrival.
    """

    def __init__(self, reports: BoundarySampler, period_s: float, is_from_start: bool) -> None:
        self._reports, self._period_s = reports, period_s
        self._arrived = threading.Condition()
        self._newest: Optional[Command] = None
        self._report_ns: Optional[int] = None  # latest report whose command was taken
        self._is_waited_for, self._is_moving, self._is_first = True, False, is_from_start
        self.clear()
        self.commands = rospy.Subscriber('cmd_vel', Twist, self._on_command, tcp_nodelay=True)

    def _on_command(self, message: Twist) -> None:
        with self._arrived:
            self._newest, self._is_waited_for = Command(message.linear.x, message.angular.z), True
            self._arrived.notify_all()

    def clear(self) -> None:
        """Discard a pending command after a reset."""
        with self._arrived:
            self._newest = self._report_ns = None
            self._rate = ControlRate(1.0 / self._period_s) if self._period_s else None

    def take(self, sim_time_ns: int) -> Optional[Command]:
        """Return the command that takes effect at `sim_time_ns`, if any; may block. Call it for every tick in order."""
        with self._arrived:
            if self._rate is not None:
                report_ns = sim_time_ns - GRAPH_LEAD_NS
                is_report = report_ns >= 0 and self._reports.newest_ns(report_ns) == report_ns
                if not (is_report and self._rate.is_due(report_ns)):
                    return None
                # The command to a report within the delay may have been taken with the previous one.
                if self._report_ns is not None and report_ns - self._report_ns <= GRAPH_LEAD_NS:
                    return None
                self._report_ns = report_ns
                self._wait(sim_time_ns)
            newest, self._newest = self._newest, None
            if newest is not None:
                self._is_moving = newest != STOP
            return newest

    def _wait(self, sim_time_ns: int) -> None:
        if self._newest is not None or not (self._is_waited_for and self.commands.get_num_connections()):
            return
        # Between goals there may be no controller.
        patience_s = LONGEST_WAIT_S if self._is_moving or self._is_first else IDLE_PATIENCE_S
        self._is_first = False
        if not self._arrived.wait_for(lambda: self._newest is not None, patience_s):
            self._is_waited_for = False
            if self._is_moving:
                sim_s = sim_time_ns / NANOSECONDS_PER_SECOND
                log.warning('no velocity command within %.1f s at simulated time %.2f s: continuing', patience_s, sim_s)
