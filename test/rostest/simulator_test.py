#!/usr/bin/env python3
"""The contract of simulator_node, the stand-in for Gazebo. Started by simulation.test.

What is asserted of motion is asserted on the stamps.
"""

import math
import time
from pathlib import Path

import numpy as np
import ros_testing as ros
import rospy
import rosservice
import rostest
from geometry_msgs.msg import Twist
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState, LaserScan
from std_srvs.srv import Empty

from diff_encoder_sim.base.se2 import Pose2D, quat_xyzw_from_yaw
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expansion
from diff_encoder_sim.ros.gazebo_states import GetModelState, ModelStates, SetModelState
from diff_encoder_sim.simulation.lidar import Lidar, LidarParams
from diff_encoder_sim.simulation.world import load_world

TICK_NS = 10000000
WHEEL_RADIUS, SEPARATION = 0.1, 0.4
ACCELERATION = 1.5  # default max_linear_acceleration [m/s^2]
TOP_SPEED = 1.0  # default max_linear_speed [m/s]
COMMAND_TIMEOUT = 0.5  # default command_timeout [s]
ROOT = Path(__file__).resolve().parents[2]
START = -10.0, 0.5, 0.3  # of `first`; the other's is 0
RAYS, NOISE = 1000, 0.03  # default lidar.samples and lidar.noise [m]


class Simulator:
    """One simulator_node: its topics and services."""

    def __init__(self, name):
        self.node, self.command_topic = f'/{name}/simulator_node', f'/{name}/cmd_vel'
        self.clock = ros.Collector(f'/{name}/clock', Clock)
        self.joints = ros.Collector(f'/{name}/joint_states', JointState)
        self.models = ros.Collector(f'/{name}/model_states', ModelStates)
        self.scans = ros.Collector(f'/{name}/scan', LaserScan)
        for service in ('pause_physics', 'unpause_physics', 'reset_simulation', 'reset_world'):
            rospy.wait_for_service(f'/{name}/{service}', ros.TIMEOUT_S)
            setattr(self, service, rospy.ServiceProxy(f'/{name}/{service}', Empty))
        self.set_model_state = rospy.ServiceProxy(f'/{name}/set_model_state', SetModelState)
        self.get_model_state = rospy.ServiceProxy(f'/{name}/get_model_state', GetModelState)
        self._commands = ros.connected_publisher(self.command_topic, Twist, [self.node])

    def clear(self):
        for collector in (self.clock, self.joints, self.models, self.scans):
            collector.clear()

    def command(self, linear, angular=0.0):
        message = Twist()
        message.linear.x, message.angular.z = linear, angular
        self._commands.publish(message)

    def drive(self, linear, angular=0.0, duration=0.0):
        """Command a velocity on and on, until it is reached and `duration` of simulated time has passed since then."""
        reached_ns, half = None, 0.5 * SEPARATION * angular
        wanted = (linear - half) / WHEEL_RADIUS, (linear + half) / WHEEL_RADIUS
        deadline = time.monotonic() + ros.TIMEOUT_S
        while reached_ns is None or self.now_ns() < reached_ns + duration * ros.NS_PER_S:
            self.command(linear, angular)
            time.sleep(0.02)
            joints = self.joints.messages[-1:]
            if reached_ns is None and joints and np.allclose(joints[0].velocity, wanted, atol=0.02):
                reached_ns = self.now_ns()
            if time.monotonic() > deadline:
                raise AssertionError(f'does not drive at {linear} m/s, {angular} rad/s:\n{joints}')

    def now_ns(self):
        return self.clock.wait_for_count(1)[-1].clock.to_nsec()

    def place(self, x=2.0, y=-0.5, yaw=1.0, model='alto', frame='', orientation=None, twist=(0.0, 0.0, 0.0)):
        """Ask for the robot to be elsewhere; the response."""
        request = SetModelState._request_class()
        state = request.model_state
        state.model_name, state.reference_frame = model, frame
        state.pose.position.x, state.pose.position.y = x, y
        quaternion = state.pose.orientation
        quaternion.x, quaternion.y, quaternion.z, quaternion.w = orientation or quat_xyzw_from_yaw(yaw)
        state.twist.linear.x, state.twist.linear.y, state.twist.angular.z = twist
        return self.set_model_state(request)

    def true_pose(self):
        """By the service, so that it is the newest even in a pause."""
        response = self.get_model_state('alto', 'world')
        assert response.success, response
        return response.pose.position.x, response.pose.position.y, ros.yaw_of(response.pose.orientation)

    def wait_until_time_stands(self):
        """While paused the clock repeats itself."""
        self.clock.clear()
        self.clock.wait_for(lambda got: len(got) > 3 and got[-1].clock == got[-3].clock, 'three times the same')

    def speeds(self):
        return [(ros.stamp_ns_of(message) / ros.NS_PER_S, message.velocity) for message in self.joints.messages]


