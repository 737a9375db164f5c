#!/usr/bin/env python3
"""The contracts of world_pose_node, ideal_odom_node and global_pose_node. Started by poses.test."""
import math

import rospy
import rostest
from geometry_msgs.msg import Pose, PoseStamped, Quaternion, TransformStamped, Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.ros.gazebo_messages import ModelStates
from ros_testing import (NS_PER_S, PERIOD_NS, Collector, NodeTest, RosoutWatch, angle_between, connected_publisher,
                         stamp_from_ns, stamp_ns_of, start_test_node, wait_until, yaw_of)

GAZEBO_MD5 = '48c080191eb15c41858319b4d8a609c2'  # gazebo_msgs/ModelStates as Gazebo has it
NAN = float('nan')


def pose_message(x, y, yaw):
    pose = Pose(orientation=Quaternion(0, 0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)))
    pose.position.x, pose.position.y = x, y
    return pose


def states(pose, twist=None, name='alto'):
    return ModelStates(name=['ground_plane', name, 'box'],
                       pose=[pose_message(9, 9, 1), pose, pose_message(-9, 9, 1)],
                       twist=[Twist(), twist or Twist(), Twist()])


def transform(parent, child, stamp_ns, x, y, yaw):
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = parent
    message.header.stamp = stamp_from_ns(stamp_ns)
    pose = pose_message(x, y, yaw)
    message.transform.translation.x, message.transform.translation.y = x, y
    message.transform.rotation = pose.orientation
    return TFMessage([message])


