"""simulator_node: simulates robot, LiDAR and world with PyBullet, with the topics and services of Gazebo."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import Any, Callable, Dict, List

import rospy
from pydantic import Field
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState, LaserScan
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse
from tf2_msgs.msg import TFMessage
from typing_extensions import Annotated, Literal

from diff_encoder_sim.base.bounds import Between, Duration_s, Rate_Hz, Seed
from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.base.package_files import package_folder, users_path
from diff_encoder_sim.base.params import did_you_mean
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.message_encoders import (
    ImuEncoder,
    ModelStatesEncoder,
    encode_clock,
    encode_joint_state,
    encode_planar_tf,
    encode_scan,
)
from diff_encoder_sim.drives.test_definition import PoseParams
from diff_encoder_sim.robots.robot_file import load_robot_file
from diff_encoder_sim.robots.xacro_expansion import xacro_arguments_of_text
from diff_encoder_sim.ros import pacing
from diff_encoder_sim.ros.gazebo_states import STATES_PERIOD_HEADER, GetModelState, ModelStates, SetModelState
from diff_encoder_sim.ros.messages import Publisher, pose_from_message, stamp_from_ns
from diff_encoder_sim.ros.node import CALLBACKS, empty_service, executable, log, node_params, service, trial_plan
from diff_encoder_sim.simulation.simulator import Simulator, SimulatorParams
from diff_encoder_sim.simulation.state import STATES_PERIOD_NS, TICK_NS, PlanarVelocity
from diff_encoder_sim.wheels.report_link import DEFAULT_RATE_HZ

PAUSED_CLOCK_PERIOD_S = 0.05
LARGEST_NUMBER = 1e4  # larger ones reduce the precision of the physics, and finally yield NaN

# A command takes effect pacing.GRAPH_LEAD_NS after the report that it answers, and before the next one is answered.
SHORTEST_COMMAND_PERIOD_S = (pacing.GRAPH_LEAD_NS + TICK_NS) / NANOSECONDS_PER_SECOND


class SimulatorNodeParams(SimulatorParams):
    """Parameters of simulator_node; world, start and seed default to those of /trial."""

    robot: str = Field(min_length=1, description='name in config/robots/, a robot file, or a xacro or URDF file')
    robot_args: str = Field('', description="arguments of the robot's xacro: name=value name=value")
    world: str = Field(min_length=1, description='world file; default: that of /trial')
    start: PoseParams = Field(PoseParams(), description='pose of base_link in the world; default: that of /trial')
    seed: Seed = Field(0, description='of all random draws; default: the number of /trial')
    real_time_factor: Annotated[float, Between(1e-3, 1e6, or_zero=True)] = Field(
        1.0, description='simulated time per wall time; 0: as fast as the graph keeps up'
    )
    report_rate: Rate_Hz = Field(DEFAULT_RATE_HZ, description='rate of wait_for [Hz]; default: of /trial')
    report_delay: Duration_s = Field(0.0, description='how much later they may come [s]; default: of /trial')
    wait_for: List[str] = Field(
        [], description='stamped topics at report_rate that simulated time waits for; unless paused: once they begin'
    )
    wait_for_once_begun: List[str] = Field([], description='the same, from their first message on')
    wait_for_after_states: List[str] = Field([], description='the same, topics that answer each /gazebo/model_states')
    wait_for_after_scans: List[str] = Field([], description='the same, topics that answer each scan')
    command_period: Annotated[float, Between(SHORTEST_COMMAND_PERIOD_S, 10.0, 's', or_zero=True)] = Field(
        0.0,
        description='period of a controller that is waited for [s]; 0: commands apply as they come; default: of /trial',
    )
    commands_answer: Literal['reports', 'states'] = Field(
        'reports', description='what the controller answers: wait_for, or /gazebo/model_states; default: of /trial'
    )
    command_at_start: bool = Field(False, description='the first command is waited for as well')
    paused: bool = Field(False, description='wait for /gazebo/unpause_physics')


class SimulatorNode:
    """Runs the simulator in a thread, publishes its state, and serves Gazebo's services."""

    def __init__(self) -> None:
        plan = trial_plan()
        defaults: Dict[str, Any] = {}
        if plan is not None:
            defaults = plan.model_dump(include={'world', 'report_rate', 'report_delay'})
            defaults.update(seed=plan.trial.number, start=plan.trial.test.start.model_dump())
            defaults['commands_answer'] = 'states' if plan.trial.nav == 'scripted' else 'reports'
            defaults['command_period'] = plan.command_period and max(plan.command_period, SHORTEST_COMMAND_PERIOD_S)
        params = node_params(SimulatorNodeParams, part='simulator', defaults=defaults)
        arguments = xacro_arguments_of_text(params.robot_args)
        robot = load_robot_file(params.robot, users_path('.'), package_folder(), arguments)
        floor = plan.trial.test.floor if plan else ()
        self._simulator = Simulator(Path(params.world), robot.source, params, params.start.pose(), params.seed, floor)
        self._running = threading.Event()
        self._clock = Publisher('/clock', Clock)
        self._joint_states = Publisher('joint_states', JointState)
        self._scans = Publisher('scan', LaserScan)
        self._scan_frame, self._scan_period_ns = params.laser_link, params.lidar.period_ns
        if params.imu is not None:
            self._imu, self._imu_encoder = Publisher('imu/data', Imu), ImuEncoder(params.imu)
        if self._simulator.imu_frames:
            transform = encode_planar_tf(IDENTITY, 0, *self._simulator.imu_frames)
            Publisher('/tf_static', TFMessage, latch=True).publish(transform)
        headers = {STATES_PERIOD_HEADER: str(STATES_PERIOD_NS)}
        self._model_states = Publisher('/gazebo/model_states', ModelStates, headers=headers)
        self._states_encoder = ModelStatesEncoder(self._simulator.world, self._simulator.robot_name)
        self._begin_pacing(params)
        # pause_physics needs no lock: at full speed the loop hardly lets go of it.
        rospy.Service('/gazebo/pause_physics', Empty, self._pause)
        empty_service('/gazebo/unpause_physics', self._unpause)
        empty_service('/gazebo/reset_simulation', self._reset_simulation)
        empty_service('/gazebo/reset_world', self._simulator.reset_world)
        gazebo_service('/gazebo/set_model_state', SetModelState, self._set_model_state)
        gazebo_service('/gazebo/get_model_state', GetModelState, self._get_model_state)
        if not params.paused:
            self._unpause()
        threading.Thread(target=self._run, daemon=True).start()

    def _begin_pacing(self, params: SimulatorNodeParams) -> None:
        report_delay_ns = round(params.report_delay * NANOSECONDS_PER_SECOND)
        expected = pacing.ExpectedStamps(params.report_rate, self._scan_period_ns, report_delay_ns)
        expected_ns = {
            **dict.fromkeys([*params.wait_for, *params.wait_for_once_begun], expected.report_before),
            **dict.fromkeys(params.wait_for_after_states, expected.state_before),
            **dict.fromkeys(params.wait_for_after_scans, expected.scan_before),
        }
        # Unless started paused, topics are expected from their first message.
        from_start = set(expected_ns) - set(params.wait_for_once_begun) if params.paused else set()
        self._graph_pacer = pacing.GraphPacer(expected_ns, from_start)
        self._wall_pacer = pacing.WallPacer(params.real_time_factor)
        reports = expected.states if params.commands_answer == 'states' else expected.reports
        self._gate = pacing.CommandGate(reports, params.command_period, params.command_at_start)

    def _run(self) -> None:
        """Publish the state, wait until time may advance, and advance it by one tick, again and again."""
        while not rospy.is_shutdown():
            if not self._running.is_set():
                self._clock.publish(encode_clock(self._simulator.time_ns))
                time.sleep(PAUSED_CLOCK_PERIOD_S)
                continue
            with CALLBACKS:
                now_ns = self._simulator.time_ns
                self._publish(now_ns)
            self._graph_pacer.wait(now_ns + TICK_NS)
            self._wall_pacer.wait(now_ns + TICK_NS)
            command = self._gate.take(now_ns)
            with CALLBACKS:
                if now_ns != self._simulator.time_ns:
                    continue  # reset meanwhile
                if command is not None:
                    try:
                        self._simulator.command(*command)
                    except InputFault as fault:
                        log.warning('%s: %s; message dropped', self._gate.commands.resolved_name, fault)
                self._simulator.tick()

    def _publish(self, now_ns: int) -> None:
        self._clock.publish(encode_clock(now_ns))
        self._joint_states.publish(encode_joint_state(self._simulator.joint_states()))
        imu = self._simulator.imu()
        if imu is not None:
            self._imu.publish(self._imu_encoder.encode(imu))
        if now_ns % STATES_PERIOD_NS == 0:
            self._model_states.publish(self._states_encoder.encode(self._simulator.physics.base()))
        if now_ns % self._scan_period_ns == 0:
            period_s = self._scan_period_ns / NANOSECONDS_PER_SECOND
            self._scans.publish(encode_scan(self._simulator.scan(), self._scan_frame, period_s))

    def _pause(self, _: EmptyRequest) -> EmptyResponse:
        self._running.clear()
        return EmptyResponse()

    def _unpause(self) -> None:
        if not self._running.is_set():
            self._wall_pacer.restart(self._simulator.time_ns)
            self._running.set()

    def _reset_simulation(self) -> None:
        self._simulator.reset()
        self._graph_pacer.restart()
        self._gate.clear()
        self._wall_pacer.restart(0)

    def _set_model_state(self, request: Any, _: Any) -> str:
        state, robot_name = request.model_state, self._simulator.robot_name
        linear, angular = state.twist.linear, state.twist.angular
        self._check_names(state.model_name, state.reference_frame)
        if state.model_name != robot_name:
            raise InputFault(f'model {state.model_name!r} is fixed; only {robot_name!r} can be moved')
        pose = pose_from_message(state.pose)
        numbers = (pose.x_m, pose.y_m, linear.x, linear.y, angular.z)
        if not all(abs(number) <= LARGEST_NUMBER for number in numbers):  # NaN is not
            expected = f'expected numbers within +-{LARGEST_NUMBER:g} [m, m/s, rad/s]'
            raise InputFault(f'position and twist {numbers}; {expected}')
        self._simulator.physics.place(pose, PlanarVelocity(linear.x, linear.y, angular.z))
        placed = f'{robot_name} placed at ({pose.x_m:.3f}, {pose.y_m:.3f}) m, yaw {pose.yaw_rad:.3f} rad'
        log.info('%s', placed, extra=EVENT)
        return placed

    def _get_model_state(self, request: Any, response: Any) -> str:
        response.header.frame_id = request.relative_entity_name
        self._check_names(request.model_name, request.relative_entity_name)
        response.header.stamp = stamp_from_ns(self._simulator.time_ns)
        states = ModelStates().deserialize(self._states_encoder.encode(self._simulator.physics.base()))
        index = states.name.index(request.model_name)
        response.pose, response.twist = states.pose[index], states.twist[index]
        return ''

    def _check_names(self, model: str, frame: str) -> None:
        names = [*(model.name for model in self._simulator.world.models), self._simulator.robot_name]
        if model not in names:
            raise InputFault(f'model {model!r} does not exist{did_you_mean(model, names)}')
        if frame not in ('', 'world'):
            raise InputFault(f"reference frame {frame!r}; expected '' or 'world'")


def gazebo_service(name: str, service_class: Any, respond: Callable[[Any, Any], str]) -> rospy.Service:
    """Serve requests of Gazebo; `respond` fills in a response and returns its message, or raises InputFault with it."""

    def on_request(request: Any) -> Any:
        response = service_class._response_class()
        try:
            response.status_message, response.success = respond(request, response), True
        except InputFault as fault:
            response.status_message = str(fault)
        return response

    return service(name, service_class, on_request)


main = executable('simulator_node', SimulatorNode)
