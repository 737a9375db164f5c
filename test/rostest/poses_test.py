#!/usr/bin/env python3
"""The contracts of world_pose_node, ideal_odom_node and global_pose_node. Started by poses.test."""

import math
import time

import rostest
from geometry_msgs.msg import Pose, PoseStamped, Quaternion, TransformStamped, Twist
from nav_msgs.msg import Odometry
from ros_testing import (
    NS_PER_S,
    PERIOD_NS,
    Collector,
    NodeTest,
    RosoutWatch,
    angle_between,
    connected_publisher,
    stamp_from_ns,
    stamp_ns_of,
    start_test_node,
    wait_for_listeners,
    wait_until,
    yaw_of,
)
from rosgraph_msgs.msg import Clock
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.ros.gazebo_states import ModelStates

GAZEBO_MD5 = '48c080191eb15c41858319b4d8a609c2'  # gazebo_msgs/ModelStates as Gazebo has it
NAN = float('nan')


def pose_message(x, y, yaw):
    pose = Pose(orientation=Quaternion(0, 0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)))
    pose.position.x, pose.position.y = x, y
    return pose


def states(pose, twist=None, name='alto'):
    return ModelStates(
        name=['ground_plane', name, 'box'],
        pose=[pose_message(9, 9, 1), pose, pose_message(-9, 9, 1)],
        twist=[Twist(), twist or Twist(), Twist()],
    )


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
        cls.own_states = {
            name: connected_publisher(f'/{name}/model_states', ModelStates)
            for name in ('gazebo_like', 'misnamed', 'malformed', 'bad_twist')
        }
        cls.world = Collector('/world_pose', PoseStamped)
        cls.mapped = Collector('/mapped/world_pose', PoseStamped)
        cls.gazebo_like = Collector('/gazebo_like/world_pose', PoseStamped)
        cls.misnamed = Collector('/misnamed/world_pose', PoseStamped)
        cls.malformed = Collector('/malformed/world_pose', PoseStamped)
        cls.odom = Collector('/odom', Odometry)
        cls.bad_twist = Collector('/bad_twist/odom', Odometry)
        cls.ideal_tf = Collector('/ideal/tf', TFMessage)
        cls.global_pose = Collector('/global_pose', PoseStamped)
        cls.tf = connected_publisher('/tf', TFMessage)
        wait_for_listeners(cls.tf, ['/global_pose_node'])
        wait_for_listeners(cls.states, ['/world_pose_node', '/mapped/world_pose_node', '/ideal_odom_node'])
        readers = [f'{name}/world_pose_node' for name in ('', '/mapped', '/gazebo_like', '/misnamed', '/malformed')]
        wait_for_listeners(cls.clock, [*readers, '/ideal_odom_node', '/bad_twist/ideal_odom_node', '/global_pose_node'])
        cls.rosout = RosoutWatch()

    def setUp(self):
        super().setUp()
        self.collectors = (
            self.world,
            self.mapped,
            self.gazebo_like,
            self.misnamed,
            self.malformed,
            self.odom,
            self.bad_twist,
            self.ideal_tf,
            self.global_pose,
        )
        self.now_ns = self.epoch_ns
        self.settle()
        for collector in self.collectors:
            collector.clear()

    def settle(self):
        """Time has made a leap. /clock comes over a connection of its own: go on until all answer with its time.

        Each attempt sends another pose and twist, so that an answer to an earlier attempt does not count.
        """

        def is_settled():
            self.now_ns += PERIOD_NS
            mark = 0.01 * (self.now_ns // PERIOD_NS % 100)
            twist = Twist()
            twist.linear.x = mark
            self.publish_clock()
            self.states.publish(states(pose_message(mark, 0, 0), twist))
            deadline = time.monotonic() + 0.3
            while not self.have_answered(mark) and time.monotonic() < deadline:
                time.sleep(0.001)
            return self.have_answered(mark)

        wait_until(is_settled, 'poses at the new time')
        time.sleep(0.1)  # global_pose_node, which has answered nothing, looks at /clock every 20 ms
        self.now_ns += PERIOD_NS
        self.epoch_ns = self.now_ns

    def have_answered(self, mark):
        """Whether the nodes have answered the states with this x (m, in the world) and this forward speed (m/s)."""

        def answered_now(collector, has_mark):
            return any(stamp_ns_of(message) == self.now_ns and has_mark(message) for message in collector.messages)

        return (
            answered_now(self.world, lambda message: message.pose.position.x == mark)
            and answered_now(self.odom, lambda message: abs(message.twist.twist.linear.x - mark) < 1e-9)
            and answered_now(
                self.mapped,  # the map's origin stands at (1, 2)
                lambda message: (
                    abs(math.hypot(message.pose.position.x, message.pose.position.y) - math.hypot(mark - 1.0, 2.0))
                    < 1e-9
                ),
            )
            and any(stamp_ns_of(one) == self.now_ns for tf in self.ideal_tf.messages for one in tf.transforms)
        )

    def leap_back(self, stamp_ns):
        """The clock is reset; returns when both kinds of nodes have noticed, as each warns of it."""
        self.epoch_ns = self.now_ns = stamp_ns
        self.publish_clock()
        for node in ('/world_pose_node', '/ideal_odom_node'):
            warned = self.rosout.wait_for_warning(node, 'back')
            self.assertEqual(len(warned), 1, warned)

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
        # Clock and states come to the node in two threads, so on a loaded machine it dates some states alike: feed it
        # until enough have come.
        def have_come():
            for _ in range(50):
                self.publish_clock()
                self.own_states['gazebo_like'].publish(states(pose_message(1, 2, 3)))
                self.now_ns += 1000000
            return len(self.gazebo_like.messages) >= 20

        wait_until(have_come, 'a second of poses')
        periods = [stamp_ns_of(message) // PERIOD_NS for message in self.gazebo_like.messages]
        self.assertEqual(len(set(periods)), len(periods))  # never two in one 50 ms

    def send_apart(self, name, message):
        """States for a node with a topic of its own, 50 ms later than the last."""
        self.now_ns += PERIOD_NS
        self.publish_clock()
        self.own_states[name].publish(message)

    def send_until_answered(self, name, message, collector):
        count = len(collector.messages)

        def is_answered():
            self.send_apart(name, message)
            return len(collector.messages) > count

        wait_until(is_answered, 'an answer to good states')

    def send_until_warned(self, name, message, node):
        def is_warned():
            self.send_apart(name, message)
            return self.rosout.warnings_of(node)

        wait_until(is_warned, 'a warning of ' + node)

    def test_unknown_model_is_named_with_the_known_ones(self):
        node, topic = '/misnamed/world_pose_node', '/misnamed/model_states'
        self.send_until_warned('misnamed', states(pose_message(1, 2, 3)), node)
        self.rosout.wait_for_warning(node, topic, 'atlo', 'alto')
        self.send_until_answered('misnamed', states(pose_message(5, 6, 0), name='atlo'), self.misnamed)  # still alive
        self.assertEqual({message.pose.position.x for message in self.misnamed.messages}, {5})

    def test_pose_that_is_not_finite_is_dropped(self):
        good = pose_message(1, 2, 0.3)
        self.drive([good], [self.world, self.odom])
        lame = Pose()  # a quaternion of zeros is no rotation
        lame.position.x = 77
        for bad in (pose_message(NAN, 2, 0.3), pose_message(77, float('inf'), 0.3), pose_message(77, 2, NAN), lame):
            self.drive([bad] * 3, [])
            time.sleep(0.02)  # lets it come through before the next takes its place
        for node in ('/world_pose_node', '/mapped/world_pose_node', '/ideal_odom_node'):
            warned = self.rosout.wait_for_warning(node, '/gazebo/model_states')
            self.assertEqual(len(warned), 1, warned)
        last_ns = self.now_ns + NS_PER_S

        def is_answered():
            self.drive([good], [])
            return all(stamp_ns_of(collector.messages[-1]) > last_ns for collector in (self.world, self.odom))

        wait_until(is_answered, 'good poses after the bad')
        self.assertEqual(
            {(message.pose.position.x, message.pose.position.y) for message in self.world.messages}, {(1, 2)}
        )
        self.assertEqual(
            {(message.pose.pose.position.x, message.twist.twist.linear.x) for message in self.odom.messages},
            {(self.odom.messages[0].pose.pose.position.x, 0.0)},
        )

    def test_world_pose_resumes_after_a_reset(self):
        self.drive([pose_message(step, 0, 0) for step in range(10)], [self.world])
        self.world.clear()
        self.leap_back(NS_PER_S)
        stamps = self.drive([pose_message(step, 0, 0) for step in range(10)], [self.world])
        self.assert_stamps(self.world.messages, stamps)

    # --- ideal_odom_node ----------------------------------------------------------------------------------------------

    def test_ideal_odometry_restarts_at_zero_when_time_jumps_back(self):
        self.drive([pose_message(-3, step, 1) for step in range(5)], [self.odom])
        self.ideal_tf.wait_for_count(5)
        self.odom.clear()
        self.ideal_tf.clear()
        self.leap_back(self.epoch_ns - 500 * NS_PER_S)
        self.drive_backwards(x=2.0, y=3.0, yaw=0.5)
        self.check_odometry_of_driving_backwards()

    def drive_backwards(self, x, y, yaw):
        """At -0.4 m/s, with a yaw rate that has no effect: poses and twists are told apart."""
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.angular.z = -0.4 * math.cos(yaw), -0.4 * math.sin(yaw), 0.7
        for step in range(5):
            way = -0.02 * step
            pose = pose_message(x + way * math.cos(yaw), y + way * math.sin(yaw), yaw)
            self.send_states(states(pose, twist), [self.odom])
            self.now_ns += PERIOD_NS

    def check_odometry_of_driving_backwards(self):
        messages = self.odom.messages
        self.assert_stamps(messages, [self.epoch_ns + step * PERIOD_NS for step in range(5)])
        for step, message in enumerate(messages):
            self.assertEqual((message.header.frame_id, message.child_frame_id), ('odom', 'base_link'))
            self.assertAlmostEqual(message.pose.pose.position.x, -0.02 * step, delta=1e-9)
            self.assertAlmostEqual(message.pose.pose.position.y, 0.0, delta=1e-9)
            self.assertLess(abs(yaw_of(message.pose.pose.orientation)), 1e-9)
            self.assertAlmostEqual(message.twist.twist.linear.x, -0.4, delta=1e-9)
            self.assertAlmostEqual(message.twist.twist.angular.z, 0.7, delta=1e-9)
        transforms = [one for message in self.ideal_tf.wait_for_count(5) for one in message.transforms]
        self.assertEqual([stamp_ns_of(one) for one in transforms], [stamp_ns_of(message) for message in messages])
        self.assertEqual(
            [one.transform.translation.x for one in transforms], [message.pose.pose.position.x for message in messages]
        )

    # --- global_pose_node ---------------------------------------------------------------------------------------------

    def send_odometry(self, stamp_ns, x):
        self.now_ns = stamp_ns
        self.publish_clock()
        self.tf.publish(transform('odom', 'base_link', stamp_ns, x, 0, 0.25))

    def localize(self):
        """map -> odom for the next seconds, over the connection that odom -> base_link comes on: so in this order."""
        for stamp_ns in (self.now_ns - NS_PER_S, self.now_ns + 8 * NS_PER_S):
            self.tf.publish(transform('map', 'odom', stamp_ns, 5, 6, math.pi / 2))

    def test_global_pose_is_silent_until_the_map_is_known(self):
        for step in range(50):
            self.send_odometry(self.epoch_ns + step * 10000000, 0.01 * step)
        self.localize()
        last_before_ns = self.now_ns
        self.check_20_hz(self.epoch_ns + NS_PER_S)
        self.assertTrue(all(stamp_ns_of(message) >= last_before_ns for message in self.global_pose.messages))

    def check_20_hz(self, start_ns):
        for step in range(101):  # 100 Hz
            self.send_odometry(start_ns + step * 10000000, 0.01 * step)
        messages = [
            message
            for message in self.global_pose.wait_for_stamp(start_ns + NS_PER_S)
            if stamp_ns_of(message) >= start_ns
        ]
        self.assert_stamps(messages, [start_ns + step * PERIOD_NS for step in range(21)])
        for step, message in enumerate(messages):
            self.assertEqual(message.header.frame_id, 'map')
            self.assertAlmostEqual(message.pose.position.x, 5.0, delta=1e-9)
            self.assertAlmostEqual(message.pose.position.y, 6.0 + 0.05 * step, delta=1e-9)
            self.assertLess(angle_between(yaw_of(message.pose.orientation), math.pi / 2 + 0.25), 1e-9)

    def test_global_pose_resumes_after_a_reset(self):
        self.localize()
        self.check_20_hz(self.epoch_ns)
        self.global_pose.clear()
        self.now_ns = 2 * NS_PER_S  # the clock starts again, far below the newest transform

        def is_answered():
            # /clock comes over a connection of its own: go on until it is through
            self.send_odometry(self.now_ns + 10000000, 0.0)
            self.localize()
            return self.global_pose.messages

        wait_until(is_answered, 'a pose on the map')
        self.assertLess(stamp_ns_of(self.global_pose.messages[0]), self.epoch_ns)
        start_ns = (self.now_ns // PERIOD_NS + 2) * PERIOD_NS
        self.check_20_hz(start_ns)

    # --- Gazebo -------------------------------------------------------------------------------------------------------

    def test_a_subscriber_of_gazebos_own_type_is_served(self):
        """What the nodes subscribe as is what Gazebo publishes, so the handshake compares like with like."""
        self.assertEqual((ModelStates._type, ModelStates._md5sum), ('gazebo_msgs/ModelStates', GAZEBO_MD5))
        self.drive([pose_message(1, 2, 3)], [self.world])


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'poses', PosesTest)
