"""Encoders and odometry on /diagnostics."""

import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

from diff_encoder_sim.ros.wheel_output import WheelDiagnostics
from diff_encoder_sim.wheels.diagnostics import Diagnosis
from recorded_topic import RecordedTopic

MS = 1_000_000


def test_a_diagnosis_comes_once_a_second_of_stamps():
    diagnostics = object.__new__(WheelDiagnostics)
    diagnostics._title, diagnostics._diagnostics = 'Odometry', RecordedTopic()
    warnings = iter(['', 'lost reports: 3', ''])
    for stamp_ms in range(0, 2500, 50):
        diagnostics.publish_when_due(
            stamp_ms * MS, lambda: Diagnosis(next(warnings), {'lost reports': 3, 'counts per second, left': 80.125})
        )
    messages = diagnostics._diagnostics.take()
    assert [message.header.stamp.to_sec() for message in messages] == [0.0, 1.0, 2.0]
    statuses = [message.status[0] for message in messages]
    assert [(status.level, status.message) for status in statuses] == [(0, 'OK'), (1, 'lost reports: 3'), (0, 'OK')]
    assert statuses[0].name.endswith(': Odometry')
    assert [(value.key, value.value) for value in statuses[0].values] == [
        ('lost reports', '3'),
        ('counts per second, left', '80.125'),
    ]
