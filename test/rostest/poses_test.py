#!/usr/bin/env python3
"""The contracts of world_pose_node, ideal_odom_node and global_pose_node. Started by simulation.test."""

import math
import time

import ros_testing as ros
import rostest
from geometry_msgs.msg import Pose, PoseStamped, Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.ros.gazebo_states import ModelStates
from diff_encoder_sim.ros.messages import pose_from_message, pose_message

READERS = ('/world_pose_node', '/mapped/world_pose_node', '/ideal_odom_node')
MS = 1_000_000


def pose_at(x, y, yaw):
    return pose_message(Pose2D(x, y, yaw))


def states(pose, twist=None, name='alto'):
    return ModelStates(
        name=['ground_plane', name, 'box'],
        pose=[pose_at(9, 9, 1), pose, pose_at(-9, 9, 1)],
        twist=[Twist(), twist or Twist(), Twist()],
    )


class PosesTest(ros.NodeTest):
    @classmethod
    def setUpClass(cls):
        ros.start_test_node('poses_test')
        cls.clock = ros.connected_publisher(
            '/clock', Clock, [*READERS, '/gazebo_like/world_pose_node', '/global_pose_node']
        )
        cls.states = ros.connected_publisher('/gazebo/model_states', ModelStates, READERS)
        cls.gazebo_states = ros.connected_publisher('/gazebo_like/model_states', ModelStates)
        cls.world, cls.mapped, cls.gazebo_like = (
            ros.Collector(f'{name}/world_pose', PoseStamped) for name in ('', '/mapped', '/gazebo_like')
        )
        cls.odom = ros.Collector('/odom', Odometry)
        cls.ideal_tf = ros.Collector('/ideal/tf', TFMessage)
        cls.global_pose = ros.Collector('/global_pose', PoseStamped)
        cls.tf = ros.connected_publisher('/tf', TFMessage, ['/global_pose_node'])
        cls.rosout = ros.RosoutWatch()

    def setUp(self):
        super().setUp()
        self.now_ns = self.epoch_ns
        self.settle()
        for collector in (self.world, self.mapped, self.gazebo_like, self.odom, self.ideal_tf, self.global_pose):
            collector.clear()

    def settle(self):
        """Time has made a leap. /clock comes over a connection of its own: go on until all answer with its time.

        Each attempt sends another pose and twist, so that an answer to an earlier attempt does not count.
        """

        def is_settled():
            self.now_ns += ros.PERIOD_NS
            mark, twist = 0.01 * (self.now_ns // ros.PERIOD_NS % 100), Twist()
            twist.linear.x = mark
            self.publish_clock()
            self.states.publish(states(pose_at(mark, 0, 0), twist))
            deadline = time.monotonic() + 0.3
            while not self.have_answered(mark) and time.monotonic() < deadline:
                time.sleep(0.001)
            return self.have_answered(mark)

        ros.wait_until(is_settled, 'poses at the new time')
        time.sleep(0.1)  # global_pose_node, which has answered nothing, looks at /clock every 20 ms
        self.now_ns += ros.PERIOD_NS
        self.epoch_ns = self.now_ns

    def have_answered(self, mark):
        """Whether the nodes have answered the states with this x (m, in the world) and this forward speed (m/s)."""

        def has(collector, is_marked):
            return any(ros.stamp_ns_of(one) == self.now_ns and is_marked(one) for one in collector.messages[-3:])

        def is_mapped(one):  # the map's origin stands at (1, 2)
            place = one.pose.position
            return abs(math.hypot(place.x, place.y) - math.hypot(mark - 1.0, 2.0)) < 1e-9

        return (
            has(self.world, lambda one: one.pose.position.x == mark)
            and has(self.odom, lambda one: abs(one.twist.twist.linear.x - mark) < 1e-9)
            and has(self.mapped, is_mapped)
            and any(ros.stamp_ns_of(one) == self.now_ns for tf in self.ideal_tf.messages[-3:] for one in tf.transforms)
        )

    def leap_back(self, stamp_ns):
        """The clock is reset; returns when both kinds of nodes have noticed, as each warns of it."""
        self.epoch_ns = self.now_ns = stamp_ns
        self.publish_clock()
        for node in ('/world_pose_node', '/ideal_odom_node'):
            self.assert_warned_once(node, 'back')

    def publish_clock(self):
        self.clock.publish(Clock(ros.stamp_from_ns(self.now_ns)))

    def drive(self, poses, answered_by, twist=None):
        """A pose every 50 ms, time in steps of 10 ms, each answer waited for, as simulator_node does; their stamps."""
        stamps = []
        for pose in poses:
            stamps.append(self.now_ns)
            self.publish_clock()
            self.states.publish(states(pose, twist))
            for collector in answered_by:
                collector.wait_for_stamp(self.now_ns)
            for _ in range(4):
                self.now_ns += 10 * MS
                self.publish_clock()
            self.now_ns += 10 * MS
        return stamps

    # --- world_pose_node

    def test_world_pose_at_20_hz_with_the_states_own_time_also_after_a_reset(self):
        poses = [pose_at(0.1 * step, -0.2 * step, 0.3 * step) for step in range(15)]
        for _ in range(2):
            stamps = self.drive(poses, [self.world])
            messages = self.world.messages
            self.assert_stamps(messages, stamps)
            for message, pose in zip(messages, poses):
                self.assertEqual(message.header.frame_id, 'map')
                given = pose_from_message(message.pose).relative_to(pose_from_message(pose))
                self.assertLess(max(map(abs, given)), 1e-12)
            self.world.clear()
            self.leap_back(ros.NS_PER_S)
            self.rosout.clear()

    def test_surveyed_origin_of_the_map(self):
        # One metre ahead of the origin, which stands at (1, 2) and looks 0.5 rad to the left.
        self.drive([pose_at(1.0 + math.cos(0.5), 2.0 + math.sin(0.5), 0.75)], [self.mapped])
        (message,) = self.mapped.messages
        self.assertEqual(message.header.frame_id, 'site')
        given = pose_from_message(message.pose).relative_to(Pose2D(1.0, 0.0, 0.25))
        self.assertLess(max(map(abs, given)), 1e-12)

    def test_unknown_model_is_named_and_states_at_1000_hz_are_thinned_to_20_hz(self):
        node = '/gazebo_like/world_pose_node'

        def send(name):
            for _ in range(50):
                self.publish_clock()
                self.gazebo_states.publish(states(pose_at(1, 2, 3), name=name))
                self.now_ns += MS

        ros.wait_until(lambda: send('alto') or self.rosout.warnings_of(node), 'a warning')
        self.rosout.wait_for_warning(node, '/gazebo_like/model_states', 'atlo', 'alto')
        self.assertEqual(self.gazebo_like.messages, [])
        # Clock and states come to the node in two threads, so on a loaded machine it dates some states alike: feed it
        # until enough have come.
        ros.wait_until(lambda: send('atlo') or len(self.gazebo_like.messages) >= 10, 'half a second of poses')
        periods = [ros.stamp_ns_of(message) // ros.PERIOD_NS for message in self.gazebo_like.messages]
        self.assertEqual(len(set(periods)), len(periods))  # never two in one 50 ms

    def test_pose_that_is_not_finite_is_dropped(self):
        good = pose_at(1, 2, 0.3)
        self.drive([good], [self.world, self.odom])
        lame = Pose()  # a quaternion of zeros is no rotation
        lame.position.x = 77
        for bad in (pose_at(ros.NAN, 2, 0.3), pose_at(77, ros.INF, 0.3), pose_at(77, 2, ros.NAN), lame):
            self.drive([bad] * 3, [])
            time.sleep(0.02)  # lets it come through before the next takes its place
        for node in READERS:
            self.assert_warned_once(node, '/gazebo/model_states')
        last_ns = self.now_ns + ros.NS_PER_S

        def is_answered():
            self.drive([good], [])
            return all(ros.stamp_ns_of(collector.messages[-1]) > last_ns for collector in (self.world, self.odom))

        ros.wait_until(is_answered, 'good poses after the bad')
        self.assertEqual({(one.pose.position.x, one.pose.position.y) for one in self.world.messages}, {(1, 2)})
        self.assertEqual(len({(one.pose.pose.position.x, one.twist.twist.linear.x) for one in self.odom.messages}), 1)

    # --- ideal_odom_node

    def test_ideal_odometry_restarts_at_zero_when_time_jumps_back(self):
        self.drive([pose_at(-3, step, 1) for step in range(5)], [self.odom])
        self.ideal_tf.wait_for_count(5)
        self.odom.clear()
        self.ideal_tf.clear()
        self.leap_back(self.epoch_ns - 500 * ros.NS_PER_S)
        # Backwards at -0.4 m/s, with a yaw rate that has no effect: poses and twists are told apart.
        yaw, twist = 0.5, Twist()
        twist.linear.x, twist.linear.y, twist.angular.z = -0.4 * math.cos(yaw), -0.4 * math.sin(yaw), 0.7
        ways = [-0.02 * step for step in range(5)]
        poses = [pose_at(2.0 + way * math.cos(yaw), 3.0 + way * math.sin(yaw), yaw) for way in ways]
        stamps = self.drive(poses, [self.odom], twist)
        messages = self.odom.messages
        self.assert_stamps(messages, stamps)
        for way, message in zip(ways, messages):
            self.assertEqual((message.header.frame_id, message.child_frame_id), ('odom', 'base_link'))
            place, moved = message.pose.pose.position, message.twist.twist
            given = place.x, place.y, ros.yaw_of(message.pose.pose.orientation), moved.linear.x, moved.angular.z
            for number, expected in zip(given, (way, 0.0, 0.0, -0.4, 0.7)):
                self.assertAlmostEqual(number, expected, delta=1e-9)
        transforms = [one for message in self.ideal_tf.wait_for_count(5) for one in message.transforms]
        self.assertEqual([ros.stamp_ns_of(one) for one in transforms], stamps)
        self.assertEqual(
            [one.transform.translation.x for one in transforms], [message.pose.pose.position.x for message in messages]
        )

    # --- global_pose_node

    def send_odometry(self, stamp_ns, x):
        self.now_ns = stamp_ns
        self.publish_clock()
        self.tf.publish(TFMessage([ros.transform_message(Pose2D(x, 0, 0.25), stamp_ns, 'odom', 'base_link')]))

    def localize(self):
        """map -> odom for the next seconds, over the connection that odom -> base_link comes on: so in this order."""
        for stamp_ns in (self.now_ns - ros.NS_PER_S, self.now_ns + 8 * ros.NS_PER_S):
            self.tf.publish(TFMessage([ros.transform_message(Pose2D(5, 6, math.pi / 2), stamp_ns, 'map', 'odom')]))

    def check_20_hz(self, start_ns):
        for step in range(101):  # 100 Hz
            self.send_odometry(start_ns + step * 10 * MS, 0.01 * step)
        messages = self.global_pose.wait_for_stamp(start_ns + ros.NS_PER_S)
        messages = [message for message in messages if ros.stamp_ns_of(message) >= start_ns]
        self.assert_stamps(messages, [start_ns + step * ros.PERIOD_NS for step in range(21)])
        for step, message in enumerate(messages):
            self.assertEqual(message.header.frame_id, 'map')
            expected = Pose2D(5.0, 6.0 + 0.05 * step, math.pi / 2 + 0.25)
            self.assertLess(max(map(abs, pose_from_message(message.pose).relative_to(expected))), 1e-9)

    def test_global_pose_is_silent_until_the_map_is_known_and_resumes_after_a_reset(self):
        for step in range(50):
            self.send_odometry(self.epoch_ns + step * 10 * MS, 0.01 * step)
        self.localize()
        last_before_ns = self.now_ns
        self.check_20_hz(self.epoch_ns + ros.NS_PER_S)
        self.assertTrue(all(ros.stamp_ns_of(message) >= last_before_ns for message in self.global_pose.messages))
        self.global_pose.clear()
        self.now_ns = 2 * ros.NS_PER_S  # the clock starts again, far below the newest transform

        def is_answered():
            # /clock comes over a connection of its own: go on until it is through
            self.send_odometry(self.now_ns + 10 * MS, 0.0)
            self.localize()
            return self.global_pose.messages

        ros.wait_until(is_answered, 'a pose on the map')
        self.assertLess(ros.stamp_ns_of(self.global_pose.messages[0]), self.epoch_ns)
        self.check_20_hz((self.now_ns // ros.PERIOD_NS + 2) * ros.PERIOD_NS)


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'poses', PosesTest)
