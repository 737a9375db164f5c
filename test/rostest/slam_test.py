#!/usr/bin/env python3
"""The contract of slam_node: slam_gmapping's. Started by localization.test."""

import math
import sys
from pathlib import Path

import ros_testing as ros
import rospy
import rostest
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float64
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.ros.maps import grid_from_message
from diff_encoder_sim.ros.messages import pose_from_message, pose_from_transform

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'support'))
from slam_room import SEGMENTS, room_scan

NODE = '/mapping/slam_gmapping'
LASER, START = Pose2D(0.1, 0.0, 0.2), Pose2D(0.0, -0.5, 0.0)
STEP_NS = ros.NS_PER_S // 10


class SlamTest(ros.NodeTest):
    @classmethod
    def setUpClass(cls):
        ros.start_test_node('slam_test')
        cls.tf = ros.connected_publisher('/mapping/tf', TFMessage, [NODE])
        cls.scans = ros.connected_publisher('/mapping/scan', LaserScan, [NODE])
        cls.static = ros.connected_publisher('/mapping/tf_static', TFMessage, [NODE])
        cls.static.publish(TFMessage([ros.transform_message(LASER, 0, 'base_link', 'laser')]))
        cls.maps = ros.Collector('/mapping/map', OccupancyGrid)
        cls.metadata = ros.Collector('/mapping/map_metadata', MapMetaData)
        cls.entropies = ros.Collector(NODE + '/entropy', Float64)
        cls.poses = ros.Collector(NODE + '/pose', PoseStamped)
        cls.transforms = ros.Collector('/mapping/tf', TFMessage)
        cls.dynamic_map = rospy.ServiceProxy('/mapping/dynamic_map', GetMap)
        cls.rosout = ros.RosoutWatch()
        cls.now_ns = 1000 * ros.NS_PER_S
        cls.true_pose = START  # odometry begins here at zero

    def send(self, message=None, with_odometry=True):
        """Two scans of now, of which every second one counts; and what odometry says."""
        for _ in range(2):
            type(self).now_ns += STEP_NS
            if with_odometry:
                odom_pose = self.true_pose.relative_to(START)
                self.tf.publish(TFMessage([ros.transform_message(odom_pose, self.now_ns, 'odom', 'base_link')]))
            scan = message or ros.scan_message(room_scan(self.true_pose, laser_pose_in_base=LASER), 'laser', 0.1)
            scan.header.stamp = ros.stamp_from_ns(self.now_ns)
            self.scans.publish(scan)

    def enter(self, move, message=None):
        """Move far enough for the next scan to be entered, and wait until it is."""
        entered = len(self.entropies.messages)
        type(self).true_pose = self.true_pose.compose(move)
        self.send(message)
        self.entropies.wait_for_count(entered + 1)
        self.poses.wait_for_stamp(self.now_ns)

    def turn(self, message=None):
        self.enter(Pose2D(0.0, 0.0, 0.5), message)

    def test_1_the_first_scan_makes_a_map(self):
        self.enter(Pose2D(0.0, 0.0, 0.0))
        message = self.maps.wait_for_count(1)[0]
        self.assertEqual(message.header.frame_id, 'map')
        self.assertAlmostEqual(message.info.resolution, 0.05)
        self.assertEqual(self.metadata.wait_for_count(1)[0], message.info)

    def test_2_the_map_shows_the_room_and_the_transform_puts_the_robot_into_it(self):
        for _ in range(4):
            self.enter(Pose2D(0.4, 0.0, 0.0))
        grid = grid_from_message(self.dynamic_map().map)
        # The map's frame is odom's, which began at the robot; the room's wall is at x = 2.48.
        row, column = grid.cell_at(SEGMENTS[0][2], 0.5)
        wall = (grid.cells[row - 5 : row + 6, column - 1 : column + 2] == 100).any(axis=1)
        self.assertGreater(wall.mean(), 0.3)  # far off, rays lie more than a cell apart
        self.assertEqual(grid.cells[grid.cell_at(1.0, 0.5)], 0)
        self.maps.wait_for_count(2)

        def chains(messages):
            return [one for message in messages for one in message.transforms if one.header.frame_id == 'map']

        newest = chains(self.transforms.wait_for(chains, 'a transform from map'))[-1]
        pose = pose_from_transform(newest)
        self.assertLess(math.hypot(pose.x_m, pose.y_m), 0.03)
        self.assertLess(ros.angle_between(pose.yaw_rad, 0.0), 0.02)
        self.assertEqual(newest.child_frame_id, 'odom')
        answer = self.poses.wait_for_stamp(self.now_ns)[-1]
        self.assertEqual(answer.header.frame_id, 'map')
        self.assertAlmostEqual(pose_from_message(answer.pose).x_m, 4 * 0.4, delta=0.03)

    def test_3_scans_without_odometry_or_ranges_are_named_and_the_map_is_kept(self):
        before = self.dynamic_map().map.data
        for _ in range(20):
            self.send(with_odometry=False)
        self.rosout.wait_for_warning(NODE, "no transform from 'base_link' to 'odom'")
        self.assertEqual(self.dynamic_map().map.data, before)
        self.turn()  # it goes on when odometry does
        nothing = ros.scan_message(room_scan(self.true_pose), 'laser', 0.1)
        nothing.ranges = []
        self.send(nothing)
        self.rosout.wait_for_warning(NODE, 'scan dropped')
        self.turn(ros.scan_message(room_scan(self.true_pose, laser_pose_in_base=LASER, ray_count=200), 'laser', 0.1))

    def test_4_time_that_goes_back_is_named_and_the_map_is_kept(self):
        before = self.dynamic_map().map.data
        now_ns, type(self).now_ns = self.now_ns, self.now_ns - 5 * ros.NS_PER_S
        self.send(with_odometry=False)
        self.rosout.wait_for_warning(NODE, 'went back to 1000.')
        self.assertEqual(self.dynamic_map().map.data, before)
        type(self).now_ns = now_ns
        self.turn()


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'slam_test', SlamTest)
