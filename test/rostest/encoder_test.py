#!/usr/bin/env python3
"""The contract of gz_diff_encoder_node: /joint_states in, /encoder_pulse out. Started by wheels.test."""

import math
import time

import rostest
from ros_testing import (
    INF,
    NAN,
    NS_PER_S,
    PERIOD_NS,
    Collector,
    NodeTest,
    RosoutWatch,
    connected_publisher,
    stamp_from_ns,
    start_test_node,
)
from sensor_msgs.msg import JointState

from diff_encoder_sim.msg import EncoderPulse

PPR = 40  # of every node except the one in /custom
LEFT, RIGHT = 'left_wheel_joint', 'right_wheel_joint'
TICK_NS = 10000000


class Channel:
    """A node's topics: joint messages in, pulse messages out."""

    def __init__(self, namespace):
        self.topic = f'/{namespace}/joint_states'
        self.node = f'/{namespace}/gz_diff_encoder_node'
        self.pulses = Collector(f'/{namespace}/encoder_pulse', EncoderPulse)
        self._joints = connected_publisher(self.topic, JointState)

    def send(self, stamp_ns, names, angles):
        message = JointState(name=names, position=angles)
        message.header.stamp = stamp_from_ns(stamp_ns)
        self._joints.publish(message)

    def send_wheels(self, stamp_ns, left_pulses, right_pulses):
        """The wheels at angles given in pulses."""
        self.send(stamp_ns, [LEFT, RIGHT], [angle(left_pulses), angle(right_pulses)])


def angle(pulses):
    return pulses * 2.0 * math.pi / PPR


class EncoderTest(NodeTest):
    @classmethod
    def setUpClass(cls):
        start_test_node('encoder_test')
        cls.channels = {name: Channel(name) for name in ('plain', 'custom', 'missing')}
        cls.rosout = RosoutWatch()

    def setUp(self):
        super().setUp()
        for channel in self.channels.values():
            channel.pulses.clear()

    def test_each_wheel_has_its_own_ppr_whatever_the_joints_are_called_and_ordered(self):
        custom, one_third = self.channels['custom'], 2.0 * math.pi / 3.0
        custom.send(self.epoch_ns, ['wheel_r', 'arm', 'wheel_l'], [one_third, NAN, -one_third])
        custom.send(self.epoch_ns + PERIOD_NS, ['wheel_l', 'wheel_r', 'arm'], [one_third, -one_third, 0.0])
        reports = custom.pulses.wait_for_count(2)
        self.assertEqual([tuple(report.pulses) for report in reports], [(-14, 341), (13, -342)])  # equation (1)
        self.assertEqual(list(reports[0].name), ['wheel_l', 'wheel_r'])

    def test_100_hz_gives_a_report_each_50_ms_also_in_bursts_and_after_a_jump_back(self):
        """One report at each boundary, with that sample's own stamp and count; a jump back has one warning."""
        plain, starts, expected = self.channels['plain'], (self.epoch_ns, self.epoch_ns - 700 * NS_PER_S), []
        for start_ns in starts:
            for index in range(101):
                if index % 37 == 0:
                    time.sleep(0.15)  # three periods of wall time with nothing, then as fast as it goes
                plain.send_wheels(start_ns + index * TICK_NS, index + 0.5, -index - 0.5)
            expected += [(start_ns + index * TICK_NS, index) for index in range(0, 101, 5)]
        reports = plain.pulses.wait_for_stamp(expected[-1][0])
        self.assert_stamps(reports, [stamp_ns for stamp_ns, _ in expected])
        self.assertEqual([tuple(report.pulses) for report in reports], [(index, -index - 1) for _, index in expected])
        self.assert_warned_once(plain.node, 'back')

    def test_angle_that_is_not_finite_is_dropped_with_one_warning(self):
        plain, bad = self.channels['plain'], (NAN, INF, -INF, 1e300)
        plain.send_wheels(self.epoch_ns, 10.5, 20.5)
        for step in range(1, 20):
            plain.send(self.epoch_ns + step * TICK_NS, [LEFT, RIGHT], [angle(10.5), bad[step % 4]])
        good_ns = self.epoch_ns + 20 * TICK_NS
        plain.send_wheels(good_ns, 11.5, 21.5)
        reports = plain.pulses.wait_for_stamp(good_ns)
        self.assert_stamps(reports, [self.epoch_ns, good_ns])
        self.assertEqual([tuple(report.pulses) for report in reports], [(10, 20), (11, 21)])
        self.assert_warned_once(plain.node, plain.topic, RIGHT)

    def test_misspelt_joint_is_named_with_what_is_there(self):
        missing = self.channels['missing']
        for index in range(130):
            missing.send_wheels(self.epoch_ns + index * TICK_NS, 1.5, 1.5)
        self.assert_warned_once(missing.node, missing.topic, 'rigth_wheel_joint', RIGHT)
        # The node still counts when the joint comes, and nothing came before it.
        last_ns = self.epoch_ns + 2 * NS_PER_S
        missing.send(last_ns, [LEFT, 'rigth_wheel_joint'], [angle(3.5), angle(4.5)])
        (report,) = missing.pulses.wait_for_stamp(last_ns)
        self.assertEqual(tuple(report.pulses), (3, 4))


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'encoder', EncoderTest)
