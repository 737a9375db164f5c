#!/usr/bin/env python3
"""The contract of odometry_fusion_node next to the nodes of the wheels. Started by fusion.test."""

import math
import time

import ros_testing as ros
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu
from std_msgs.msg import Bool
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.msg import EncoderPulse

NODE, TICK_NS, DISTANCE_PER_PULSE, SEPARATION = '/odometry_fusion_node', 10_000_000, math.pi * 0.2 / 1000, 0.4
WHEELS = ['left_wheel_joint', 'right_wheel_joint']
RATE = 0.5  # turn in place [rad/s]


class FusionTest(ros.NodeTest):
    @classmethod
    def setUpClass(cls):
        ros.start_test_node('fusion_test')
        cls.filtered = ros.Collector('/odometry/filtered', Odometry)
        cls.odom = ros.Collector('/odom', Odometry)
        cls.tf = ros.Collector('/tf', TFMessage)
        cls.slip = ros.Collector(f'{NODE}/slip', Bool)
        cls.diagnostics = ros.Collector('/diagnostics', DiagnosticArray)
        cls.pulses = ros.connected_publisher('/encoder_pulse', EncoderPulse, [NODE, '/gz_diff_odom_node'])
        cls.imu = ros.connected_publisher('/imu/data', Imu, [NODE])
        rospy.wait_for_service(f'{NODE}/reset', ros.TIMEOUT_S)
        cls.resets = [rospy.ServiceProxy(f'/{name}/reset', Empty) for name in (NODE[1:], 'gz_diff_odom_node')]
        cls.rosout = ros.RosoutWatch()

    def setUp(self):
        super().setUp()
        for reset in self.resets:
            reset()
        for collector in (self.filtered, self.odom, self.tf):
            collector.clear()

    def turn(self, first, last, rate=RATE, frame='imu_link', has_counts=True):
        """Send ticks of a turn in place; the wheels turn at RATE, the gyroscope measures `rate`, None: it is dead."""
        for tick in range(first, last):
            time.sleep(
                0.003
            )  # the topics have connections of their own: without a pause one would be ahead of the other
            stamp_ns = self.epoch_ns + tick * TICK_NS
            if rate is not None:
                self.imu.publish(Imu(header=ros.header(stamp_ns, frame), angular_velocity=Vector3(0.0, 0.0, rate)))
            if has_counts and tick % 5 == 0:
                count = round(0.5 * SEPARATION * RATE * 0.01 * tick / DISTANCE_PER_PULSE)
                self.pulses.publish(EncoderPulse(ros.header(stamp_ns, ''), WHEELS, (-count, count)))

    def assert_turned(self, tick):
        message = self.filtered.wait_for_stamp(self.epoch_ns + tick * TICK_NS)[-1]
        self.assertLess(ros.angle_between(ros.yaw_of(message.pose.pose.orientation), 0.01 * tick * RATE), 0.02)
        return message

    def test_each_report_gives_fused_odometry_and_the_only_transform(self):
        self.turn(0, 301)
        message = self.assert_turned(300)
        self.assert_stamps(self.filtered.messages, [self.epoch_ns + tick * TICK_NS for tick in range(0, 301, 5)])
        self.assertEqual((message.header.frame_id, message.child_frame_id), ('odom', 'base_link'))
        self.assertAlmostEqual(message.twist.twist.angular.z, RATE, delta=0.02)
        self.assertTrue(0.0 < message.pose.covariance[35] < 1e-3)
        self.odom.wait_for_count(61)
        transforms = [each for message in self.tf.wait_for_count(61) for each in message.transforms]
        self.assert_stamps(transforms, [self.epoch_ns + tick * TICK_NS for tick in range(0, 301, 5)])
        self.assertEqual({(each.header.frame_id, each.child_frame_id) for each in transforms}, {('odom', 'base_link')})

    def test_a_wrong_and_a_dead_imu_leave_the_wheels_with_one_warning(self):
        self.turn(0, 101)
        self.turn(101, 201, frame='camera')
        self.assert_turned(200)
        self.turn(201, 401, rate=ros.NAN)
        self.assert_turned(400)
        self.turn(401, 501)
        self.turn(501, 701, rate=None)
        self.assert_turned(700)
        for words in ("frame 'camera'", 'angular velocity nan', 'no sample for 0.5 s'):
            self.assert_warned_once(NODE, words)

    def test_wheels_that_turn_the_robot_otherwise_than_the_gyroscope_are_slip(self):
        self.turn(0, 301)
        self.assertFalse(self.slip.messages[-1].data)
        self.slip.clear()
        self.turn(301, 351, rate=0.0)
        self.turn(351, 501)
        self.assertEqual([each.data for each in self.slip.wait_for_count(2)], [True, False])
        message = self.filtered.wait_for_stamp(self.epoch_ns + 500 * TICK_NS)[-1]
        self.assertAlmostEqual(ros.yaw_of(message.pose.pose.orientation), 4.5 * RATE, delta=0.03)
        statuses = [status for message in self.diagnostics.messages for status in message.status]
        slips = [each.message for each in statuses if each.name == f'{NODE[1:]}: Slip']
        self.assertTrue(any('slip' in text for text in slips), slips)

    def test_dead_wheels_mean_no_motion(self):
        self.turn(0, 301)
        self.turn(301, 501, has_counts=False)
        message = self.filtered.wait_for_stamp(self.epoch_ns + 500 * TICK_NS)[-1]
        self.assertEqual((message.twist.twist.linear.x, message.twist.twist.angular.z), (0.0, 0.0))
        self.assertAlmostEqual(ros.yaw_of(message.pose.pose.orientation), 3.5 * RATE, delta=0.03)
        self.assert_warned_once(NODE, 'no counts for 0.5 s')


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'fusion', FusionTest)