class PosesTest(NodeTest):

    @classmethod
    def setUpClass(cls):
        start_test_node('poses_test')
        cls.clock = connected_publisher('/clock', Clock)
        cls.states = connected_publisher('/gazebo/model_states', ModelStates)
        cls.own_states = {name: connected_publisher('/%s/model_states' % name, ModelStates)
                          for name in ('gazebo_like', 'malformed')}
        cls.world = Collector('/world_pose', PoseStamped)
        cls.mapped = Collector('/mapped/world_pose', PoseStamped)
        cls.gazebo_like = Collector('/gazebo_like/world_pose', PoseStamped)
        cls.misnamed = Collector('/misnamed/world_pose', PoseStamped)
        cls.malformed = Collector('/malformed/world_pose', PoseStamped)
        cls.odom = Collector('/odom', Odometry)
        cls.ideal_tf = Collector('/ideal/tf', TFMessage)
        cls.global_pose = Collector('/global_pose', PoseStamped)
        cls.tf = connected_publisher('/tf', TFMessage)
        cls.tf_static = connected_publisher('/tf_static', TFMessage, latch=True)
        cls.wait_until_all_are_connected()
        cls.rosout = RosoutWatch()

    @classmethod
    def wait_until_all_are_connected(cls):
        wait_until(lambda: cls.states.get_num_connections() == 4, 'four subscribers of /gazebo/model_states')
        wait_until(lambda: cls.clock.get_num_connections() >= 7, 'every node at /clock')
        # The node hears /tf twice: through its TF listener, and by itself. Over one connection.
        wait_until(lambda: cls.tf.get_num_connections() >= 1, 'a subscriber of /tf')

    def setUp(self):
        super().setUp()
        self.now_ns = self.epoch_ns
        self.publish_clock()
        for collector in (self.world, self.mapped, self.gazebo_like, self.misnamed, self.malformed, self.odom,
                          self.ideal_tf, self.global_pose):
            collector.clear()

    def publish_clock(self):
        self.clock.publish(Clock(stamp_from_ns(self.now_ns)))

    def send_states(self, message, answered_by):
        """States that hold now, and the answer waited for: what simulator_node does."""
        self.publish_clock()
        self.states.publish(message)
        for collector in answered_by:
            collector.wait_for_stamp(self.now_ns)

    def drive(self, poses, answered_by):
        """A pose every 50 ms, time in steps of 10 ms; returns the stamps of the poses."""
        stamps = []
        for pose in poses:
            stamps.append(self.now_ns)
            self.send_states(states(pose), answered_by)
            for _ in range(4):
                self.now_ns += 10000000
                self.publish_clock()
            self.now_ns += 10000000
        return stamps

    # --- world_pose_node ----------------------------------------------------------------------------------------------

    def test_world_pose_at_20_hz_with_the_states_own_time(self):
        poses = [pose_message(0.1 * step, -0.2 * step, 0.3 * step) for step in range(25)]
        stamps = self.drive(poses, [self.world])
        messages = self.world.messages
        self.assert_stamps(messages, stamps)
        for message, pose in zip(messages, poses):
            self.assertEqual(message.header.frame_id, 'map')
            self.assertEqual(message.pose.position, pose.position)
            self.assertLess(angle_between(yaw_of(message.pose.orientation), yaw_of(pose.orientation)), 1e-12)

    def test_surveyed_origin_of_the_map(self):
        # One metre ahead of the origin, which stands at (1, 2) and looks 0.5 rad to the left.
        ahead = pose_message(1.0 + math.cos(0.5), 2.0 + math.sin(0.5), 0.75)
        self.drive([pose_message(1.0, 2.0, 0.5), ahead], [self.mapped])
        at_origin, one_ahead = self.mapped.messages
        for message, (x, yaw) in ((at_origin, (0.0, 0.0)), (one_ahead, (1.0, 0.25))):
            self.assertEqual(message.header.frame_id, 'site')
            self.assertAlmostEqual(message.pose.position.x, x, delta=1e-12)
            self.assertAlmostEqual(message.pose.position.y, 0.0, delta=1e-12)
            self.assertLess(angle_between(yaw_of(message.pose.orientation), yaw), 1e-12)

    def test_states_at_1000_hz_are_thinned_to_20_hz(self):
        for _ in range(1001):
            self.publish_clock()
            self.own_states['gazebo_like'].publish(states(pose_message(1, 2, 3)))
            self.now_ns += 1000000
        self.publish_clock()
        messages = self.gazebo_like.wait_for(lambda found: len(found) >= 19, 'a second of poses')
        periods = [stamp_ns_of(message) // PERIOD_NS for message in messages]
        self.assertEqual(len(set(periods)), len(periods))  # never two in one 50 ms
        self.assertLessEqual(len(periods), 21)

    def test_unknown_model_is_named_with_the_known_ones(self):
        self.drive([pose_message(1, 2, 3)] * 10, [self.world])
        warned = self.rosout.wait_for_warning('/misnamed/world_pose_node', '/gazebo/model_states', 'atlo', 'alto')
        self.assertEqual(len(warned), 1, warned)
        self.now_ns += PERIOD_NS
        self.send_states(states(pose_message(5, 6, 0), name='atlo'), [self.misnamed])  # still alive
        self.assert_stamps(self.misnamed.messages, [self.now_ns])

    def test_pose_that_is_not_finite_is_dropped(self):
        self.drive([pose_message(1, 2, 0.3)], [self.world, self.odom])
        bad = (pose_message(NAN, 2, 0.3), pose_message(1, float('inf'), 0.3), pose_message(1, 2, NAN),
               Pose())  # a quaternion of zeros
        self.drive(bad, [])
        self.drive([pose_message(1, 2, 0.3)], [self.world, self.mapped, self.odom])
        last_ns = self.now_ns - PERIOD_NS
        for collector in (self.world, self.mapped, self.odom):
            self.assert_stamps(collector.messages, [self.epoch_ns, last_ns])
        for node in ('/world_pose_node', '/ideal_odom_node'):
            warned = self.rosout.wait_for_warning(node, '/gazebo/model_states')
            self.assertEqual(len(warned), 1, warned)

    def test_names_without_poses(self):
        def send(message, stamp_ns):
            self.now_ns = stamp_ns
            self.publish_clock()
            self.own_states['malformed'].publish(message)

        good = states(pose_message(1, 2, 0.3))
        send(good, self.epoch_ns)
        self.malformed.wait_for_count(1)
        send(ModelStates(name=good.name, pose=good.pose[:1], twist=[]), self.epoch_ns + PERIOD_NS)
        self.rosout.wait_for_warning('/malformed/world_pose_node', '/malformed/model_states', 'alto')
        send(good, self.epoch_ns + 2 * PERIOD_NS)
        self.assert_stamps(self.malformed.wait_for_count(2), [self.epoch_ns, self.epoch_ns + 2 * PERIOD_NS])

    def test_world_pose_resumes_after_a_reset(self):
        self.drive([pose_message(step, 0, 0) for step in range(10)], [self.world])
        self.world.clear()
        self.epoch_ns = self.now_ns = NS_PER_S
        stamps = self.drive([pose_message(step, 0, 0) for step in range(10)], [self.world])
        self.assert_stamps(self.world.messages, stamps)

    # --- ideal_odom_node ----------------------------------------------------------------------------------------------

    def restart_ideal_odometry(self):
        """Time that jumps back is what restarts it."""
        self.epoch_ns = self.now_ns = self.epoch_ns - 500 * NS_PER_S
        self.publish_clock()

    def test_ideal_odometry_starts_at_zero_and_carries_the_twist_in_the_robots_frame(self):
        self.restart_ideal_odometry()
        start, heading = (2.0, 3.0), 0.5
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.angular.z = -0.4 * math.cos(heading), -0.4 * math.sin(heading), 0.7
        for step in range(5):
            way = -0.1 * step  # backwards
            pose = pose_message(start[0] + way * math.cos(heading), start[1] + way * math.sin(heading), heading)
            self.send_states(states(pose, twist), [self.odom])
            self.now_ns += PERIOD_NS
        messages = self.odom.messages
        self.assert_stamps(messages, [self.epoch_ns + step * PERIOD_NS for step in range(5)])
        for step, message in enumerate(messages):
            self.assertEqual((message.header.frame_id, message.child_frame_id), ('odom', 'base_link'))
            self.assertAlmostEqual(message.pose.pose.position.x, -0.1 * step, delta=1e-9)
            self.assertAlmostEqual(message.pose.pose.position.y, 0.0, delta=1e-9)
            self.assertLess(abs(yaw_of(message.pose.pose.orientation)), 1e-9)
            self.assertAlmostEqual(message.twist.twist.linear.x, -0.4, delta=1e-9)
            self.assertAlmostEqual(message.twist.twist.angular.z, 0.7, delta=1e-9)
        transforms = [one for message in self.ideal_tf.wait_for_count(5) for one in message.transforms]
        self.assertEqual([stamp_ns_of(one) for one in transforms], [stamp_ns_of(message) for message in messages])
        self.assertEqual([one.transform.translation.x for one in transforms],
                         [message.pose.pose.position.x for message in messages])

    def test_ideal_odometry_restarts_at_zero_when_time_jumps_back(self):
        self.drive([pose_message(step, 0, 0) for step in range(5)], [self.odom])
        self.odom.clear()
        self.restart_ideal_odometry()
        self.drive([pose_message(7 + step, 1, 0) for step in range(3)], [self.odom])
        self.assertEqual([message.pose.pose.position.x for message in self.odom.messages], [0.0, 1.0, 2.0])
        warned = self.rosout.wait_for_warning('/ideal_odom_node', 'back')
        self.assertEqual(len(warned), 1, warned)

    def test_ideal_odometry_never_says_nan_of_the_twist(self):
        twist = Twist()
        twist.linear.x = NAN
        self.send_states(states(pose_message(1, 2, 0.3)), [self.odom])
        self.now_ns += PERIOD_NS
        self.send_states(states(pose_message(1, 2, 0.3), twist), [self.world])
        self.now_ns += PERIOD_NS
        self.send_states(states(pose_message(1, 2, 0.3)), [self.odom])
        for message in self.odom.messages:
            self.assertTrue(math.isfinite(message.twist.twist.linear.x), message.twist.twist)

    # --- global_pose_node ---------------------------------------------------------------------------------------------

    def send_odometry(self, stamp_ns, x):
        self.now_ns = stamp_ns
        self.publish_clock()
        self.tf.publish(transform('odom', 'base_link', stamp_ns, x, 0, 0.25))

    def test_global_pose_is_silent_until_the_map_is_known_and_resumes_after_a_reset(self):
        # One test, because what /tf_static once said stays.
        for step in range(50):
            self.send_odometry(self.epoch_ns + step * 10000000, 0.01 * step)
        known_ns = self.epoch_ns + 50 * 10000000
        self.tf_static.publish(transform('map', 'odom', 0, 5, 6, math.pi / 2))
        wait_until(lambda: self.tf_static.get_num_connections() == 1, 'the listener of /tf_static')
        self.send_until_answered(known_ns)
        first_ns = stamp_ns_of(self.global_pose.messages[0])
        self.assertGreaterEqual(first_ns, known_ns)  # nothing of before

        self.check_20_hz(first_ns // PERIOD_NS * PERIOD_NS + NS_PER_S)
        self.rosout.clear()
        self.check_reset()

    def send_until_answered(self, stamp_ns):
        """/tf_static comes over a connection of its own: go on until it is through."""
        def is_answered():
            self.send_odometry(self.now_ns + 10000000, 0.0)
            return self.global_pose.messages
        self.now_ns = stamp_ns
        wait_until(is_answered, 'a pose on the map')

    def check_20_hz(self, start_ns):
        self.global_pose.clear()
        for step in range(101):  # 100 Hz
            self.send_odometry(start_ns + step * 10000000, 0.01 * step)
        messages = self.global_pose.wait_for_stamp(start_ns + NS_PER_S)
        self.assert_stamps(messages, [start_ns + step * PERIOD_NS for step in range(21)])
        for step, message in enumerate(messages):
            self.assertEqual(message.header.frame_id, 'map')
            self.assertAlmostEqual(message.pose.position.x, 5.0, delta=1e-9)
            self.assertAlmostEqual(message.pose.position.y, 6.0 + 0.05 * step, delta=1e-9)
            self.assertLess(angle_between(yaw_of(message.pose.orientation), math.pi / 2 + 0.25), 1e-9)

    def check_reset(self):
        """The clock starts again, far below the newest transform."""
        self.global_pose.clear()
        self.now_ns = 0
        self.publish_clock()
        self.send_until_answered(NS_PER_S)
        resumed_ns = stamp_ns_of(self.global_pose.messages[0])
        self.assertLess(resumed_ns, self.epoch_ns)
        self.check_20_hz(resumed_ns // PERIOD_NS * PERIOD_NS + NS_PER_S)

    # --- Gazebo -------------------------------------------------------------------------------------------------------

    def test_a_subscriber_of_gazebos_own_type_is_served(self):
        """What the nodes subscribe as is what Gazebo publishes, so the handshake compares like with like."""
        self.assertEqual((ModelStates._type, ModelStates._md5sum), ('gazebo_msgs/ModelStates', GAZEBO_MD5))
        self.drive([pose_message(1, 2, 3)], [self.world])


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'poses', PosesTest)
