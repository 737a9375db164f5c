"""world_pose_node: the robot's true pose out of /gazebo/model_states, as /world_pose."""
from __future__ import annotations

import rospy
from geometry_msgs.msg import PoseStamped
from pydantic import Field

from diff_encoder_sim.config import Params
from diff_encoder_sim.encoder import BoundarySampler
from diff_encoder_sim.errors import InputFault
from diff_encoder_sim.experiments.definition import PoseParams
from diff_encoder_sim.ros.conversions import (ns_from_stamp, pose_from_message,
                                              pose_stamped_message)
from diff_encoder_sim.ros.gazebo_messages import ModelStates
from diff_encoder_sim.ros.node import log, node_params, publisher, run_node, subscriber
from diff_encoder_sim.timeline import NANOSECONDS_PER_SECOND, Step, Timeline


class WorldPoseParams(Params):
    """Parameters of world_pose_node."""

    model: str = Field('alto', min_length=1, description='the robot in /gazebo/model_states')
    map_frame: str = Field('map', min_length=1)
    map_in_world: PoseParams = PoseParams()
    rate: float = Field(20.0, ge=1e-3, le=1e6, description='[Hz]')
    states_period: float = Field(
        0.0, ge=0, description='model states come at multiples of this [s]; 0: at any time')


class WorldPoseNode:
    """Republishes one model's pose in the map frame at a fixed rate."""

    def __init__(self) -> None:
        self._params = node_params(WorldPoseParams)
        self._world_in_map = self._params.map_in_world.pose().inverse()
        self._period_ns = round(self._params.states_period * NANOSECONDS_PER_SECOND)
        self._restart()
        self._poses = publisher('world_pose', PoseStamped)
        self._states = subscriber('/gazebo/model_states', ModelStates, self._on_states)

    def _restart(self) -> None:
        self._sampler = BoundarySampler(self._params.rate)
        self._timeline = Timeline(tolerance_ns=0)

    def _on_states(self, message: ModelStates) -> None:
        stamp_ns = self._stamp_ns()
        step = self._timeline.advance(stamp_ns)
        if step is Step.RESTART:
            self._restart()
        if step is Step.STALE or self._sampler.period_index(stamp_ns) is None:
            return
        try:
            if self._params.model not in message.name:
                raise InputFault(f'model {self._params.model!r} is not among {message.name}')
            pose_in_world = pose_from_message(message.pose[message.name.index(self._params.model)])
        except InputFault as fault:
            log.warning('%s: %s; message dropped', self._states.resolved_name, fault)
            return
        self._poses.publish(pose_stamped_message(self._world_in_map.compose(pose_in_world),
                                                 stamp_ns, self._params.map_frame))

    def _stamp_ns(self) -> int:
        """When the states held. ModelStates has no stamp, and /clock may arrive after it.

        Of a simulator that sends states at whole multiples of a period, the clock's nearest
        multiple is the exact time; of any other, the clock is the best guess.
        """
        now_ns = ns_from_stamp(rospy.Time.now())
        if self._period_ns == 0:
            return now_ns
        return round(now_ns / self._period_ns) * self._period_ns


def main() -> None:
    """Entry point of the executable."""
    run_node('world_pose_node', WorldPoseNode)
