"""State of a model from /gazebo/model_states, and message and service classes of gazebo_msgs."""

from __future__ import annotations

import math
from typing import Any, Callable, Optional, Type

import rospy
from genpy.dynamic import generate_dynamic
from geometry_msgs.msg import Pose, Twist
from pydantic import Field
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Header

from diff_encoder_sim.base.bounds import Duration_s, Rate_Hz
from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.drives.message_decoders import decode_model_state, planar_pose
from diff_encoder_sim.drives.topics import MODEL_STATES_TYPE
from diff_encoder_sim.drives.typestore import definition
from diff_encoder_sim.ros import node
from diff_encoder_sim.ros.messages import EncodedMessage, encoded_class, ns_from_stamp, subscriber
from diff_encoder_sim.simulation.state import STATES_RATE_HZ, PlanarVelocity
from diff_encoder_sim.wheels.report_link import BoundarySampler

__all__ = ['STATES_PERIOD_HEADER', 'GetModelState', 'ModelStates', 'SetModelState']

STATES_PERIOD_HEADER = 'states_period_ns'  # header field of simulator_node's connections: period of states [ns]
_MODEL_STATE = 'string model_name\ngeometry_msgs/Pose pose\ngeometry_msgs/Twist twist\nstring reference_frame'
_STATUS = 'bool success\nstring status_message'


def built_service(name: str, md5sum: str, request: str, response: str) -> Type[Any]:
    """Build a service class from both parts of its .srv file."""
    parts = [f'MSG: {part._type}\n{part._full_text}' for part in (Pose, Twist, Header)]
    parts.append(f'MSG: gazebo_msgs/ModelState\n{_MODEL_STATE}')
    request_class, response_class = (
        generate_dynamic(name + kind, ('\n' + 80 * '=' + '\n').join([part, *parts]))[name + kind]
        for kind, part in (('Request', request), ('Response', response))
    )
    fields = {'_type': name, '_md5sum': md5sum, '_request_class': request_class, '_response_class': response_class}
    return type(name.split('/')[1], (), fields)


# gazebo_msgs is not in Debian's ROS.
try:
    from gazebo_msgs.msg import ModelStates
    from gazebo_msgs.srv import GetModelState, SetModelState
except ImportError:
    text = definition(MODEL_STATES_TYPE).text  # that bags contain, from a live trial as in lockstep
    ModelStates = generate_dynamic('gazebo_msgs/ModelStates', text)['gazebo_msgs/ModelStates']
    text = 'gazebo_msgs/ModelState model_state'
    SetModelState = built_service('gazebo_msgs/SetModelState', '5b3ab0281d4f5445def017e3a2e4a07b', text, _STATUS)
    parts = f'std_msgs/Header header\ngeometry_msgs/Pose pose\ngeometry_msgs/Twist twist\n{_STATUS}'
    text = 'string model_name\nstring relative_entity_name'
    GetModelState = built_service('gazebo_msgs/GetModelState', '4c515e936d3319c9610c559c60bfc3d4', text, parts)


class ModelStatesParams(Params):
    """Model, rate and stamps of the states."""

    model: str = Field('alto', min_length=1, description='name of the robot in /gazebo/model_states')
    rate: Rate_Hz = Field(STATES_RATE_HZ, description='reports per second of the clock [Hz]')
    states_period: Optional[Duration_s] = Field(
        None, description='states come at multiples of this [s]; 0: at any time; default: of simulator_node, else 0'
    )


def launched_model() -> str:
    """Return the model name of the launched robot, or the default; rospy.ROSException if there is no master."""
    return str(node.robot_settings('world_pose').get('model', ModelStatesParams().model))


class ModelStateReader:
    """Calls back with (stamp_ns, pose in the world, velocity in the world) of a model.

    ModelStates has no stamp, and /clock is received on another connection, before or after the states of equal time. If
    a simulator publishes states at multiples of a period and waits for the response, as simulator_node does, the
    latest multiple of the clock is the exact time; states wait until it is a new one. With other simulators the time of
    the clock is used.
    """

    def __init__(self, params: ModelStatesParams, callback: Callable[[int, Pose2D, PlanarVelocity], None]) -> None:
        self._params, self._callback = params, callback
        self._period_ns = round((params.states_period or 0.0) * NANOSECONDS_PER_SECOND)
        self._clock_ns: Optional[int] = None
        self._waiting: Optional[bytes] = None
        self._restart()
        node.read_every_tick(self._on_clock)
        self._states = subscriber('/gazebo/model_states', encoded_class(ModelStates), self._on_states)

    def _restart(self) -> None:
        self._sampler = BoundarySampler(self._params.rate)
        self._timeline = Timeline(tolerance_ns=0)

    def _on_clock(self, message: Clock) -> None:
        now_ns = ns_from_stamp(message.clock)
        if self._clock_ns is not None and now_ns < self._clock_ns:
            now_s = now_ns / NANOSECONDS_PER_SECOND
            node.log.warning('/clock went back to %.3f s: %s restarts', now_s, rospy.get_name(), extra=EVENT)
            if self._period_ns == 0:
                self._waiting = None  # of before the reset; else it is the first after it
            self._restart()
        self._clock_ns = now_ns
        self._date_waiting()

    def _on_states(self, message: EncodedMessage) -> None:
        if self._params.states_period is None:
            self._period_ns = int(message._connection_header.get(STATES_PERIOD_HEADER, 0))  # set by rospy
        self._waiting = message.content
        self._date_waiting()

    def _date_waiting(self) -> None:
        if self._waiting is None or self._clock_ns is None:
            return
        stamp_ns = self._clock_ns
        if self._period_ns:
            # The first states may come before their tick, which is at most half a period late.
            late_ns = self._period_ns // 2 if self._timeline.newest_ns is None else 0
            stamp_ns = (stamp_ns + late_ns) // self._period_ns * self._period_ns
        if self._timeline.advance(stamp_ns) is Step.NEW:
            content, self._waiting = self._waiting, None
            if self._sampler.period_index(stamp_ns) is not None:
                self._report(stamp_ns, content)

    def _report(self, stamp_ns: int, content: bytes) -> None:
        try:
            state = decode_model_state(content, self._params.model)
            pose_in_world = planar_pose(*state.position_xyz_m, *state.quat_xyzw)
            velocity = PlanarVelocity(*state.linear_xyz_mps[:2], state.angular_xyz_radps[2])
            if not all(map(math.isfinite, velocity)):
                raise InputFault(f'twist (x, y, yaw) {tuple(velocity)}; expected finite numbers [m/s, rad/s]')
        except InputFault as fault:
            node.log.warning('%s: %s; message dropped', self._states.resolved_name, fault)
            return
        self._callback(stamp_ns, pose_in_world, velocity)
