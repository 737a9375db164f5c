"""Outputs of encoders and odometry: /odom with its transform, and /diagnostics."""

from __future__ import annotations

from typing import Callable

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from nav_msgs.msg import Odometry
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.message_encoders import encode_odometry, encode_tf, encode_transform
from diff_encoder_sim.ros.conversions import header
from diff_encoder_sim.ros.encoded_topics import DisplayTopic, EncodedPublisher
from diff_encoder_sim.wheels.diagnostics import Diagnosis
from diff_encoder_sim.wheels.odometry import OdometryEstimate


class OdometryOutput:
    """Publishes estimates on `odom` and, with publish_tf, as the transform odom -> base."""

    def __init__(self, odom_frame: str, base_frame: str, publish_tf: bool) -> None:
        self._frames = odom_frame, base_frame
        self._odom = EncodedPublisher('odom', Odometry)
        self._transforms = EncodedPublisher('/tf', TFMessage) if publish_tf else None

    def publish(self, estimate: OdometryEstimate) -> None:
        """Publish an estimate with a new stamp."""
        if self._transforms is not None:
            transform = encode_transform(estimate.base_pose_in_odom, estimate.stamp_ns, *self._frames)
            self._transforms.publish(encode_tf(transform))
        self._odom.publish(encode_odometry(estimate, *self._frames))


class Diagnostics:
    """Publishes a status `NODE: TITLE` on /diagnostics, once per period of stamps, if there are subscribers."""

    def __init__(self, title: str, period_s: float = 1.0) -> None:
        self._title, self._period_ns = title, period_s * NANOSECONDS_PER_SECOND
        self._topic = DisplayTopic('/diagnostics', DiagnosticArray, queue_size=10)

    def publish_when_due(self, stamp_ns: int, diagnose: Callable[[], Diagnosis]) -> None:
        """Publish the result of `diagnose` if a period has elapsed: OK without a warning."""
        if not self._topic.is_due(self._period_ns, stamp_ns):
            return
        diagnosis = diagnose()
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if diagnosis.warning else DiagnosticStatus.OK,
            name=f'{rospy.get_name().lstrip("/")}: {self._title}',
            message=diagnosis.warning or 'OK',
            hardware_id='None',
            values=[KeyValue(key, f'{value:.6g}') for key, value in diagnosis.values.items()],
        )
        self._topic.publish(DiagnosticArray(header(stamp_ns, ''), [status]))
