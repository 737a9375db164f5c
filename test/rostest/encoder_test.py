#!/usr/bin/env python3
"""The contract of gz_diff_encoder_node: /joint_states in, /encoder_pulse out. Started by wheels.test."""

import math
import time

import ros_testing as ros
import rostest
from sensor_msgs.msg import JointState

from diff_encoder_sim.msg import EncoderPulse

PPR = 40  # of the node in /plain
WHEELS = 'left_wheel_joint', 'right_wheel_joint'
TICK_NS = 10000000


class Channel:
    """A node's topics: joint messages in, pulse messages out."""

    def __init__(self, namespace):
        self.topic = f'/{namespace}/joint_states'
        self.node = f'/{namespace}/gz_diff_encoder_node'
        self.pulses = ros.Collector(f'/{namespace}/encoder_pulse', EncoderPulse)
        self._joints = ros.connected_publisher(self.topic, JointState)

    def send(self, stamp_ns, names, angles):
        message = JointState(name=names, position=angles)
        message.header.stamp = ros.stamp_from_ns(stamp_ns)
        self._joints.publish(message)


class EncoderTest(ros.NodeTest):
    @classmethod
    def setUpClass(cls):
        ros.start_test_node('encoder_test')
        cls.channels = {name: Channel(name) for name in ('plain', 'custom')}
        cls.rosout = ros.RosoutWatch()

    def setUp(self):
        super().setUp()
        for channel in self.channels.values():
            channel.pulses.clear()

    def test_each_wheel_has_its_own_ppr_whatever_the_joints_are_called_and_ordered(self):
        custom, one_third = self.channels['custom'], 2.0 * math.pi / 3.0
        custom.send(self.epoch_ns, ['wheel_r', 'arm', 'wheel_l'], [one_third, ros.NAN, -one_third])
        custom.send(self.epoch_ns + ros.PERIOD_NS, ['wheel_l', 'wheel_r', 'arm'], [one_third, -one_third, 0.0])
        reports = custom.pulses.wait_for_count(2)
        self.assertEqual([tuple(report.pulses) for report in reports], [(-14, 341), (13, -342)])  # equation (1)
        self.assertEqual(list(reports[0].name), ['wheel_l', 'wheel_r'])

    def test_100_hz_gives_a_report_each_50_ms_also_in_bursts_and_after_a_jump_back(self):
        """One report at each boundary, with that sample's own stamp and count; a jump back has one warning."""
        plain, starts, expected = self.channels['plain'], (self.epoch_ns, self.epoch_ns - 700 * ros.NS_PER_S), []
        for start_ns in starts:
            for index in range(101):
                if index % 37 == 0:
                    time.sleep(0.15)  # three periods of wall time with nothing, then as fast as it goes
                angle_rad = (index + 0.5) * 2.0 * math.pi / PPR
                plain.send(start_ns + index * TICK_NS, WHEELS, [angle_rad, -angle_rad])
            expected += [(start_ns + index * TICK_NS, index) for index in range(0, 101, 5)]
        reports = plain.pulses.wait_for_stamp(expected[-1][0])
        self.assert_stamps(reports, [stamp_ns for stamp_ns, _ in expected])
        self.assertEqual([tuple(report.pulses) for report in reports], [(index, -index - 1) for _, index in expected])
        self.assert_warned_once(plain.node, 'back')


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'encoder', EncoderTest)
