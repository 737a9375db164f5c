"""What move_base_node does when its own code fails; the rest is in test/rostest/move_base_test.py."""

import threading

import pytest
from nav_msgs.msg import Odometry

from diff_encoder_sim.navigation.navigator_inputs import STOP, ControlRate
from diff_encoder_sim.ros.move_base_node import MoveBaseNode


class Anything:
    """Takes every call."""

    def __getattr__(self, _):
        return lambda *_: None


def test_a_fault_in_the_control_period_stops_the_robot():
    """rospy logs an exception and goes on: the base would keep the last command."""
    node, commands = object.__new__(MoveBaseNode), []
    node._lock, node._navigator, node._transforms = threading.RLock(), Anything(), Anything()
    node._control_rate, node._command = ControlRate(20.0), commands.append

    def fail(*_):
        raise OverflowError

    node._control = fail
    message = Odometry()
    message.pose.pose.orientation.w = 1.0
    with pytest.raises(OverflowError):
        node._on_odometry(message)
    assert commands == [STOP]
