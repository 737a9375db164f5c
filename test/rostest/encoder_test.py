#!/usr/bin/env python3
"""The contract of gz_diff_encoder_node: /joint_states in, /encoder_pulse out. Started by wheels.test."""

import math
import time

import rostest
from ros_testing import (
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

PPR = 40  # of every node but the one in /custom
LEFT, RIGHT = 'left_wheel_joint', 'right_wheel_joint'
INF, NAN = float('inf'), float('nan')


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


def angle(pulses, ppr=PPR):
    return pulses * 2.0 * math.pi / ppr


def first_at_each_boundary(stamps_ns):
    """The stamps that a 20 Hz report has, written down plainly: one for each 50 ms that a stamp falls into."""
    chosen = []
    for previous_ns, stamp_ns in zip(stamps_ns, stamps_ns[1:]):
        if stamp_ns // PERIOD_NS > previous_ns // PERIOD_NS:
            chosen.append(stamp_ns)
    if stamps_ns[0] % PERIOD_NS == 0:
        chosen.insert(0, stamps_ns[0])
    return chosen


class EncoderTest(NodeTest):
    @classmethod
    def setUpClass(cls):
        start_test_node('encoder_test')
        cls.channels = {name: Channel(name) for name in ('plain', 'custom', 'not_finite', 'missing')}
        cls.rosout = RosoutWatch()

    def setUp(self):
        super().setUp()
        for channel in self.channels.values():
            channel.pulses.clear()

    # --- equation (1) -------------------------------------------------------------------------------------------------

    def test_each_wheel_has_its_own_ppr_whatever_the_joints_are_called_and_ordered(self):
        custom = self.channels['custom']
        turns = 1.0 / 3.0
        one_third = 2.0 * math.pi * turns
        custom.send(self.epoch_ns, ['wheel_r', 'arm', 'wheel_l'], [one_third, NAN, -one_third])
        custom.send(self.epoch_ns + PERIOD_NS, ['wheel_l', 'wheel_r', 'arm'], [one_third, -one_third, 0.0])
        reports = custom.pulses.wait_for_count(2)
        self.assertEqual([tuple(report.pulses) for report in reports], [(-14, 341), (13, -342)])
        self.assertEqual(list(reports[0].name), ['wheel_l', 'wheel_r'])

    # --- 20 Hz on the stamps ------------------------------------------------------------------------------------------

    def check_reports_of(self, stamps_ns):
        """One report at each boundary, with that sample's own stamp and count, and no other."""
        plain = self.channels['plain']
        for index, stamp_ns in enumerate(stamps_ns):
            plain.send_wheels(stamp_ns, index + 0.5, -index - 0.5)
        expected = first_at_each_boundary(stamps_ns)
        reports = plain.pulses.wait_for_stamp(expected[-1])
        self.assert_stamps(reports, expected)
        indices = [stamps_ns.index(stamp_ns) for stamp_ns in expected]
        self.assertEqual([tuple(report.pulses) for report in reports], [(index, -index - 1) for index in indices])

    def test_100_hz_gives_a_report_each_50_ms(self):
        stamps = [self.epoch_ns + index * 10000000 for index in range(201)]
        self.assertEqual(len(first_at_each_boundary(stamps)), 41)
        self.check_reports_of(stamps)

    def test_arrival_in_bursts_changes_nothing(self):
        plain = self.channels['plain']
        stamps = [self.epoch_ns + index * 10000000 for index in range(101)]
        for index, stamp_ns in enumerate(stamps):
            if index % 37 == 0:
                time.sleep(0.15)  # three periods of wall time with nothing, then as fast as it goes
            plain.send_wheels(stamp_ns, index + 0.5, 0.0)
        expected = first_at_each_boundary(stamps)
        reports = plain.pulses.wait_for_stamp(expected[-1])
        self.assert_stamps(reports, expected)

    # --- several publishers -------------------------------------------------------------------------------------------

    # --- bad input ----------------------------------------------------------------------------------------------------

    def check_fault(self, namespace, faulty, *words):
        """`faulty(stamp_ns)` sends bad messages between two good ones: no report of them, one warning, state kept."""
        channel = self.channels[namespace]
        channel.send_wheels(self.epoch_ns, 10.5, 20.5)
        for step in range(1, 20):
            faulty(self.epoch_ns + step * 10000000)
        good_ns = self.epoch_ns + 20 * 10000000
        channel.send_wheels(good_ns, 11.5, 21.5)
        reports = channel.pulses.wait_for_stamp(good_ns)
        self.assert_stamps(reports, [self.epoch_ns, good_ns])
        self.assertEqual([tuple(report.pulses) for report in reports], [(10, 20), (11, 21)])
        warned = self.rosout.wait_for_warning(channel.node, channel.topic, *words)
        self.assertEqual(len(warned), 1, warned)

    def test_angle_that_is_not_finite(self):
        channel = self.channels['not_finite']
        bad = (NAN, INF, -INF, 1e300)

        def faulty(stamp_ns):
            channel.send(stamp_ns, [LEFT, RIGHT], [angle(10.5), bad[stamp_ns // 10000000 % 4]])

        self.check_fault('not_finite', faulty, RIGHT)

    def test_misspelt_joint_is_named_with_what_is_there(self):
        channel = self.channels['missing']
        for index in range(130):
            channel.send_wheels(self.epoch_ns + index * 10000000, 1.5, 1.5)
        warned = self.rosout.wait_for_warning(channel.node, channel.topic, 'rigth_wheel_joint', RIGHT)
        self.assertEqual(len(warned), 1, warned)
        # The node still counts when the joint comes, and nothing came before it.
        last_ns = self.epoch_ns + 2 * NS_PER_S
        channel.send(last_ns, [LEFT, 'rigth_wheel_joint'], [angle(3.5), angle(4.5)])
        reports = channel.pulses.wait_for_stamp(last_ns)
        self.assert_stamps(reports, [last_ns])
        self.assertEqual(tuple(reports[0].pulses), (3, 4))

    def test_time_that_jumps_back_goes_on_with_one_warning(self):
        plain = self.channels['plain']
        earlier_ns = self.epoch_ns - 700 * NS_PER_S
        for start_ns in (self.epoch_ns, earlier_ns):
            for index in range(11):
                plain.send_wheels(start_ns + index * 10000000, index + 0.5, 0.0)
        reports = plain.pulses.wait_for_stamp(earlier_ns + 10 * 10000000)
        expected = [start_ns + step * 10000000 for start_ns in (self.epoch_ns, earlier_ns) for step in (0, 5, 10)]
        self.assert_stamps(reports, expected)
        self.assertEqual([report.pulses[0] for report in reports], [0, 5, 10] * 2)
        warned = self.rosout.wait_for_warning(plain.node, 'back')
        self.assertEqual(len(warned), 1, warned)


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'encoder', EncoderTest)
