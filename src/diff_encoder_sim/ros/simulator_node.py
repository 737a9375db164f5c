"""simulator_node: the stand-in for Gazebo on its topics and services."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import List

import rospy
from geometry_msgs.msg import Twist
from pydantic import Field
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState, LaserScan
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.ros.command_gate import Command, CommandGate
from diff_encoder_sim.ros.conversions import joint_state_message, scan_message, stamp_from_ns
from diff_encoder_sim.ros.node import log, node_params, publisher, run_node, subscriber
from diff_encoder_sim.ros.pacing import LONGEST_WAIT_S, GraphPacer, WallPacer
from diff_encoder_sim.ros.simulated_models import SimulatedModels
from diff_encoder_sim.ros.trial_plan import trial_plan
from diff_encoder_sim.simulation.simulator import STATES_PERIOD_NS, TICK_NS, Simulator, SimulatorParams
from diff_encoder_sim.trials.trial_definition import PoseParams

PAUSED_CLOCK_PERIOD_S = 0.05

# The odometry's period, and how far physics may run ahead of it.
GRAPH_PERIOD_NS = 50_000_000
GRAPH_LEAD_NS = 20_000_000

# How far it may run ahead of the answer to a scan: robot_state_publisher needs 20 ms to tell where
# the laser is; and odometry newer than the scan must not be there yet, as tf2 then rounds
# otherwise.
SCAN_LEAD_NS = 50_000_000


class SimulatorNodeParams(SimulatorParams):
    """Parameters of simulator_node. World, start and seed are the /trial's unless given."""

    robot: str = Field(min_length=1, description='xacro or URDF file')
    world: str = Field(min_length=1, description='world file; default: that of /trial')
    start: PoseParams = Field(PoseParams(), description='pose of base_link in the world; default: that of /trial')
    seed: int = Field(0, ge=0, description='of all random draws; default: the number of /trial')
    real_time_factor: float = Field(
        1.0, ge=0, description='simulated time per wall time; 0: as fast as the graph keeps up'
    )
    wait_for: List[str] = Field([], description='stamped topics that simulated time waits for')
    wait_for_once_begun: List[str] = Field([], description='the same, from their first message on')
    wait_for_after_scans: List[str] = Field([], description='stamped topics that answer each scan and are waited for')
    command_period: float = Field(
        0.0,
        ge=0,
        le=10,
        description='commands answer multiples of this time and are waited for [s]; 0: taken as they come',
    )
    command_at_start: bool = Field(False, description='the first command is waited for as well')
    paused: bool = Field(False, description='wait for /gazebo/unpause_physics')


