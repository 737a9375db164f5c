"""Nodes of the wheels: gz_diff_encoder_node counts pulses, gz_diff_odom_node integrates them."""

from __future__ import annotations

import time
from typing import Iterable

from geometry_msgs.msg import Twist
from sensor_msgs.msg import JointState

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.message_decoders import JointDecoder, decode_pulses, decode_wheel_speeds
from diff_encoder_sim.drives.message_encoders import encode_encoder_pulse, encode_wheel_speeds
from diff_encoder_sim.drives.topics import ENCODER_PULSE_TYPE, JOINT_STATE_TYPE
from diff_encoder_sim.msg import EncoderPulse
from diff_encoder_sim.ros.messages import Diagnostics, OdometryOutput, Publisher, encoded_subscriber, subscriber
from diff_encoder_sim.ros.node import empty_service, executable, log, node_params, trial_plan
from diff_encoder_sim.wheels.diagnostics import EncoderDiagnosis, OdometryDiagnosis, hidden_encoder
from diff_encoder_sim.wheels.odometry import WheelOdometry, wheel_speeds_mps
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import EncoderSample, SpeedPairing
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder


class EncoderNode:
    """Counts the pulses of an encoder on each wheel, from /joint_states to /encoder_pulse; also speeds if measured."""

    def __init__(self) -> None:
        params = node_params(EncoderParams, OdometryParams, part='config')
        self._joints = (params.left_joint, params.right_joint)
        self._encoder = ReportingEncoder(params)
        self._diagnosis = EncoderDiagnosis(params)
        self._diagnostics = Diagnostics('Counts')
        if params.encoder.counts_by_command:
            self._separation_m = node_params(OdometryParams, EncoderParams, part='config').wheel_separation
            self._commands = subscriber('cmd_vel', Twist, self._on_command)
        self._decoder = JointDecoder(JOINT_STATE_TYPE)
        encoded_subscriber('joint_states', JointState, self._on_joint_states)
        if params.velocity_method != 'M':
            self._speeds = Publisher('encoder_velocity', JointState)
        self._pulses = Publisher('encoder_pulse', EncoderPulse)  # last: once it is published, joint states are received

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


class OdometryNode:
    """Integrates /encoder_pulse to /odom and the transform odom -> base_link, with a reset service."""

    def __init__(self) -> None:
        params = node_params(OdometryParams, EncoderParams, part='config')
        rate_hz, plan = node_params(EncoderParams, OdometryParams, part='config').rate, trial_plan()
        if plan is not None:
            rate_hz = min(rate_hz, plan.report_rate)  # as joint states come
        warning = hidden_encoder(params) if params.motion_noise is None else ''
        if warning:
            log.warning('%s', warning)
        self._odometry = WheelOdometry(params)
        self._diagnosis = OdometryDiagnosis(self._odometry, rate_hz)
        self._diagnostics = Diagnostics('Odometry')
        self._pairing = SpeedPairing() if params.velocity_method != 'M' else None
        if self._pairing is not None:
            self._speeds = encoded_subscriber('encoder_velocity', JointState, self._on_speeds)
        self._decoder = JointDecoder(ENCODER_PULSE_TYPE)
        self._pulses = encoded_subscriber('encoder_pulse', EncoderPulse, self._on_pulses)
        self._commands = subscriber('cmd_vel', Twist, self._on_command)
        empty_service('~reset', self._on_reset)
        self._output = OdometryOutput(params.odom_frame, params.base_frame, params.publish_tf)  # last: pulses follow

    def _on_pulses(self, content: bytes) -> None:
        sample = decode_pulses(self._decoder, content)
        self._add([sample] if self._pairing is None else self._pairing.take_counts(sample, time.monotonic()))

    def _on_speeds(self, content: bytes) -> None:
        if self._pairing is not None:
            self._add(self._pairing.take_speeds(*decode_wheel_speeds(content)))

    def _add(self, samples: Iterable[EncoderSample]) -> None:
        for sample in samples:
            estimate = self._odometry.update(*sample)
            self._diagnosis.take_report(sample.stamp_ns, estimate is not None)
            if estimate is not None:
                self._output.publish(estimate)
                self._diagnostics.publish_when_due(sample.stamp_ns, self._diagnosis.diagnose)

    def _on_command(self, message: Twist) -> None:
        self._diagnosis.take_command(message.linear.x, message.angular.z)

    def _on_reset(self) -> None:
        self._odometry.reset()
        self._diagnosis.restart()
        log.info('reset: odometry starts at pose zero with the next /encoder_pulse')


gz_diff_encoder_node = executable('gz_diff_encoder_node', EncoderNode)
gz_diff_odom_node = executable('gz_diff_odom_node', OdometryNode)