def true_ranges(x, y, yaw):
    """What the scanner sees without noise when base_link is there; inf beyond its range."""
    mount = parse_urdf(expansion(RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro')).urdf, 'alto').poses['laser'][:3, 3]
    lidar = Lidar(load_world(ROOT / 'worlds' / 'hallway.world'), mount[2], LidarParams(), np.random.default_rng(0))
    ranges = lidar.true_ranges_m(Pose2D(x, y, yaw).compose(Pose2D(mount[0], mount[1], 0.0)))
    return np.where(ranges <= lidar.params.range_max, ranges, np.inf)


class SimulatorTest(ros.NodeTest):
    @classmethod
    def setUpClass(cls):
        ros.start_test_node('simulator_test')
        cls.first, cls.other = (Simulator(name) for name in ('first', 'other'))
        cls.rosout = ros.RosoutWatch()

    def setUp(self):
        super().setUp()
        for simulator in (self.first, self.other):
            simulator.pause_physics()
            simulator.wait_until_time_stands()
            simulator.reset_simulation()
            ros.wait_until(lambda simulator=simulator: simulator.now_ns() == 0, 'the clock at zero')
            simulator.clear()

    def assert_pose(self, given, expected, tolerance=1e-6):
        self.assertLess(math.hypot(given[0] - expected[0], given[1] - expected[1]), tolerance, given)
        self.assertLess(ros.angle_between(given[2], expected[2]), tolerance, given)

    # --- topics and time

    def test_clock_joints_models_and_scans_at_their_rates_with_no_gap_over_a_pause(self):
        clock = []
        for until_s in (0.4, 0.8):
            self.first.unpause_physics()
            self.first.clock.wait_for(lambda got, s=until_s: got and got[-1].clock.to_sec() >= s, 'time')
            self.first.pause_physics()
            self.first.clock.wait_for(lambda got: got[-1].clock == got[-3].clock, 'a paused clock')
            clock += [message.clock.to_nsec() for message in self.first.clock.messages]
            count = len(self.first.joints.messages)
            self.first.wait_until_time_stands()
            self.assertEqual(len(self.first.joints.messages), count)
        last_ns = clock[-1]
        self.assertEqual(sorted(set(clock)), list(range(0, last_ns + 1, TICK_NS)))  # each 10 ms
        self.assertEqual(clock, sorted(clock))
        # The newest tick itself is published when time goes on.
        for collector, period_ns in ((self.first.joints, TICK_NS), (self.first.scans, 10 * TICK_NS)):
            stamps = [
                ros.stamp_ns_of(message)
                for message in collector.wait_for_stamp((last_ns - TICK_NS) // period_ns * period_ns)
            ]
            self.assertEqual(stamps, list(range(0, stamps[-1] + 1, period_ns)))
        self.assertIn(len(self.first.models.messages) - (last_ns - TICK_NS) // (5 * TICK_NS), (1, 2))  # 20 Hz

    def test_model_states_and_services_are_gazebos_own_types_with_the_world_and_the_robot(self):
        name = '/first/set_model_state'
        self.assertEqual(rosservice.get_service_type(name), 'gazebo_msgs/SetModelState')
        headers = rosservice.get_service_headers(name, rosservice.get_service_uri(name))
        self.assertEqual(headers['md5sum'], '5b3ab0281d4f5445def017e3a2e4a07b')
        self.assertEqual(GetModelState._md5sum, '4c515e936d3319c9610c559c60bfc3d4')
        raw = ros.Collector('/first/model_states', rospy.AnyMsg)
        self.first.unpause_physics()
        header = raw.wait_for_count(1)[0]._connection_header
        self.assertEqual(
            (header['type'], header['md5sum']), ('gazebo_msgs/ModelStates', '48c080191eb15c41858319b4d8a609c2')
        )
        raw.stop()
        message = self.first.models.wait_for_count(1)[0]
        self.assertEqual((len(message.name), len(message.name)), (len(message.pose), len(message.twist)))
        self.assertGreater(len(message.name), 2)
        pose = message.pose[message.name.index('alto')]
        self.assert_pose((pose.position.x, pose.position.y, ros.yaw_of(pose.orientation)), START)

    def test_scan_is_the_geometry_at_the_start_and_noise_of_the_seed(self):
        noises = []
        for simulator, start in ((self.first, START), (self.other, (0.0, 0.0, 0.0))):
            simulator.unpause_physics()
            scan = simulator.scans.wait_for_count(1)[0]
            simulator.pause_physics()
            expected, ranges = true_ranges(*start), np.array(scan.ranges)
            # A surface that is just within range may be lost to noise; none appears from beyond.
            self.assertTrue(np.isposinf(ranges[np.isinf(expected)]).all())
            self.assertTrue(np.isfinite(ranges[expected < 6.0 - 6.0 * NOISE]).all())
            self.assertGreater(np.isinf(expected).sum(), 10)
            noise = np.where(np.isfinite(ranges), ranges, np.nan) - np.where(np.isfinite(expected), expected, np.nan)
            self.assertLess(np.nanmax(np.abs(noise)), 6.0 * NOISE)
            self.assertAlmostEqual(np.nanstd(noise), NOISE, delta=0.15 * NOISE)
            noises.append(noise)
            period_s = 0.1 if simulator is self.first else 0.2  # lidar.rate
            self.assertEqual((scan.header.frame_id, len(scan.intensities), scan.time_increment), ('laser', 0, 0.0))
            given = scan.angle_min, scan.angle_increment, scan.scan_time, scan.range_min, scan.range_max
            np.testing.assert_allclose(given, (-math.pi, 2.0 * math.pi / RAYS, period_s, 0.15, 6.0), atol=1e-6)
        self.assertGreater(np.nanmax(np.abs(noises[0] - noises[1])), NOISE)

    # --- moved by hand

    def test_kidnapped_robot_is_elsewhere_and_its_encoder_sees_nothing(self):
        self.first.unpause_physics()
        self.first.joints.wait_for_stamp(3 * TICK_NS)
        self.first.pause_physics()
        self.first.wait_until_time_stands()
        joints = self.first.joints.messages[-1]
        for frame, pose in (('', (2.0, -0.5, 1.0)), ('world', (-3.0, 0.5, -2.0))):
            response = self.first.place(*pose, frame=frame)
            self.assertTrue(response.success, response)
            self.assert_pose(self.first.true_pose(), pose)
        self.first.clear()
        self.first.unpause_physics()
        after = self.first.joints.wait_for_count(2)[1]
        self.assertLessEqual(ros.stamp_ns_of(after) - ros.stamp_ns_of(joints), 3 * TICK_NS)  # time went on
        np.testing.assert_allclose(after.position, joints.position, atol=1e-3)
        scan, expected = self.first.scans.wait_for_count(1)[0], true_ranges(-3.0, 0.5, -2.0)
        seen = np.isfinite(expected) & np.isfinite(scan.ranges)
        self.assertGreater(seen.sum(), 300)
        self.assertLess(np.median(np.abs(np.array(scan.ranges) - expected)[seen]), 2.0 * NOISE)

    def test_what_cannot_be_is_refused_and_nothing_moves(self):
        for arguments, word in (
            (dict(model='atlo'), "did you mean 'alto'"),
            (dict(model='hallway_walls'), "'hallway_walls' is fixed"),
            (dict(frame='base_link'), "'base_link'"),
            (dict(x=ros.NAN), 'nan'),
            (dict(x=1e300), '1e+300'),
            (dict(orientation=(0.0, 0.0, 0.0, 0.0)), 'no rotation'),
            (dict(twist=(ros.NAN, 0.0, 0.0)), 'twist'),
        ):
            response = self.first.place(**arguments)
            self.assertFalse(response.success, arguments)
            self.assertIn(word, response.status_message)
        self.assert_pose(self.first.true_pose(), START)

    # --- resets

    def test_resets_of_the_world_and_of_the_simulation(self):
        self.first.unpause_physics()
        first_message = self.first.joints.wait_for_count(1)[0]
        self.first.drive(0.5, duration=0.2)
        moved = self.first.true_pose()
        self.assertGreater(math.hypot(moved[0] - START[0], moved[1] - START[1]), 0.05)
        before_ns, turned = self.first.now_ns(), self.first.joints.messages[-1].position
        self.first.reset_world()
        self.assert_pose(self.first.true_pose(), START, 0.05)
        stamps = [message.clock.to_nsec() for message in self.first.clock.messages]
        self.assertEqual(stamps, sorted(stamps))
        self.assertGreaterEqual(self.first.now_ns(), before_ns)  # time goes on, and wheels keep their angles
        self.assertTrue((np.array(self.first.joints.messages[-1].position) >= np.array(turned) - 0.05).all())
        self.first.clear()
        self.first.reset_simulation()
        again = next(message for message in self.first.joints.wait_for_stamp(0) if ros.stamp_ns_of(message) == 0)
        self.assertEqual(again.position, first_message.position)
        self.first.joints.wait_for_stamp(5 * TICK_NS)
        self.assert_pose(self.first.true_pose(), START, 1e-3)  # and the last command is forgotten

    # --- cmd_vel

    def test_commands_are_obeyed_within_the_limits_and_time_out(self):
        self.first.unpause_physics()
        self.first.drive(0.45, duration=0.3)
        x, y, yaw = self.first.true_pose()
        # Straight ahead from the start, as far as wheels turned.
        ahead = Pose2D(x, y, yaw).relative_to(Pose2D(*START))
        self.assertLess(abs(ahead.y_m), 0.01)
        self.assertGreater(ahead.x_m, 0.1)
        self.first.drive(0.3, 0.8, duration=0.3)
        self.assertGreater(ros.angle_between(self.first.true_pose()[2], yaw), 0.1)
        linear = np.array([0.5 * WHEEL_RADIUS * sum(velocity) for _, velocity in self.first.speeds()])
        # The controller ramps; the physics behind it follows within a fifth.
        self.assertTrue(0.5 < np.abs(np.diff(linear)).max() / (0.01 * ACCELERATION) < 1.2)
        self.assertEqual(self.rosout.warnings_of(self.first.node), [])
        self.first.drive(0.9)
        for step in range(20):  # each a bit different, as a joystick's are
            self.first.command(3.0 + 0.01 * step)
            time.sleep(0.02)
        self.first.drive(TOP_SPEED, duration=0.1)
        self.assertLess(max(max(velocity) for _, velocity in self.first.speeds()), 1.05 * TOP_SPEED / WHEEL_RADIUS)
        warned = self.rosout.wait_for_warning(self.first.node, 'limit')
        self.assertLessEqual(len(warned), 2, warned)
        self.first.joints.clear()
        silent_since = self.first.now_ns() / ros.NS_PER_S
        self.first.joints.wait_for(lambda got: got and np.abs(got[-1].velocity).max() < 0.01, 'a standstill')
        slower = next(
            stamp for stamp, velocity in self.first.speeds() if max(velocity) < 0.9 * TOP_SPEED / WHEEL_RADIUS
        )
        # The last command may have taken effect a moment before or after the clock was read.
        self.assertTrue(0.5 * COMMAND_TIMEOUT < slower - silent_since < 2.0 * COMMAND_TIMEOUT)


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'simulator', SimulatorTest)
