"""One model's state from /gazebo/model_states, with a stamp and at a steady rate."""

from __future__ import annotations

import math
import re
import threading
from typing import Callable, Mapping, Optional

import rospy
from pydantic import Field
from rosgraph_msgs.msg import Clock

from diff_encoder_sim.base.bounds import Duration_s, Rate_Hz
from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline, check_stamp
from diff_encoder_sim.drives.pose_messages import ModelStateDecoder
from diff_encoder_sim.ros.clock_pauses import (
    is_clock_pausing,
    listen_to_clock,
    look_at_clock,
    read_every_tick,
    read_now_and_then,
)
from diff_encoder_sim.ros.conversions import ns_from_stamp, planar_pose
from diff_encoder_sim.ros.encoded_topics import EncodedMessage, encoded_class
from diff_encoder_sim.ros.gazebo_messages import STATES_PERIOD_HEADER, ModelStates
from diff_encoder_sim.ros.node import log, robot_settings, subscriber
from diff_encoder_sim.simulation.state import STATES_RATE_HZ, PlanarVelocity
from diff_encoder_sim.wheels.sampling import BoundarySampler


class ModelStatesParams(Params):
    """Which model, how often, and how its states get their stamps."""

    model: str = Field('alto', min_length=1, description='name of the robot in /gazebo/model_states')
    rate: Rate_Hz = Field(STATES_RATE_HZ, description='reports per second of the clock [Hz]')
    states_period: Optional[Duration_s] = Field(
        None,
        description='states come at whole multiples of this [s]; 0: at any time; default: as simulator_node publishes '
        'them, 0 with other simulators',
    )


def launched_model() -> str:
    """Return the name of the robot that a launch file has started, else the usual one.

    Raises:
        rospy.ROSException: there is no master.
    """
    return str(robot_settings('world_pose').get('model', ModelStatesParams().model))


class ModelStateReader:
    """Calls back with (stamp_ns, pose in the world, velocity in the world) of one model.

    ModelStates has no stamp, and /clock comes on another connection, before or after the states of the same time. If a
    simulator publishes states at whole multiples of a period and waits for the answer, as simulator_node does, the
    multiple nearest to the clock is the exact time; states that are ahead of the clock wait for it. With any other
    simulator the clock is the best guess.
    """

    def __init__(self, params: ModelStatesParams, callback: Callable[[int, Pose2D, PlanarVelocity], None]) -> None:
        self._params = params
        self._callback = callback
        self._period_ns = round((params.states_period or 0.0) * NANOSECONDS_PER_SECOND)
        self._lock = threading.Lock()  # clock and states come in different threads
        self._clock_ns: Optional[int] = None
        self._waiting: Optional[bytes] = None
        self._restart()
        self._decoder = ModelStateDecoder(params.model)
        listen_to_clock(self._on_clock)
        self._states = subscriber('/gazebo/model_states', encoded_class(ModelStates), self._on_states)

    def _restart(self) -> None:
        self._sampler = BoundarySampler(self._params.rate)
        self._timeline = Timeline(tolerance_ns=0)
        read_every_tick()

    def _on_clock(self, message: Clock) -> None:
        now_ns = ns_from_stamp(message.clock)
        try:
            check_stamp(now_ns)
        except InputFault as fault:
            log.warning('/clock: %s; message dropped', fault)
            return
        with self._lock:
            if self._clock_ns is not None and now_ns < self._clock_ns:
                log.warning(
                    '/clock went back to %.3f s: %s restarts',
                    now_ns / NANOSECONDS_PER_SECOND,
                    rospy.get_name(),
                    extra=EVENT,
                )
                if self._period_ns == 0:
                    self._waiting = None  # of before the reset; else it is the first after it
                self._restart()
            self._clock_ns = now_ns
            self._date_waiting()

    def _on_states(self, message: EncodedMessage) -> None:
        with self._lock:
            if self._params.states_period is None:
                self._period_ns = _period_of_publisher(message._connection_header)  # rospy's own name
            self._waiting = message.content
            if not is_clock_pausing() or self._is_tick_read():
                self._date_waiting()
            if self._waiting is not None:
                look_at_clock()

    def _is_tick_read(self) -> bool:
        """Return whether the clock has come to the next multiple; if not, its tick can be read: it was sent before."""
        newest_ns = self._timeline.newest_ns
        return newest_ns is not None and self._clock_ns is not None and self._clock_ns >= newest_ns + self._period_ns

    def _date_waiting(self) -> None:
        if self._waiting is None or self._clock_ns is None:
            return
        stamp_ns = self._clock_ns
        if self._period_ns:
            stamp_ns = round(stamp_ns / self._period_ns) * self._period_ns
        if self._timeline.advance(stamp_ns) is Step.NEW:
            content, self._waiting = self._waiting, None
            if self._period_ns:
                read_now_and_then()  # from here on it is known which multiple comes next
            if self._sampler.period_index(stamp_ns) is not None:
                self._report(stamp_ns, content)

    def _report(self, stamp_ns: int, content: bytes) -> None:
        try:
            state = self._decoder.decode(content)
            pose_in_world = planar_pose(*state.position_xyz_m[:2], state.quat_xyzw)
            velocity = PlanarVelocity(*state.linear_xyz_mps[:2], state.angular_xyz_radps[2])
            if not all(map(math.isfinite, velocity)):
                raise InputFault(f'twist (x, y, yaw) {tuple(velocity)}; expected finite numbers [m/s, rad/s]')
        except InputFault as fault:
            log.warning('%s: %s; message dropped', self._states.resolved_name, fault)
            return
        self._callback(stamp_ns, pose_in_world, velocity)


def _period_of_publisher(connection_header: Mapping[str, str]) -> int:
    """Return the period of which a publisher's states are whole multiples, in nanoseconds; 0: none."""
    text = connection_header.get(STATES_PERIOD_HEADER, '')
    return int(text) if re.fullmatch('[0-9]{1,18}', text) else 0
