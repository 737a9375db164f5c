"""gz_diff_encoder_node: counts the pulses of an encoder on each wheel, from /joint_states to /encoder_pulse."""

from __future__ import annotations

from sensor_msgs.msg import JointState

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.encoders.wheel_encoder import EncoderParams, ReportingEncoder
from diff_encoder_sim.msg import EncoderPulse
from diff_encoder_sim.odometry.wheel_odometry import OdometryParams
from diff_encoder_sim.ros.conversions import encoder_pulse_message, ns_from_stamp
from diff_encoder_sim.ros.node import log, node_params, publisher, run_node
from diff_encoder_sim.ros.stamped_subscriber import stamped_subscriber


class EncoderNode:
    """Samples the wheel angles at a steady rate and publishes the counters."""

    def __init__(self) -> None:
        params = node_params(EncoderParams, OdometryParams, part='config')
        self._joints = (params.left_joint, params.right_joint)
        self._encoder = ReportingEncoder(params)
        self._pulses = publisher('encoder_pulse', EncoderPulse)
        self._joint_states = stamped_subscriber('joint_states', JointState, self._on_joint_states)

    def _on_joint_states(self, message: JointState) -> None:
        try:
            samples = self._encoder.update(ns_from_stamp(message.header.stamp), message.name, message.position)
        except InputFault as fault:
            log.warning('%s: %s; message dropped', self._joint_states.resolved_name, fault)
            return
        for sample in samples:
            self._pulses.publish(encoder_pulse_message(sample, self._joints))


def main() -> None:
    """Run the node."""
    run_node('gz_diff_encoder_node', EncoderNode)
