"""The state of encoders and odometry on /diagnostics."""

from __future__ import annotations

from typing import Callable

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.topics import DIAGNOSTICS
from diff_encoder_sim.ros.conversions import stamp_from_ns
from diff_encoder_sim.ros.encoded_topics import DisplayTopic
from diff_encoder_sim.wheels.diagnostics import Diagnosis

PERIOD_NS = NANOSECONDS_PER_SECOND


class WheelDiagnostics:
    """Publishes a node's diagnosis once a second of stamps, to subscribers."""

    def __init__(self, title: str) -> None:
        """Advertise the topic; `title` goes after the node's name."""
        self._title = title
        self._diagnostics = DisplayTopic(DIAGNOSTICS, DiagnosticArray, queue_size=10)

    def publish_when_due(self, stamp_ns: int, diagnose: Callable[[], Diagnosis]) -> None:
        """Publish what `diagnose` returns, if a second is over."""
        if self._diagnostics.is_due(PERIOD_NS, stamp_ns):
            message = DiagnosticArray(status=[wheel_status(self._title, diagnose())])
            message.header.stamp = stamp_from_ns(stamp_ns)
            self._diagnostics.publish(message)


def wheel_status(title: str, diagnosis: Diagnosis) -> DiagnosticStatus:
    """Convert a diagnosis."""
    return DiagnosticStatus(
        level=DiagnosticStatus.WARN if diagnosis.warning else DiagnosticStatus.OK,
        name=f'{rospy.get_name().lstrip("/")}: {title}',
        message=diagnosis.warning or 'OK',
        hardware_id='None',
        values=[KeyValue(key, f'{value:.6g}') for key, value in diagnosis.values.items()],
    )
