#!/usr/bin/env python3
"""The contracts of gz_diff_encoder_node and gz_diff_odom_node. Started by wheels.test."""

import math
import time

import ros_testing as ros
import rosgraph
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.msg import EncoderPulse
from diff_encoder_sim.ros.messages import pose_from_message

DISTANCE_PER_PULSE = math.pi * 0.2 / 90  # the plain node's [m]
SEPARATION = 0.4


WHEELS = ['left_wheel_joint', 'right_wheel_joint']
TICK_NS = 10000000


class EncoderChannel:
    """An encoder's topics: joint messages in, pulse messages out."""

    def __init__(self, namespace):
        self.node = f'/{namespace}/gz_diff_encoder_node'
        self.pulses = ros.Collector(f'/{namespace}/encoder_pulse', EncoderPulse)
        self._joints = ros.connected_publisher(f'/{namespace}/joint_states', JointState)

    def send(self, stamp_ns, names, angles):
        self._joints.publish(JointState(ros.header(stamp_ns, ''), names, angles, (), ()))


class Channel:
    """A node's topics: pulse counts in, odometry and TF out."""

    def __init__(self, namespace, with_tf):
        self._with_tf = with_tf
        self.node = f'/{namespace}/gz_diff_odom_node'
        self.odom = ros.Collector(f'/{namespace}/odom', Odometry)
        self.tf = ros.Collector(f'/{namespace}/tf', TFMessage, wait_for_publisher=with_tf)
        self._pulses = ros.connected_publisher(f'/{namespace}/encoder_pulse', EncoderPulse)
        rospy.wait_for_service(self.node + '/reset', ros.TIMEOUT_S)
        self.reset = rospy.ServiceProxy(self.node + '/reset', Empty)

    def send(self, stamp_ns, *pulses):
        self._pulses.publish(EncoderPulse(ros.header(stamp_ns, ''), WHEELS, pulses))

    def clear(self):
        if self._with_tf:  # it comes over a connection of its own, maybe later
            self.tf.wait_for_count(len(self.odom.messages))
        self.odom.clear()
        self.tf.clear()


def twist_of(message):
    return message.twist.twist.linear.x, message.twist.twist.angular.z


