#!/usr/bin/env python3
"""Joint states faster than a robot sends them: none is lost, and memory stays as it is. Started by wheels.test."""

import contextlib
import math
import os
import time
from pathlib import Path
from xmlrpc.client import ServerProxy

import ros_testing as ros
import rosgraph
import rospy
import rostest
import yaml
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.msg import EncoderPulse
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder

RATE_HZ, JOINTS, PPR = 1000, 50, 90
WHEELS = ('left_wheel_joint', 'right_wheel_joint')
PAIRS = ('usual', 'real')
REAL = yaml.safe_load((Path(__file__).parent / 'data' / 'real_encoder.yaml').read_text())
BURST = 5000
NODES = [f'/{pair}/gz_diff_{kind}_node' for pair in PAIRS for kind in ('encoder', 'odom')]
MB = 2**20
FLAT_MB = 2.0  # growth that is no leak: a leak of 100 bytes a message is 6 MB a minute


class JointRateTest(ros.NodeTest):
    @classmethod
    def setUpClass(cls):
        ros.start_test_node('joint_rate')
        cls.seconds = rospy.get_param('~seconds', 2)
        cls.joints = ros.connected_publisher('/joint_states', JointState, NODES[::2])
        cls.pulses = {pair: ros.Collector(f'/{pair}/encoder_pulse', EncoderPulse) for pair in PAIRS}
        cls.odom = {pair: ros.Collector(f'/{pair}/odom', Odometry) for pair in PAIRS}
        cls.real = ReportingEncoder(EncoderParams.from_mapping(REAL, 'real_encoder.yaml'))
        cls.rosout = ros.RosoutWatch()
        master = rosgraph.Master(rospy.get_name())
        cls.pids = {node: ServerProxy(master.lookupNode(node)).getPid('/joint_rate')[2] for node in NODES}
        cls.warm_up()

    @classmethod
    def warm_up(cls):
        """Send until each topic has come: a publisher may not have added a connection that its subscriber has."""
        stamp_ns = ros.NS_PER_S
        while not all(collector.messages for collector in (*cls.pulses.values(), *cls.odom.values())):
            assert stamp_ns < ros.NodeTest._epoch_s * ros.NS_PER_S, 'a node does not answer'
            stamp_ns += ros.PERIOD_NS
            cls.publish(stamp_ns, 0.01)
            cls.real.update(stamp_ns, WHEELS, [0.01, 0.01])
            time.sleep(0.05)
        for collector in (*cls.pulses.values(), *cls.odom.values()):
            collector.wait_for_stamp(stamp_ns, timeout_s=60.0)

    def setUp(self):
        super().setUp()
        for collector in (*self.pulses.values(), *self.odom.values()):
            collector.clear()

    def stamp_ns(self, index):
        return self.epoch_ns + index * ros.NS_PER_S // RATE_HZ

    @classmethod
    def publish(cls, stamp_ns, wheel_rad):
        """The two wheels among other joints."""
        names = [*WHEELS, *(f'arm_{number}_joint' for number in range(JOINTS - 2))]
        message = JointState(name=names, position=[wheel_rad] * JOINTS, velocity=[1.0] * JOINTS)
        message.header.stamp = ros.stamp_from_ns(stamp_ns)
        cls.joints.publish(message)

    def angle(self, index):
        return 3.0 * index / RATE_HZ + 0.01  # 3 rad/s, never on the edge of a pulse

    def check_answers(self, count, lost=()):
        """Every message is answered at 1000 Hz, and each 50 ms at 20 Hz, with the pulses of its own angle."""
        last = count - 1
        for pair, step in zip(PAIRS, (ros.PERIOD_NS * RATE_HZ // ros.NS_PER_S, 1)):
            sent = [index for index in range(0, count, step) if index not in lost]
            for collector in (self.odom[pair], self.pulses[pair]):  # over connections of their own
                collector.wait_for_stamp(self.stamp_ns(last // step * step), timeout_s=120.0)
            self.assert_stamps(self.odom[pair].messages, [self.stamp_ns(index) for index in sent])
            reports = self.pulses[pair].messages
            self.assertEqual([ros.stamp_ns_of(report) for report in reports], [self.stamp_ns(index) for index in sent])
            expected = self.real_counts(count, lost) if pair == 'real' else [self.count(index) for index in sent]
            self.assertEqual([report.pulses[0] for report in reports], expected)

    def count(self, index):
        """Equation (1)."""
        return math.floor(self.angle(index) * PPR / (2.0 * math.pi))

    def real_counts(self, count, lost):
        """What the core counts by the same messages; errors of the encoder go on from test to test."""
        samples = []
        for index in range(count):
            angle = math.nan if index in lost else self.angle(index)
            with contextlib.suppress(InputFault):
                samples += self.real.update(self.stamp_ns(index), WHEELS, [angle, angle])
        return [sample.left_pulses for sample in samples]

    def memory_mb(self):
        page = os.sysconf('SC_PAGE_SIZE')
        return {
            node: int(Path(f'/proc/{pid}/statm').read_text().split()[1]) * page / MB for node, pid in self.pids.items()
        }

    def stream(self, first, last):
        """Send at RATE_HZ; return by how much [s] a message was late."""
        start_s, latest_s = time.monotonic(), 0.0
        for index in range(first, last):
            ahead_s = start_s + (index - first) / RATE_HZ - time.monotonic()
            latest_s = max(latest_s, -ahead_s)
            if ahead_s > 0.0:
                time.sleep(ahead_s)
            self.publish(self.stamp_ns(index), self.angle(index))
        return latest_s

    def test_1_khz_of_50_joints_loses_nothing_and_takes_no_memory(self):
        count = self.seconds * RATE_HZ
        quarter = count // 4
        self.stream(0, quarter)
        for collector in self.odom.values():
            collector.wait_for_stamp(self.stamp_ns((quarter - 1) // 50 * 50), timeout_s=120.0)
        after_start = self.memory_mb()  # buffers and caches have their size, and nothing waits
        start_s = time.monotonic()
        latest_s = self.stream(quarter, count)
        took_s = time.monotonic() - start_s
        self.check_answers(count)
        answered_s, memory_mb = time.monotonic() - start_s, self.memory_mb()
        print(
            f'\n{count - quarter} messages of {JOINTS} joints in {took_s:.1f} s, at most {1e3 * latest_s:.0f} ms late'
        )
        print(f'all answered {answered_s - took_s:.2f} s after the last')
        for node, size_mb in memory_mb.items():
            grown_mb = size_mb - after_start[node]
            print(f'{node}: {size_mb:.1f} MB, {grown_mb:+.2f} MB since a quarter of the time')
            self.assertLess(grown_mb, FLAT_MB, node)
        for node in NODES:
            self.assertEqual(self.rosout.warnings_of(node), [])

    def test_a_burst_with_nan_in_it_is_answered_except_those_messages(self):
        lost = set(range(7, BURST, 50))  # none of them on a boundary of 20 Hz
        for index in range(BURST):
            self.publish(self.stamp_ns(index), math.nan if index in lost else self.angle(index))
        self.check_answers(BURST, lost)
        for node in NODES[::2]:
            warned = self.rosout.wait_for_warning(node, '/joint_states', 'nan')
            self.assertLessEqual(len(warned), 5, warned)  # one in 5 s


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'joint_rate', JointRateTest)
