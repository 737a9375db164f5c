"""What move_base_node does when its own code fails; the rest is in test/rostest/move_base_test.py."""

import io
from types import SimpleNamespace

import pytest
from nav_msgs.msg import Odometry

from diff_encoder_sim.navigation.navigator_inputs import STOP, ControlRate
from diff_encoder_sim.ros.move_base_node import MoveBaseNode


def test_a_fault_in_the_control_period_stops_the_robot():
    """rospy logs an exception and goes on: the base would keep the last command."""
    node, commands, samples = object.__new__(MoveBaseNode), [], []
    node._navigator, node._transforms = (
        SimpleNamespace(take_odometry=samples.append),
        SimpleNamespace(odom_frame='odom'),
    )
    node._control_rate, node._command = ControlRate(20.0), commands.append

    def fail(*_):
        raise OverflowError

    node._control = fail
    message, content = Odometry(), io.BytesIO()
    message.pose.pose.orientation.w = 1.0
    message.twist.covariance[0], message.twist.covariance[35] = 4.0, -5.0  # negative: unknown
    message.serialize(content)
    with pytest.raises(OverflowError):
        node._on_odometry(content.getvalue())
    assert commands == [STOP]
    assert (samples[0].linear_std_mps, samples[0].angular_std_radps) == (2.0, 0.0)
