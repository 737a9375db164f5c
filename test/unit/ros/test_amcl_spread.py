"""Standard deviations on /diagnostics."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.ros.amcl_node import AmclSpread
from recorded_topic import RecordedTopic


def test_the_status_comes_once_a_period_with_the_limits_in_force():
    spread = object.__new__(AmclSpread)
    spread._period_ns, spread._diagnostics = 2e9, RecordedTopic()
    estimate = SimpleNamespace(covariance=np.diag([0.04, 0.01, 0.0025]))
    for second in range(5):
        spread.diagnose(estimate, AmclParams(std_warn_level_x=0.15 if second > 1 else 0.5), second * 10**9)
    statuses = [message.status[0] for message in spread._diagnostics.take()]
    assert [status.message for status in statuses] == ['OK', 'Too large', 'Too large']
    assert [(pair.key, pair.value) for pair in statuses[1].values] == [
        ('std_x', '0.2'),
        ('std_y', '0.1'),
        ('std_yaw', '0.05'),
        ('std_warn_level_x', '0.15'),
        ('std_warn_level_y', '0.2'),
        ('std_warn_level_yaw', '0.1'),
    ]
