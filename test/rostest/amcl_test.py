#!/usr/bin/env python3
"""The contract of amcl_node. Started by localization.test."""

import math
import sys
from pathlib import Path

import numpy as np
import ros_testing as ros
import rospy
import rostest
import tf2_ros
from dynamic_reconfigure.client import Client
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped, Quaternion
from nav_msgs.msg import OccupancyGrid
from nav_msgs.srv import GetMap, GetMapResponse, SetMap
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.drives.message_encoders import encode_pose_with_covariance
from diff_encoder_sim.ros.messages import map_message, pose_from_message, pose_from_transform

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'support'))
from amcl_world import moved, pillar_room, simulated_scan

NODE, OTHER = '/amcl', '/by_topic/amcl'
SCAN_PERIOD_NS = 100000000
TOLERANCE_NS = 400000000  # config/amcl.yaml
START = Pose2D(0.9, -0.6, 1.8)
ELSEWHERE = Pose2D(-2.0, -0.2, -0.9)
ODOM_START = Pose2D(4.0, -3.0, 0.5)
LASER = Pose2D(0.1, 0.0, 0.3)
SURE, UNSURE = np.diag([0.0025, 0.0025, 0.0025]), np.diag([0.04, 0.04, 0.01])


class AmclTest(ros.NodeTest):
    @classmethod
    def setUpClass(cls):
        ros.start_test_node('amcl_test')
        cls.room = pillar_room()
        cls.map = map_message(cls.room, 0, 'map')
        cls.served = rospy.Service('static_map', GetMap, lambda _: GetMapResponse(map=cls.map))
        cls.tf = ros.connected_publisher('/tf', TFMessage, [NODE, OTHER])
        cls.scans = ros.connected_publisher('/scan', LaserScan, [NODE, OTHER])
        cls.guesses = ros.connected_publisher('/initialpose', PoseWithCovarianceStamped)
        cls.maps = ros.connected_publisher('/by_topic/map', OccupancyGrid)
        cls.static = tf2_ros.StaticTransformBroadcaster()
        cls.static.sendTransform(ros.transform_message(LASER, 0, 'base_link', 'laser'))
        cls.poses = ros.Collector('/amcl_pose', PoseWithCovarianceStamped)
        cls.clouds = ros.Collector('/particlecloud', PoseArray)
        cls.transforms = ros.Collector('/tf', TFMessage)
        cls.set_map = rospy.ServiceProxy('set_map', SetMap)
        cls.rosout = ros.RosoutWatch()
        # The node fetches the map by itself: scans until it answers one.
        robot = cls('localized')
        robot.epoch_ns = robot.now_ns = 500 * ros.NS_PER_S
        robot.true_pose, robot.odom_pose = START, ODOM_START
        ros.wait_until(lambda: robot.send_scan() and robot.answers(), 'an answer to a scan')

    def setUp(self):
        super().setUp()
        self.now_ns = self.epoch_ns
        self.begin(START, START, SURE)

    def begin(self, true_pose, guess, covariance):
        """The robot stands somewhere, and the filter begins at a guess."""
        self.true_pose, self.odom_pose = true_pose, ODOM_START
        self.assertTrue(self.set_map(self.map, self.guess(guess, covariance)).success)
        for collector in (self.poses, self.clouds, self.transforms):
            collector.clear()

    # --- playing the robot

    def guess(self, pose, covariance=SURE, stamp_ns=0, frame='map'):
        return PoseWithCovarianceStamped().deserialize(encode_pose_with_covariance(pose, covariance, stamp_ns, frame))

    def scan(self, true_pose=None):
        scan = simulated_scan(self.room, true_pose or self.true_pose, ray_count=180, laser_pose_in_base=LASER)
        return ros.scan_message(scan._replace(stamp_ns=0), 'laser', 0.1)

    def send_scan(self, message=None):
        """A scan of now, by default a good one; a tenth of a second passes. Returns its stamp."""
        message, stamp_ns = message or self.scan(), self.now_ns
        self.now_ns += SCAN_PERIOD_NS
        self.tf.publish(TFMessage([ros.transform_message(self.odom_pose, stamp_ns, 'odom', 'base_link')]))
        message.header.stamp = ros.stamp_from_ns(stamp_ns)
        self.scans.publish(message)
        return stamp_ns

    def move(self, forward_m, turn_rad):
        """Odometry sees a little less of it."""
        self.true_pose = moved(self.true_pose, forward_m, turn_rad)
        self.odom_pose = moved(self.odom_pose, 0.99 * forward_m, 0.99 * turn_rad)

    def answers(self, frame='map'):
        """Transforms to odom by the stamp of the scan that they answer."""
        return {
            ros.stamp_ns_of(one) - TOLERANCE_NS: one
            for message in self.transforms.messages
            for one in message.transforms
            if one.header.frame_id == frame
        }

    def answered(self, stamp_ns):
        """The base's pose in the map at a scan, waited for, by the transform that answers it."""
        ros.wait_until(
            lambda: stamp_ns in self.answers(), 'map->odom for the scan of %.1f s' % (stamp_ns / ros.NS_PER_S)
        )
        return pose_from_transform(self.answers()[stamp_ns]).compose(self.odom_pose)

    def localized(self):
        """A good scan's answer."""
        return self.answered(self.send_scan())

    def assert_near(self, pose, expected, within_m, within_deg=5.0):
        self.assertLess(math.hypot(pose.x_m - expected.x_m, pose.y_m - expected.y_m), within_m, (pose, expected))
        self.assertLess(ros.angle_between(pose.yaw_rad, expected.yaw_rad), math.radians(within_deg), (pose, expected))

    def be_kidnapped(self, to):
        """Carried off unseen by odometry, until the node has noticed; returns the scans' stamps."""
        self.true_pose = to
        self.rosout.clear()
        stamps = [self.send_scan() for _ in range(8)]
        self.assert_warned_once(NODE, 'lost:')
        return stamps

    def scans_until_found(self):
        count = len(self.answers())
        ros.wait_until(lambda: self.send_scan() and len(self.answers()) > count, 'map->odom again')

    # --- estimates

    def test_the_transform_is_dated_ahead_and_repeated_without_a_new_estimate(self):
        self.assert_near(self.localized(), START, 0.05)
        estimate = self.poses.wait_for_stamp(self.epoch_ns)[-1]
        self.assertEqual(estimate.header.frame_id, 'map')
        self.assert_near(pose_from_message(estimate.pose.pose), START, 0.05)
        transform = self.answers()[self.epoch_ns]
        self.assertEqual(transform.child_frame_id, 'odom')
        again = self.send_scan()
        self.answered(again)
        self.assertEqual(self.answers()[again].transform, transform.transform)
        self.assertEqual([ros.stamp_ns_of(message) for message in self.poses.messages], [self.epoch_ns])

    def test_a_cloud_after_each_update_and_a_pose_after_each_second(self):
        stamps = []
        for _ in range(5):
            stamps.append(self.send_scan())
            self.answered(stamps[-1])
            self.localized()  # on the spot: no update
            self.move(0.3, 0.42)
        self.clouds.wait_for_count(5)
        self.poses.wait_for_count(3)
        self.assert_stamps(self.clouds.messages, stamps)
        self.assert_stamps(self.poses.messages, [stamps[0], stamps[1], stamps[3]])
        cloud = self.clouds.messages[0]
        self.assertEqual((cloud.header.frame_id, len(cloud.poses)), ('map', 3000))

    def test_parameters_change_while_it_runs(self):
        """As with upstream: names and limits of its AMCL.cfg."""
        client = Client(NODE, timeout=20.0)
        self.addCleanup(client.close)
        self.addCleanup(client.update_configuration, {'restore_defaults': True})
        self.localized()
        values = client.update_configuration({'min_particles': 50, 'max_particles': 200, 'resample_interval': 0})
        self.assertEqual([values[name] for name in ('max_particles', 'resample_interval')], [200, 1], 'clamped')
        self.move(0.3, 0.42)
        self.clouds.clear()
        self.assert_near(self.localized(), self.true_pose, 0.1)
        self.assertLessEqual(len(self.clouds.wait_for_count(1)[-1].poses), 200)
        self.assertEqual(rospy.get_param(NODE + '/max_particles'), 200)
        for change, words in (({'min_particles': 300}, 'min_particles (300)'), ({'odom_frame_id': 'wheels'}, 'until')):
            name = next(iter(change))
            self.assertEqual(client.update_configuration(change)[name], values[name])
            self.rosout.wait_for_warning(NODE, 'not changed', words)
        client.update_configuration({'tf_broadcast': False})
        silent = self.send_scan()
        client.update_configuration({'tf_broadcast': True})
        self.localized()
        self.assertNotIn(silent, self.answers())

    def test_updates_on_request_without_motion_and_of_a_spread_cloud(self):
        self.localized()
        rospy.ServiceProxy('request_nomotion_update', Empty)()
        self.clouds.wait_for_stamp(self.send_scan())
        self.localized()
        self.assertEqual(len(self.clouds.messages), 2)
        rospy.ServiceProxy('global_localization', Empty)()
        stamp_ns = self.send_scan()
        self.clouds.wait_for_stamp(stamp_ns)
        positions = np.array([[pose.position.x, pose.position.y] for pose in self.clouds.messages[-1].poses])
        self.assertGreater(positions.std(axis=0).min(), 1.0)
        self.guesses.publish(self.guess(START))
        self.scans_until_found()
        self.assert_near(self.localized(), START, 0.1)
        self.assertNotIn(stamp_ns, self.answers())  # the pose was not known then

    def test_the_pose_is_saved(self):
        saved = {'pose_x': (START.x_m, 0.05), 'pose_a': (START.yaw_rad, 0.1), 'cov_xx': (0.0025, 0.001)}

        def is_saved():
            found = [(rospy.get_param(f'{NODE}/initial_{name}'), *each) for name, each in saved.items()]
            return self.localized() and all(abs(value - expected) < within for value, expected, within in found)

        ros.wait_until(is_saved, 'the estimate among the parameters')
        self.assertEqual(rospy.get_param(OTHER + '/initial_pose_y'), 0.0)  # as at its start: save_pose_rate is 0

    # --- bad input

    def test_a_bad_map_or_pose_is_refused(self):
        before = self.localized()
        no_rotation = self.guess(START)
        no_rotation.pose.pose.orientation = Quaternion(0, 0, 0, 0)
        bad = {
            'position': self.guess(Pose2D(ros.NAN, 0, 0)),
            'no rotation': no_rotation,
            'variance': self.guess(START, -SURE),
            'finite': self.guess(START, np.diag([ros.NAN, 1, 1])),
            "'odom'": self.guess(START, frame='odom'),
        }
        for words, given in {'map of 0 x 0': self.guess(ELSEWHERE), **bad}.items():
            self.assertFalse(self.set_map(OccupancyGrid() if '0 x 0' in words else self.map, given).success)
            self.rosout.wait_for_warning(NODE, 'set_map', words)
        self.rosout.clear()
        for given in bad.values():
            self.guesses.publish(given)
        ros.wait_until(lambda: len(self.rosout.warnings_of(NODE)) >= len(bad), 'a warning of each pose')
        self.assertEqual(len(self.rosout.warnings_of(NODE)), len(bad))
        self.assert_near(self.localized(), before, 1e-9, 1e-6)  # neither begun again nor shaken

    # --- lost

    def test_time_that_goes_back_begins_again(self):
        self.localized()
        self.transforms.clear()
        self.now_ns = self.epoch_ns - 100 * ros.NS_PER_S
        self.true_pose = IDENTITY  # as the parameters have it
        stamps = []
        answers = ros.wait_until(
            lambda: stamps.append(self.send_scan()) or self.answers(), 'map->odom after time went back'
        )
        self.assertTrue(set(answers) <= set(stamps))
        self.assert_near(self.localized(), IDENTITY, 0.3)
        self.rosout.wait_for_warning(NODE, 'went back', 'localization restarts')

    def test_carried_off_it_stops_vouching_until_carried_back_or_found_by_a_pose(self):
        self.localized()
        kidnapped = self.be_kidnapped(ELSEWHERE)
        self.true_pose = START
        self.scans_until_found()
        self.assert_near(self.localized(), START, 0.05)
        self.assertFalse(set(kidnapped[5:]) & set(self.answers()))
        self.assertTrue(set(kidnapped[:4]) <= set(self.answers()))  # not at the first bad scan
        ros.wait_until(
            lambda: any('localized again:' in line for line in self.rosout.lines_of(NODE)), 'a line that it is'
        )
        self.be_kidnapped(ELSEWHERE)
        near = Pose2D(ELSEWHERE.x_m + 0.15, ELSEWHERE.y_m - 0.1, ELSEWHERE.yaw_rad + 0.1)
        self.guesses.publish(self.guess(near, UNSURE))
        self.scans_until_found()
        self.assert_near(self.localized(), ELSEWHERE, 0.3, 12.0)

    # --- maps by topic

    def test_one_map_by_topic_is_enough_and_names_may_have_slashes(self):
        poses = ros.Collector('/by_topic/amcl_pose', PoseWithCovarianceStamped)
        self.maps.publish(map_message(self.room, 0, 'site'))
        scan = self.scan(true_pose=Pose2D(0.5, 0.0, 0.0))
        ros.wait_until(lambda: self.send_scan(scan) and poses.messages, 'an estimate in site')
        transform = ros.wait_until(lambda: list(self.answers('site').values()), 'a transform from site')[-1]
        self.assertEqual(transform.child_frame_id, 'odom')
        self.assert_near(pose_from_transform(transform).compose(self.odom_pose), Pose2D(0.5, 0.0, 0.0), 0.1)
        self.maps.publish(map_message(self.room, 0, 'site'))
        count = len(self.answers('site'))
        ros.wait_until(lambda: self.send_scan(scan) and len(self.answers('site')) > count + 10, 'further answers')
        self.assertEqual(len(poses.messages), 1)  # not begun again


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'amcl_test', AmclTest)
