"""The simulated robot and world as models of Gazebo: their states, and placing the robot elsewhere."""

from __future__ import annotations

import math
import threading
from typing import Any, Dict, Tuple

import rospy
from geometry_msgs.msg import Pose, Quaternion, Twist

from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.typed_params import did_you_mean
from diff_encoder_sim.drives.model_messages import ModelStatesEncoder
from diff_encoder_sim.ros.conversions import body_messages, matrix_pose_message, pose_from_message, stamp_from_ns
from diff_encoder_sim.ros.encoded_topics import EncodedPublisher
from diff_encoder_sim.ros.gazebo_messages import STATES_PERIOD_HEADER, GetModelState, ModelStates, SetModelState
from diff_encoder_sim.ros.node import log
from diff_encoder_sim.simulation.periods import STATES_PERIOD_NS
from diff_encoder_sim.simulation.simulator import Simulator
from diff_encoder_sim.simulation.state import PlanarVelocity

WORLD_FRAMES = ('', 'world')

# A robot at rest on its casters leans far less; a robot on its side far more.
LARGEST_LEAN_RAD = 0.1

# Far beyond this the physics loses precision, and then yields NaN.
LARGEST_NUMBER = 1e4


class SimulatedModels:
    """Serves /gazebo/model_states, /gazebo/set_model_state and /gazebo/get_model_state."""

    def __init__(self, simulator: Simulator, lock: threading.RLock) -> None:
        """Advertise topic and services; `lock` is held whenever the simulator is used."""
        self._simulator = simulator
        self._lock = lock
        self._fixed = {
            model.name: (matrix_pose_message(model.pose_in_world), Twist()) for model in simulator.world.models
        }
        self._encoder = ModelStatesEncoder(simulator.world, simulator.robot_name)
        self._states = EncodedPublisher(
            '/gazebo/model_states', ModelStates, headers={STATES_PERIOD_HEADER: str(STATES_PERIOD_NS)}
        )
        self._services = [
            rospy.Service('/gazebo/set_model_state', SetModelState, self._on_set),
            rospy.Service('/gazebo/get_model_state', GetModelState, self._on_get),
        ]

    def publish(self) -> None:
        """Publish the states of all models."""
        self._states.publish(self._encoder.encode(self._simulator.base()))

    def _all(self) -> Dict[str, Tuple[Pose, Twist]]:
        return {**self._fixed, self._simulator.robot_name: body_messages(self._simulator.base())}

    def _on_set(self, request: Any) -> Any:
        state, response = request.model_state, SetModelState._response_class()
        try:
            self._check_names(state.model_name, state.reference_frame)
            if state.model_name != self._simulator.robot_name:
                raise InputFault(
                    f'model {state.model_name!r} is fixed; only {self._simulator.robot_name!r} can be moved'
                )
            pose, velocity = _upright_pose(state.pose), _planar_velocity(state.twist)
        except InputFault as fault:
            response.status_message = str(fault)
            return response
        with self._lock:
            self._simulator.place(pose, velocity)
        response.success = True
        response.status_message = (
            f'{state.model_name} placed at ({pose.x_m:.3f}, {pose.y_m:.3f}) m, yaw {pose.yaw_rad:.3f} rad'
        )
        log.info('%s', response.status_message, extra=EVENT)
        return response

    def _on_get(self, request: Any) -> Any:
        response = GetModelState._response_class()
        response.header.frame_id = request.relative_entity_name
        try:
            self._check_names(request.model_name, request.relative_entity_name)
        except InputFault as fault:
            response.status_message = str(fault)
            return response
        with self._lock:
            response.header.stamp = stamp_from_ns(self._simulator.time_ns)
            response.pose, response.twist = self._all()[request.model_name]
        response.success = True
        return response

    def _check_names(self, model: str, frame: str) -> None:
        names = [*self._fixed, self._simulator.robot_name]
        if model not in names:
            raise InputFault(f'model {model!r} does not exist{did_you_mean(model, names)}')
        if frame not in WORLD_FRAMES:
            raise InputFault(f"reference frame {frame!r}; expected '' or 'world'")


def _upright_pose(pose: Pose) -> Pose2D:
    """Project a robot's pose to the floor: its height and a slight lean are dropped.

    Raises:
        InputFault: a number is too large, the quaternion is no rotation, or the robot would not stand upright.
    """
    _check_numbers('position [m]', pose.position.x, pose.position.y, pose.position.z)
    planar = pose_from_message(pose)
    if _lean_rad(pose.orientation) > LARGEST_LEAN_RAD:
        raise InputFault(
            f'orientation leans by {_lean_rad(pose.orientation):.2f} rad; expected an upright robot (roll and pitch 0)'
        )
    return planar


def _lean_rad(quaternion: Quaternion) -> float:
    """Return the angle between the vertical and the z axis of a body with this orientation."""
    across = math.hypot(quaternion.x, quaternion.y)
    return 2.0 * math.atan2(across, math.hypot(quaternion.z, quaternion.w))


def _planar_velocity(twist: Twist) -> PlanarVelocity:
    """Project a twist to the floor; what would lift or tip the robot is dropped.

    Raises:
        InputFault: a number is too large.
    """
    linear, angular = twist.linear, twist.angular
    _check_numbers('twist [m/s, rad/s]', linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
    return PlanarVelocity(linear.x, linear.y, angular.z)


def _check_numbers(what: str, *numbers: float) -> None:
    if not all(abs(number) <= LARGEST_NUMBER for number in numbers):  # NaN is not
        raise InputFault(f'{what} {numbers}; expected numbers within +-{LARGEST_NUMBER:g}')
