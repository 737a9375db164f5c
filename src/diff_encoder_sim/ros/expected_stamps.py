"""Which stamps the nodes of a graph must have reached before simulated time may go on; needs no ROS."""

from __future__ import annotations

from diff_encoder_sim.navigation.control_rate import ControlRate
from diff_encoder_sim.simulation.periods import STATES_RATE_HZ, TICK_NS
from diff_encoder_sim.wheels.sampling import BoundaryTimes

# How far physics may run ahead of /odom and the true and estimated poses, so that it computes while the nodes do.
GRAPH_LEAD_NS = 20_000_000

# robot_state_publisher publishes the laser's frame 20 ms after time has begun: before, no scan can be answered.
FIRST_SCAN_LEAD_NS = 50_000_000


class ExpectedStamps:
    """The newest stamps that must have come before simulated time advances to some time; negative: none."""

    def __init__(self, report_rate_hz: float, scan_period_ns: int, report_delay_ns: int = 0) -> None:
        """Prepare for reports that come up to `report_delay_ns` after their boundary."""
        self._report_delay_ns = report_delay_ns
        self.reports = BoundaryTimes(report_rate_hz, TICK_NS)
        self.states = BoundaryTimes(STATES_RATE_HZ, TICK_NS)
        self._scan_period_ns = scan_period_ns

    def report_before(self, sim_time_ns: int) -> int:
        """Return the newest report of the encoder that odometry must have answered."""
        return self.reports.newest_ns(sim_time_ns - self._report_delay_ns - GRAPH_LEAD_NS)

    def state_before(self, sim_time_ns: int) -> int:
        """Return the newest /gazebo/model_states that must have been answered."""
        return self.states.newest_ns(sim_time_ns - GRAPH_LEAD_NS)

    def scan_before(self, sim_time_ns: int) -> int:
        """Return the newest scan that must have been answered: one that odometry has come to, before newer odometry.

        With newer odometry tf2 would interpolate, and round otherwise.
        """
        if sim_time_ns < FIRST_SCAN_LEAD_NS:
            return -1
        newest_ns = self.reports.newest_ns(sim_time_ns - self._report_delay_ns)
        before_newest_ns = self.reports.newest_ns(newest_ns - TICK_NS)
        return before_newest_ns // self._scan_period_ns * self._scan_period_ns


class AnsweredTimes:
    """The simulated times of the reports that a controller answers with a command.

    It answers every report or, where they come faster than it controls, those that its own `ControlRate` picks.
    """

    def __init__(self, reports: BoundaryTimes, control_period_s: float) -> None:
        self._reports = reports
        self._control_hz = 1.0 / control_period_s
        self.restart()

    def restart(self) -> None:
        """Begin again at time 0."""
        self._rate = ControlRate(self._control_hz)

    def is_answered(self, time_ns: int) -> bool:
        """Return whether the report at a time is answered; to be asked of every tick, in order."""
        return self._reports.newest_ns(time_ns) == time_ns and self._rate.is_due(time_ns)