class SimulatorNode:
    """Runs the simulator in its own thread and speaks for it."""

    def __init__(self) -> None:
        params = node_params(SimulatorNodeParams, defaults=_trial_defaults())
        core_params = SimulatorParams(**{name: getattr(params, name) for name in SimulatorParams.model_fields})
        self._simulator = Simulator(
            Path(params.world), Path(params.robot), core_params, params.start.pose(), params.seed
        )
        self._lock = threading.RLock()  # the loop and the callbacks share the simulator
        self._running = threading.Event()
        self._clock = publisher('/clock', Clock)
        self._joint_states = publisher('joint_states', JointState)
        self._scans = publisher('scan', LaserScan)
        self._scan_frame = params.laser_link
        self._scan_period_ns = params.lidar.period_ns
        self._models = SimulatedModels(self._simulator, self._lock)
        self._graph_pacer = GraphPacer(params.wait_for, params.wait_for_once_begun, GRAPH_PERIOD_NS, GRAPH_LEAD_NS)
        self._scan_pacer = GraphPacer(params.wait_for_after_scans, [], self._scan_period_ns, SCAN_LEAD_NS)
        self._wall_pacer = WallPacer(params.real_time_factor)
        self._commands = subscriber('cmd_vel', Twist, self._on_command)
        self._gate = CommandGate(
            _command_period_ns(params.command_period),
            GRAPH_LEAD_NS,
            LONGEST_WAIT_S,
            lambda: self._commands.get_num_connections() > 0,
            params.command_at_start,
        )
        self._services = [
            rospy.Service(f'/gazebo/{name}', Empty, handler)
            for name, handler in (
                ('pause_physics', self._on_pause),
                ('unpause_physics', self._on_unpause),
                ('reset_simulation', self._on_reset_simulation),
                ('reset_world', self._on_reset_world),
            )
        ]
        if not params.paused:
            self._on_unpause(EmptyRequest())
        self._loop = threading.Thread(target=self._run, daemon=True)
        self._loop.start()

    def _run(self) -> None:
        try:
            while not rospy.is_shutdown():
                if self._running.is_set():
                    self._step()
                else:
                    self._publish_clock()
                    time.sleep(PAUSED_CLOCK_PERIOD_S)
        except rospy.ROSException:
            if not rospy.is_shutdown():  # publishing on closed topics is how a shutdown looks
                raise
        except Exception as error:
            rospy.logfatal('simulation stopped: %s', error)
            rospy.signal_shutdown(str(error))
            raise

    def _step(self) -> None:
        """Say how things stand, wait until time may go on, and let it."""
        with self._lock:
            self._publish()
            now_ns = self._simulator.time_ns
        self._graph_pacer.wait(now_ns + TICK_NS)
        self._scan_pacer.wait(now_ns + TICK_NS)
        self._wall_pacer.wait(now_ns + TICK_NS)
        command = self._gate.take(now_ns)
        with self._lock:
            if now_ns != self._simulator.time_ns:
                return  # reset meanwhile
            if command is not None:
                self._apply(command)
            self._simulator.tick()

    def _apply(self, command: Command) -> None:
        try:
            self._simulator.command(*command)
        except InputFault as fault:
            log.warning('%s: %s; message dropped', self._commands.resolved_name, fault)

    def _publish_clock(self) -> None:
        self._clock.publish(Clock(stamp_from_ns(self._simulator.time_ns)))

    def _publish(self) -> None:
        self._publish_clock()
        self._joint_states.publish(joint_state_message(self._simulator.joint_states()))
        if self._simulator.time_ns % STATES_PERIOD_NS == 0:
            self._models.publish()
        if self._simulator.time_ns % self._scan_period_ns == 0:
            self._scans.publish(
                scan_message(self._simulator.scan(), self._scan_frame, self._scan_period_ns / NANOSECONDS_PER_SECOND)
            )

    def _on_command(self, message: Twist) -> None:
        self._gate.put((message.linear.x, message.angular.z))

    def _on_pause(self, _: EmptyRequest) -> EmptyResponse:
        self._running.clear()
        return EmptyResponse()

    def _on_unpause(self, _: EmptyRequest) -> EmptyResponse:
        with self._lock:
            if not self._running.is_set():
                self._wall_pacer.restart(self._simulator.time_ns)
                self._running.set()
        return EmptyResponse()

    def _on_reset_simulation(self, _: EmptyRequest) -> EmptyResponse:
        with self._lock:
            self._simulator.reset()
            self._graph_pacer.restart()
            self._scan_pacer.restart()
            self._gate.clear()
            self._wall_pacer.restart(0)
        return EmptyResponse()

    def _on_reset_world(self, _: EmptyRequest) -> EmptyResponse:
        with self._lock:
            self._simulator.reset_world()
        return EmptyResponse()


def _trial_defaults() -> dict:
    plan = trial_plan()
    if plan is None:
        return {}
    return {'world': plan.world, 'seed': plan.trial.number, 'start': plan.trial.test.start.model_dump()}


def _command_period_ns(period_s: float) -> int:
    period_ns = round(period_s * NANOSECONDS_PER_SECOND)
    if period_ns and (period_ns % TICK_NS or period_ns <= GRAPH_LEAD_NS):
        raise ConfigError(
            f'{rospy.get_name()}: command_period: given {period_s:g} s; allowed: 0, '
            f'or whole {TICK_NS // 1_000_000} ms above '
            f'{GRAPH_LEAD_NS // 1_000_000} ms'
        )
    return period_ns


def main() -> None:
    """Entry point of the executable."""
    run_node('simulator_node', SimulatorNode)
