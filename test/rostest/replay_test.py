#!/usr/bin/env python3
"""`rosbag play --clock --loop` through the encoder and the odometry. Started by replay.test."""

import math
import os
import random
import shutil
import signal
import subprocess
import tempfile

import rosbag
import rostest
from nav_msgs.msg import Odometry
from ros_testing import NS_PER_S, Collector, NodeTest, RosoutWatch, stamp_from_ns, stamp_ns_of, start_test_node, yaw_of
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.msg import EncoderPulse

PPR = 40
START_NS = 100 * NS_PER_S
TICK_NS = 10000000
DURATION_TICKS = 400
LOOPS = 3
FASTER = 4  # than recorded


def write_drive(path):
    """A drive of 4 s along a bend, recorded at 100 Hz; returns {stamp: wheel angles}."""
    phases = [random.Random(5).uniform(0.0, 2.0 * math.pi) for _ in range(2)]
    angles = {}
    with rosbag.Bag(path, 'w') as bag:
        for tick in range(DURATION_TICKS + 1):
            stamp_ns = START_NS + tick * TICK_NS
            angles[stamp_ns] = [phases[0] + 0.03 * tick, phases[1] + 0.04 * tick]
            message = JointState(name=['right_wheel_joint', 'left_wheel_joint'], position=angles[stamp_ns][::-1])
            message.header.stamp = stamp_from_ns(stamp_ns)
            bag.write('/joint_states', message, message.header.stamp)
    return angles


def loops_of(messages):
    """The messages, cut where time jumps back."""
    loops = [[]]
    for message in messages:
        if loops[-1] and stamp_ns_of(message) < stamp_ns_of(loops[-1][-1]):
            loops.append([])
        loops[-1].append(message)
    return loops


class ReplayTest(NodeTest):
    @classmethod
    def setUpClass(cls):
        start_test_node('replay_test')
        cls.pulses = Collector('/encoder_pulse', EncoderPulse)
        cls.odom = Collector('/odom', Odometry)
        cls.tf = Collector('/tf', TFMessage)
        cls.rosout = RosoutWatch()
        cls.folder = tempfile.mkdtemp()

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def test_bag_in_a_loop(self):
        bag = os.path.join(self.folder, 'drive.bag')
        angles = write_drive(bag)
        with open(os.path.join(self.folder, 'play.txt'), 'w') as out:
            player = subprocess.Popen(
                ['rosbag', 'play', '--quiet', '--clock', '--loop', '-d', '1', '-r', str(FASTER), bag],
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=out,
            )
        try:
            self.odom.wait_for(lambda messages: len(loops_of(messages)) > LOOPS, 'the fourth time round', 60.0)
        finally:
            player.send_signal(signal.SIGINT)
            player.wait(20.0)
        self.check(angles)

    def check(self, angles):
        # The last loop is cut off. The first may lack its beginning, which is played before all are connected.
        pulse_loops, odom_loops = (loops_of(collector.messages)[:LOOPS] for collector in (self.pulses, self.odom))
        reports = list(range(START_NS, START_NS + DURATION_TICKS * TICK_NS + 1, 5 * TICK_NS))
        for index, (pulse_loop, odom_loop) in enumerate(zip(pulse_loops, odom_loops)):
            stamps = [stamp_ns_of(message) for message in pulse_loop]
            self.assertEqual(stamps, reports[-len(stamps) :] if index == 0 else reports)
            self.assertEqual([stamp_ns_of(message) for message in odom_loop], stamps)
            self.check_pulses(pulse_loop, angles)
            self.check_odometry(pulse_loop, odom_loop)
        self.check_warnings()

    def check_pulses(self, loop, angles):
        for message in loop:
            self.assertEqual(
                list(message.pulses),
                [math.floor(angle * PPR / (2.0 * math.pi)) for angle in angles[stamp_ns_of(message)]],
            )

    def check_odometry(self, pulse_loop, odom_loop):
        """From zero each time, with the heading that the counts say."""
        first = pulse_loop[0].pulses
        position = odom_loop[0].pose.pose.position
        self.assertEqual((position.x, position.y, yaw_of(odom_loop[0].pose.pose.orientation)), (0.0, 0.0, 0.0))
        for pulses, odometry in zip(pulse_loop, odom_loop):
            left, right = (pulses.pulses[wheel] - first[wheel] for wheel in (0, 1))
            yaw = (right - left) * math.pi * 0.2 / PPR / 0.4
            self.assertAlmostEqual(yaw_of(odometry.pose.pose.orientation), yaw, delta=1e-9)
            self.assertTrue(math.isfinite(odometry.pose.pose.position.x + odometry.pose.pose.position.y))
        self.assertGreater(odom_loop[-1].pose.pose.position.x, 0.5)

    def check_warnings(self):
        """Each node says that time jumped back; not more than once a loop."""
        for node in ('/gz_diff_encoder_node', '/gz_diff_odom_node'):
            warned = self.rosout.wait_for_warning(node, 'back')
            self.assertLessEqual(len(warned), LOOPS, warned)


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'replay', ReplayTest)
