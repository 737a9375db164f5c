"""gz_diff_encoder_node: counts the pulses of an encoder on each wheel, from /joint_states to /encoder_pulse."""

from __future__ import annotations

from geometry_msgs.msg import Twist
from sensor_msgs.msg import JointState

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.message_decoders import JointDecoder
from diff_encoder_sim.drives.message_encoders import encode_encoder_pulse, encode_wheel_speeds
from diff_encoder_sim.drives.topics import JOINT_STATE_TYPE
from diff_encoder_sim.msg import EncoderPulse
from diff_encoder_sim.ros.encoded_topics import EncodedPublisher, encoded_stamped_subscriber
from diff_encoder_sim.ros.node import node_params, run_node, subscriber
from diff_encoder_sim.ros.wheel_output import Diagnostics
from diff_encoder_sim.wheels.diagnostics import EncoderDiagnosis
from diff_encoder_sim.wheels.odometry import wheel_speeds_mps
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder


class EncoderNode:
    """Samples the wheel angles at a fixed rate and publishes counters, and speeds if measured."""

    def __init__(self) -> None:
        params = node_params(EncoderParams, OdometryParams, part='config')
        self._joints = (params.left_joint, params.right_joint)
        self._encoder = ReportingEncoder(params)
        self._diagnosis = EncoderDiagnosis(params.counter_modulus)
        self._diagnostics = Diagnostics('Counts')
        if params.velocity_method != 'M':
            self._speeds = EncodedPublisher('encoder_velocity', JointState)
        self._pulses = EncodedPublisher('encoder_pulse', EncoderPulse)
        if params.encoder.counts_by_command:
            self._separation_m = node_params(OdometryParams, EncoderParams, part='config').wheel_separation
            self._commands = subscriber('cmd_vel', Twist, self._on_command)
        self._decoder = JointDecoder(JOINT_STATE_TYPE)
        self._joint_states = encoded_stamped_subscriber('joint_states', JointState, self._on_joint_states)

    def _on_command(self, message: Twist) -> None:
        self._encoder.take_command(*wheel_speeds_mps(message.linear.x, message.angular.z, self._separation_m))

    def _on_joint_states(self, content: bytes) -> None:
        try:
            samples = self._encoder.update(*self._decoder.decode(content))
        except InputFault:
            self._diagnosis.take_fault()
            raise
        for sample in samples:
            if sample.wheel_rates_radps is not None:
                self._speeds.publish(encode_wheel_speeds(sample.stamp_ns, sample.wheel_rates_radps, self._joints))
            self._pulses.publish(encode_encoder_pulse(sample, self._joints))
            self._diagnosis.take_report(sample)
            self._diagnostics.publish_when_due(sample.stamp_ns, self._diagnosis.diagnose)


def main() -> None:
    """Run the node."""
    run_node('gz_diff_encoder_node', EncoderNode)