class WheelsTest(ros.NodeTest):
    @classmethod
    def setUpClass(cls):
        ros.start_test_node('wheels_test')
        cls.encoders = {name: EncoderChannel(name) for name in ('plain', 'custom')}
        cls.channels = {name: Channel(name, name != 'measured') for name in ('by_default', 'all_set', 'measured')}
        cls.speeds = ros.connected_publisher('/measured/encoder_velocity', JointState)
        cls.commands = ros.connected_publisher('/by_default/cmd_vel', Twist)
        cls.rosout = ros.RosoutWatch()

    def setUp(self):
        super().setUp()
        for channel in self.channels.values():
            channel.reset()
            channel.clear()
        for encoder in self.encoders.values():
            encoder.pulses.clear()

    # --- encoders

    def test_each_wheel_has_its_own_ppr_whatever_the_joints_are_called_and_ordered(self):
        custom, one_third = self.encoders['custom'], 2.0 * math.pi / 3.0
        custom.send(self.epoch_ns, ['wheel_r', 'arm', 'wheel_l'], [one_third, ros.NAN, -one_third])
        custom.send(self.epoch_ns + ros.PERIOD_NS, ['wheel_l', 'wheel_r', 'arm'], [one_third, -one_third, 0.0])
        reports = custom.pulses.wait_for_count(2)
        self.assertEqual([tuple(report.pulses) for report in reports], [(-14, 341), (13, -342)])  # equation (1)
        self.assertEqual(list(reports[0].name), ['wheel_l', 'wheel_r'])

    def test_100_hz_gives_a_report_each_50_ms_also_in_bursts_and_after_a_jump_back(self):
        """One report at each boundary, with that sample's own stamp and count; a jump back has one warning."""
        plain, starts, expected = self.encoders['plain'], (self.epoch_ns, self.epoch_ns - 700 * ros.NS_PER_S), []
        for start_ns in starts:
            for index in range(101):
                if index % 37 == 0:
                    time.sleep(0.15)  # three periods of wall time with nothing, then as fast as it goes
                angle_rad = (index + 0.5) * 2.0 * math.pi / 40
                plain.send(start_ns + index * TICK_NS, WHEELS, [angle_rad, -angle_rad])
            expected += [(start_ns + index * TICK_NS, index) for index in range(0, 101, 5)]
        reports = plain.pulses.wait_for_stamp(expected[-1][0])
        self.assert_stamps(reports, [stamp_ns for stamp_ns, _ in expected])
        self.assertEqual([tuple(report.pulses) for report in reports], [(index, -index - 1) for _, index in expected])
        self.assert_warned_once(plain.node, 'back')

    # --- odometry

    def drive(self, channel, counts, interval_ns=ros.PERIOD_NS):
        """Report a list of (left, right) counts; returns one odometry message for each."""
        for index, (left, right) in enumerate(counts):
            channel.send(self.epoch_ns + index * interval_ns, left, right)
        messages = channel.odom.wait_for_count(len(counts))
        self.assert_stamps(messages, [self.epoch_ns + index * interval_ns for index in range(len(counts))])
        return messages

    def assert_pose(self, message, x, y, yaw, tolerance=1e-9):
        given = pose_from_message(message.pose.pose)
        self.assertLess(max(map(abs, given.relative_to(Pose2D(x, y, yaw)))), tolerance, given)

    def test_wheels_frames_and_window_as_parameters(self):
        left_m, right_m = math.pi * 0.3 / 40, math.pi * 0.303 / 1024
        totals = [(0, 0), (1, 30), (3, 60), (6, 90), (10, 120), (15, 150), (21, 180)]
        messages = self.drive(self.channels['all_set'], totals)
        self.assertEqual((messages[0].header.frame_id, messages[0].child_frame_id), ('wheel_odom', 'robot'))
        left, right = (21 - 3) * left_m / 0.2, (180 - 60) * right_m / 0.2  # over four intervals
        linear, angular = twist_of(messages[-1])
        self.assertAlmostEqual(linear, 0.5 * (left + right), delta=1e-9)
        self.assertAlmostEqual(angular, (right - left) / 0.5, delta=1e-9)
        yaw = (180 * right_m - 21 * left_m) / 0.5
        self.assertLess(ros.angle_between(pose_from_message(messages[-1].pose.pose).yaw_rad, yaw), 1e-9)
        tf = self.channels['all_set'].tf.wait_for_count(len(messages))
        transforms = [transform for message in tf for transform in message.transforms]
        self.assertEqual(list(map(ros.stamp_ns_of, transforms)), list(map(ros.stamp_ns_of, messages)))
        for transform, message in zip(transforms, messages):
            self.assertEqual(transform.header.frame_id, message.header.frame_id)
            self.assertEqual(transform.child_frame_id, message.child_frame_id)
            place = transform.transform.translation
            self.assertEqual((place.x, place.y), pose_from_message(message.pose.pose)[:2])
            self.assertEqual(transform.transform.rotation, message.pose.pose.orientation)

    def send_speeds(self, stamp_ns, *speeds_radps):
        self.speeds.publish(JointState(ros.header(stamp_ns, ''), WHEELS, (), speeds_radps, ()))

    def test_measured_speeds_make_the_twist_whichever_comes_first_and_are_not_waited_for_long(self):
        measured = self.channels['measured']
        for step in range(20):
            stamp_ns = self.epoch_ns + step * ros.PERIOD_NS
            if step % 2:
                self.send_speeds(stamp_ns, 2.0, 3.0)
            measured.send(stamp_ns, step, step)
            if not step % 2:
                self.send_speeds(stamp_ns, 2.0, 3.0)
        messages = measured.odom.wait_for_count(20)
        self.assert_stamps(messages, [self.epoch_ns + step * ros.PERIOD_NS for step in range(20)])
        for message in messages:
            linear, angular = twist_of(message)
            self.assertAlmostEqual(linear, 0.1 * 2.5)
            self.assertAlmostEqual(angular, 0.1 * 1.0 / SEPARATION)
        self.assert_pose(messages[-1], 19 * DISTANCE_PER_PULSE, 0.0, 0.0)
        publishers = dict(rosgraph.Master(rospy.get_name()).getSystemState()[0])
        self.assertIn('/by_default/tf', publishers)  # shows that the next line can fail
        self.assertNotIn('/measured/tf', publishers)  # publish_tf: false
        self.epoch_ns += 10 * ros.NS_PER_S
        self.send_speeds(self.epoch_ns, math.nan, 1.0)  # and no more of them: nothing is held back for long
        for step in range(20, 50):
            measured.send(self.epoch_ns + step * ros.PERIOD_NS, step, step)
            time.sleep(0.03)
        measured.odom.wait_for_count(50)
        self.rosout.wait_for_warning(measured.node, 'encoder_velocity', 'nan')

    def test_diagnostics_tell_lost_reports_and_wheels_that_do_not_follow(self):
        plain = self.channels['by_default']
        diagnostics = ros.Collector('/diagnostics', DiagnosticArray)
        self.drive(plain, [(0, 0)])
        for step in [*range(1, 40), *range(43, 120)]:
            if step % 5 == 0:
                self.commands.publish(Twist())
                time.sleep(0.05)  # a connection of its own
            plain.send(self.epoch_ns + step * ros.PERIOD_NS, 3 * step, 3 * step)
        plain.odom.wait_for_stamp(self.epoch_ns + 119 * ros.PERIOD_NS)
        statuses = [status for message in diagnostics.messages for status in message.status]
        told = ' '.join(status.message for status in statuses if status.name.startswith(plain.node.lstrip('/')))
        self.assertIn('lost reports: 3', told)
        self.assertIn('left wheel has not followed the command', told)
        self.assertEqual({status.level for status in statuses} - {DiagnosticStatus.OK, DiagnosticStatus.WARN}, set())

    def test_reset_service(self):
        plain = self.channels['by_default']
        self.drive(plain, [(0, 0), (10, 20)])
        plain.reset()
        plain.clear()
        self.epoch_ns += ros.NS_PER_S
        messages = self.drive(plain, [(15, 25), (19, 29)])
        self.assert_pose(messages[0], 0.0, 0.0, 0.0)
        self.assert_pose(messages[1], 4 * DISTANCE_PER_PULSE, 0.0, 0.0)
        self.assertEqual(twist_of(messages[0]), (0.0, 0.0))


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'wheels', WheelsTest)
