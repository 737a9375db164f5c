#!/usr/bin/env python3
"""The contract of gz_diff_encoder_node: /joint_states in, /encoder_pulse out. Started by encoder.test."""

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
    impossible_stamps_ns,
    stamp_from_ns,
    stamp_ns_of,
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
        cls.channels = {
            name: Channel(name)
            for name in ('plain', 'custom', 'split', 'not_finite', 'twice', 'no_position', 'missing')
        }
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

    def test_foreign_joints_in_between_change_nothing(self):
        plain = self.channels['plain']
        stamps = [self.epoch_ns + index * 10000000 for index in range(41)]
        for index, stamp_ns in enumerate(stamps):
            plain.send_wheels(stamp_ns, index + 0.5, 0.0)
            plain.send(stamp_ns, ['arm', 'gripper'], [NAN, 1e30])
            plain.send(stamp_ns + 3000000, ['arm'], [])
        reports = plain.pulses.wait_for_stamp(stamps[-1])
        self.assert_stamps(reports, stamps[::5])
        self.assertEqual(self.rosout.warnings_of(plain.node), [])

    def send_left(self, index):
        self.left.publish(self.one_wheel(LEFT, self.epoch_ns + index * 10000000, index + 0.5))

    def send_right(self, index):
        # this publisher samples 4 ms later
        self.right.publish(self.one_wheel(RIGHT, self.epoch_ns + 4000000 + index * 10000000, -index - 0.5))

    @staticmethod
    def one_wheel(joint, stamp_ns, pulses):
        message = JointState(name=[joint], position=[angle(pulses)])
        message.header.stamp = stamp_from_ns(stamp_ns)
        return message

    def check_split_reports(self, last_index):
        """Left has its sample on the boundary, right 4 ms later: the report is complete then, and says so."""
        split = self.channels['split']
        wanted = range(0, last_index + 1, 5)
        last_ns = self.epoch_ns + last_index * 10000000 + 4000000
        reports = split.pulses.wait_for_stamp(last_ns)
        complete = [(stamp_ns_of(report) - self.epoch_ns, tuple(report.pulses)) for report in reports]
        # The very first period opens with right's first sample, which is not on a boundary.
        self.assertEqual(
            complete[-len(wanted) + 1 :], [(index * 10000000 + 4000000, (index, -index - 1)) for index in wanted][1:]
        )
        self.assertLessEqual(len(complete), len(wanted))

    def test_wheels_from_two_publishers(self):
        self.left = connected_publisher(self.channels['split'].topic, JointState)
        self.right = self.left  # one connection keeps the order; the messages are what two publishers send
        for index in range(101):
            self.send_left(index)
            self.send_right(index)
        self.check_split_reports(100)
        self.assertEqual(self.rosout.warnings_of(self.channels['split'].node), [])

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

    def test_repeated_and_late_stamps_are_ignored(self):
        plain = self.channels['plain']
        steps = (0, 5, 5, 4, 0, 5, 10, 10, 3, 10, 15, 6)  # in 10 ms
        for index, step in enumerate(steps):
            plain.send_wheels(self.epoch_ns + step * 10000000, index + 0.5, 0.0)
        last_ns = self.epoch_ns + 20 * 10000000
        plain.send_wheels(last_ns, 99.5, 0.0)
        reports = plain.pulses.wait_for_stamp(last_ns)
        self.assert_stamps(reports, [self.epoch_ns + step * 10000000 for step in (0, 5, 10, 15, 20)])
        self.assertEqual([report.pulses[0] for report in reports], [0, 1, 6, 10, 99])
        self.assertEqual(self.rosout.warnings_of(plain.node), [])

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

    def test_stamps_that_cannot_be_are_dropped_with_one_warning(self):
        plain = self.channels['plain']
        impossible_ns = impossible_stamps_ns()
        plain.send_wheels(self.epoch_ns, 1.5, 2.5)
        for stamp_ns in impossible_ns:
            plain.send_wheels(stamp_ns, 1000.5, 1000.5)
        plain.send_wheels(self.epoch_ns + PERIOD_NS, 3.5, 4.5)
        reports = plain.pulses.wait_for_stamp(self.epoch_ns + PERIOD_NS)
        self.assert_stamps(reports, [self.epoch_ns, self.epoch_ns + PERIOD_NS])
        self.assertEqual([tuple(report.pulses) for report in reports], [(1, 2), (3, 4)])
        warned = self.rosout.wait_for_warning(plain.node, plain.topic, 'stamp 4294967296', 'allowed')
        self.assertEqual(len(warned), 1, warned)


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'encoder', EncoderTest)
