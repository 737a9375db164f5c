"""odometry_fusion_node: fuses counts and a gyroscope, with the topics, frames and parameters of robot_localization."""

from __future__ import annotations

from typing import Iterable

from pydantic import Field
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool

from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.drives.message_decoders import JointDecoder, decode_imu, decode_pulses
from diff_encoder_sim.drives.topics import ENCODER_PULSE_TYPE
from diff_encoder_sim.localization.fused_odometry import FusedOdometry
from diff_encoder_sim.localization.fusion import FusionParams, warm_up
from diff_encoder_sim.msg import EncoderPulse
from diff_encoder_sim.ros.messages import Diagnostics, OdometryOutput, Publisher, encoded_subscriber
from diff_encoder_sim.ros.node import compile_first, empty_service, executable, log, node_params
from diff_encoder_sim.wheels.odometry import OdometryEstimate
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams


class FusionNodeParams(FusionParams):
    """Parameters of odometry_fusion_node, next to those of gz_diff_odom_node for the wheels."""

    imu: ImuParams = Field(description='parameters of the IMU, as in config/imu/; launch files set them by imu:=')


class FusionNode:
    """Fuses /encoder_pulse and /imu/data to /odometry/filtered and the transform odom -> base_link, with a reset."""

    def __init__(self) -> None:
        odometry = node_params(OdometryParams, EncoderParams, FusionNodeParams, part='config')
        params = node_params(FusionNodeParams, OdometryParams, EncoderParams, part='fusion')
        compile_first(warm_up)
        self._odometry = FusedOdometry(params, odometry, params.imu)
        self._diagnostics, self._slip = Diagnostics('Slip'), Publisher('~slip', Bool, latch=True)
        self._publish_slip(False)
        self._decoder = JointDecoder(ENCODER_PULSE_TYPE)
        self._pulses = encoded_subscriber('encoder_pulse', EncoderPulse, self._on_pulses)
        self._imu = encoded_subscriber('imu/data', Imu, self._on_imu)
        empty_service('~reset', self._on_reset)
        frames = params.odom_frame, params.base_link_frame
        self._output = OdometryOutput(*frames, params.publish_tf, 'odometry/filtered')  # last: pulses follow

    def _on_pulses(self, content: bytes) -> None:
        self._publish(self._odometry.take_counts(*decode_pulses(self._decoder, content)[:3]))

    def _on_imu(self, content: bytes) -> None:
        self._publish(self._odometry.take_imu(*decode_imu(content)))

    def _publish(self, estimates: Iterable[OdometryEstimate]) -> None:
        for estimate in estimates:
            self._output.publish(estimate)
            self._diagnostics.publish_when_due(estimate.stamp_ns, self._odometry.slip.diagnose)
        if self._odometry.slip.state.is_slipping != self._is_slipping:
            self._publish_slip(not self._is_slipping)

    def _publish_slip(self, is_slipping: bool) -> None:
        self._is_slipping = is_slipping
        self._slip.publish(Bool(is_slipping))

    def _on_reset(self) -> None:
        self._odometry.reset()
        self._publish_slip(False)
        log.info('reset: odometry starts at pose zero with the next /encoder_pulse')


main = executable('odometry_fusion_node', FusionNode)
