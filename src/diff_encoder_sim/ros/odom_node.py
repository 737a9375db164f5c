"""gz_diff_odom_node: integrates /encoder_pulse to /odom and the transform odom -> base_link."""

from __future__ import annotations

import threading

import rospy
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.encoders.wheel_encoder import EncoderParams
from diff_encoder_sim.msg import EncoderPulse
from diff_encoder_sim.odometry.wheel_odometry import OdometryParams, WheelOdometry
from diff_encoder_sim.ros.conversions import encoder_sample
from diff_encoder_sim.ros.node import log, node_params, run_node
from diff_encoder_sim.ros.odometry_output import OdometryOutput
from diff_encoder_sim.ros.stamped_subscriber import stamped_subscriber


class OdometryNode:
    """Publishes odometry for each message of the counters, and resets it by service."""

    def __init__(self) -> None:
        params = node_params(OdometryParams, EncoderParams, part='config')
        self._odometry = WheelOdometry(params)
        self._lock = threading.Lock()  # the service and the topic come in different threads
        self._output = OdometryOutput(params.odom_frame, params.base_frame, params.publish_tf)
        self._reset = rospy.Service('~reset', Empty, self._on_reset)
        self._pulses = stamped_subscriber('encoder_pulse', EncoderPulse, self._on_pulses)

    def _on_pulses(self, message: EncoderPulse) -> None:
        try:
            sample = encoder_sample(message)
        except InputFault as fault:
            log.warning('%s: %s; message dropped', self._pulses.resolved_name, fault)
            return
        with self._lock:
            estimate = self._odometry.update(*sample)
        if estimate is not None:
            self._output.publish(estimate)

    def _on_reset(self, _: EmptyRequest) -> EmptyResponse:
        with self._lock:
            self._odometry.reset()
        log.info('reset: odometry starts at pose zero with the next /encoder_pulse')
        return EmptyResponse()


def main() -> None:
    """Run the node."""
    run_node('gz_diff_odom_node', OdometryNode)
