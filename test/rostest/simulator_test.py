#!/usr/bin/env python3
"""The contract of simulator_node, the stand-in for Gazebo. Started by simulator.test.

What is asserted of motion is asserted on the stamps; only the real-time factor is about the wall clock, and loosely.
"""

import math
import subprocess
import time
from pathlib import Path

import numpy as np
import rospy
import rosservice
import rostest
from geometry_msgs.msg import Twist
from ros_testing import (
    NS_PER_S,
    TIMEOUT_S,
    Collector,
    NodeTest,
    RosoutWatch,
    angle_between,
    connected_publisher,
    stamp_ns_of,
    start_test_node,
    wait_for_listeners,
    wait_until,
    yaw_of,
)
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState, LaserScan
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.base.se2 import Pose2D, quat_xyzw_from_yaw
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expand
from diff_encoder_sim.ros.gazebo_states import GetModelState, ModelStates, SetModelState
from diff_encoder_sim.simulation.lidar import Lidar, LidarParams
from diff_encoder_sim.simulation.world import load_world

TICK_NS = 10000000
WHEEL_RADIUS, SEPARATION = 0.1, 0.4
ACCELERATION = 1.5  # default max_linear_acceleration [m/s^2]
TOP_SPEED = 1.0  # default max_linear_speed [m/s]
COMMAND_TIMEOUT = 0.5  # default command_timeout [s]
NAN = float('nan')
ROOT = Path(__file__).resolve().parents[2]
START = -10.0, 0.5, 0.3  # of `first`; the others' is 0
SCAN_PERIOD_NS = 100000000
RAYS, NOISE = 1000, 0.03  # default lidar.samples and lidar.noise [m]


class Simulator:
    """One simulator_node: its topics and services."""

    def __init__(self, name):
        self.node = f'/{name}/simulator_node'
        self.command_topic = f'/{name}/cmd_vel'
        self.clock = Collector(f'/{name}/clock', Clock)
        self.joints = Collector(f'/{name}/joint_states', JointState)
        self.models = Collector(f'/{name}/model_states', ModelStates)
        self.raw_models = Collector(f'/{name}/model_states', rospy.AnyMsg)
        self.scans = Collector(f'/{name}/scan', LaserScan)
        for service in ('pause_physics', 'unpause_physics', 'reset_simulation', 'reset_world'):
            full_name = f'/{name}/{service}'
            rospy.wait_for_service(full_name, TIMEOUT_S)
            setattr(self, service, rospy.ServiceProxy(full_name, Empty))
        models = '/gazebo' if name == 'first' else '/' + name
        self.set_model_state = rospy.ServiceProxy(models + '/set_model_state', SetModelState)
        self.get_model_state = rospy.ServiceProxy(models + '/get_model_state', GetModelState)
        self._commands = connected_publisher(self.command_topic, Twist)
        wait_for_listeners(self._commands, [self.node])

    def clear(self):
        for collector in (self.clock, self.joints, self.models, self.raw_models, self.scans):
            collector.clear()

    def command(self, linear, angular=0.0):
        message = Twist()
        message.linear.x, message.angular.z = linear, angular
        self._commands.publish(message)

    def drive(self, linear, angular=0.0, duration=0.0, disturbance=None):
        """Command a velocity on and on, until it is reached and `duration` of simulated time has passed since then."""
        reached_ns = None
        deadline = time.monotonic() + TIMEOUT_S
        while reached_ns is None or self.now_ns() < reached_ns + duration * NS_PER_S:
            self.command(linear, angular)
            if disturbance is not None:
                time.sleep(0.02)  # so that it is not simply overtaken by the next good command
                disturbance()
            time.sleep(0.02)
            if reached_ns is None and self.moves_at(linear, angular):
                reached_ns = self.now_ns()
            if time.monotonic() > deadline:
                raise AssertionError(f'does not drive at {linear} m/s, {angular} rad/s:\n{self.joints.messages[-1]}')

    def moves_at(self, linear, angular=0.0):
        joints = self.joints.messages
        return bool(joints) and all(
            abs(speed - wanted) < 0.02 for speed, wanted in zip(joints[-1].velocity, wheel_speeds(linear, angular))
        )

    def now_ns(self):
        return self.clock.wait_for_count(1)[-1].clock.to_nsec()

    def pose(self):
        return self.pose_in(self.models.wait_for_count(1)[-1])

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
        return response.pose.position.x, response.pose.position.y, yaw_of(response.pose.orientation)

    @staticmethod
    def pose_in(message):
        pose = message.pose[message.name.index('alto')]
        return pose.position.x, pose.position.y, yaw_of(pose.orientation)


def wheel_speeds(linear, angular):
    half = 0.5 * SEPARATION * angular
    return (linear - half) / WHEEL_RADIUS, (linear + half) / WHEEL_RADIUS


def laser_mount():
    """The laser's place in base_link."""
    return parse_urdf(expand(RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro')), 'alto').poses['laser'][:3, 3]


def true_ranges(x, y, yaw):
    """What the scanner sees without noise when base_link is there; inf beyond its range."""
    mount = laser_mount()
    lidar = Lidar(load_world(ROOT / 'worlds' / 'hallway.world'), mount[2], LidarParams(), np.random.default_rng(0))
    ranges = lidar.true_ranges_m(Pose2D(x, y, yaw).compose(Pose2D(mount[0], mount[1], 0.0)))
    return np.where(ranges <= lidar.params.range_max, ranges, np.inf)


def clock_stamps(simulator):
    return [message.clock.to_nsec() for message in simulator.clock.messages]


class SimulatorTest(NodeTest):
    @classmethod
    def setUpClass(cls):
        start_test_node('simulator_test')
        cls.first, cls.same, cls.other = (Simulator(name) for name in ('first', 'same', 'other'))
        cls.rosout = RosoutWatch()

    def setUp(self):
        super().setUp()
        for simulator in (self.first, self.same, self.other):
            simulator.pause_physics()
            self.wait_until_time_stands(simulator)
            simulator.reset_simulation()
            wait_until(lambda: simulator.now_ns() == 0, 'the clock at zero')
            simulator.clear()

    def wait_until_time_stands(self, simulator):
        """While paused the clock repeats itself."""
        simulator.clock.clear()
        simulator.clock.wait_for(
            lambda messages: len(messages) > 3 and messages[-1].clock == messages[-3].clock, 'three times the same'
        )

    def assert_pose(self, given, expected, tolerance):
        self.assertLess(math.hypot(given[0] - expected[0], given[1] - expected[1]), tolerance, given)
        self.assertLess(angle_between(given[2], expected[2]), tolerance, given)

    # --- topics -------------------------------------------------------------------------------------------------------

    def test_clock_joints_and_models_at_their_rates(self):
        self.first.unpause_physics()
        self.first.clock.wait_for(lambda messages: messages[-1].clock.to_sec() >= 1.0 if messages else False, '1 s')
        self.first.pause_physics()
        self.wait_until_stamps_agree()
        last_ns = self.first.now_ns()
        stamps = [stamp_ns_of(message) for message in self.first.joints.messages]
        self.assertEqual(stamps, list(range(0, stamps[-1] + 1, TICK_NS)))  # 100 Hz, from zero, none missing
        self.assertGreaterEqual(stamps[-1], last_ns - TICK_NS)
        self.assertEqual(sorted(set(self.first_clock)), list(range(0, last_ns + 1, TICK_NS)))  # each 10 ms
        self.assertEqual(self.first_clock, sorted(self.first_clock))
        self.assertEqual(len(self.first.models.messages), stamps[-1] // (5 * TICK_NS) + 1)  # 20 Hz

    def wait_until_stamps_agree(self):
        """Until the pause has come to every topic; keeps the clock of all the run."""
        self.first.clock.wait_for(lambda messages: messages[-1].clock == messages[-3].clock, 'a paused clock')
        self.first_clock = clock_stamps(self.first)
        newest_ns = self.first_clock[-1] - TICK_NS  # the newest tick itself is published when time goes on
        self.first.joints.wait_for(lambda messages: stamp_ns_of(messages[-1]) >= newest_ns, 'the newest joints')
        count = stamp_ns_of(self.first.joints.messages[-1]) // (5 * TICK_NS) + 1
        self.first.models.wait_for_count(count)

    def test_model_states_are_gazebos_own_type_with_the_world_and_the_robot(self):
        self.first.unpause_physics()
        raw = self.first.raw_models.wait_for_count(1)[0]
        self.assertEqual(raw._connection_header['type'], 'gazebo_msgs/ModelStates')
        self.assertEqual(raw._connection_header['md5sum'], '48c080191eb15c41858319b4d8a609c2')
        message = self.first.models.wait_for_count(1)[0]
        self.assertEqual(len(message.name), len(message.pose))
        self.assertEqual(len(message.name), len(message.twist))
        self.assertGreater(len(message.name), 2)
        self.assert_pose(Simulator.pose_in(message), START, 1e-6)

    # --- scan ---------------------------------------------------------------------------------------------------------

    def scans_of(self, simulator, count):
        """The first scans since a reset."""
        simulator.scans.clear()
        simulator.unpause_physics()
        scans = simulator.scans.wait_for_count(count)[:count]
        simulator.pause_physics()
        return scans

    def test_scan_comes_at_its_rate_and_says_how_it_was_taken(self):
        scans = self.scans_of(self.first, 4)
        self.assertEqual([stamp_ns_of(scan) for scan in scans], [period * SCAN_PERIOD_NS for period in range(4)])
        for scan in scans:
            self.assertEqual(scan.header.frame_id, 'laser')
            self.assertEqual(len(scan.ranges), RAYS)
            self.assertEqual(len(scan.intensities), 0)
            self.assertAlmostEqual(scan.angle_min, -math.pi, places=6)
            self.assertAlmostEqual(scan.angle_increment, 2.0 * math.pi / RAYS, places=6)
            self.assertAlmostEqual(scan.angle_max, math.pi - 2.0 * math.pi / RAYS, places=6)
            self.assertAlmostEqual(scan.scan_time, 0.1, places=6)
            self.assertEqual(scan.time_increment, 0.0)
            self.assertAlmostEqual(scan.range_min, 0.15, places=6)
            self.assertAlmostEqual(scan.range_max, 6.0, places=6)

    def test_scan_is_the_geometry_at_the_start_and_noise_of_the_seed(self):
        first, same, other = (self.scans_of(simulator, 1)[0] for simulator in (self.first, self.same, self.other))
        noises = []
        for scan, start in ((first, START), (same, (0.0, 0.0, 0.0)), (other, (0.0, 0.0, 0.0))):
            expected = true_ranges(*start)
            ranges = np.array(scan.ranges)
            # A surface that is just within range may be lost to noise; none appears from beyond.
            self.assertTrue(np.isposinf(ranges[np.isinf(expected)]).all())
            self.assertTrue(np.isfinite(ranges[expected < 6.0 - 6.0 * NOISE]).all())
            self.assertGreater(np.isinf(expected).sum(), 10)
            noise = np.where(np.isfinite(ranges), ranges, np.nan) - np.where(np.isfinite(expected), expected, np.nan)
            self.assertLess(np.nanmax(np.abs(noise)), 6.0 * NOISE)
            self.assertAlmostEqual(np.nanstd(noise), NOISE, delta=0.15 * NOISE)
            noises.append(noise)
        both = np.isfinite(noises[0]) & np.isfinite(noises[1])
        self.assertGreater(both.sum(), 300)
        self.assertLess(np.abs(noises[0] - noises[1])[both].max(), 1e-5)  # one seed; ranges have 32 bits
        self.assertGreater(np.nanmax(np.abs(noises[1] - noises[2])), NOISE)

    def test_scanner_is_mounted_as_in_the_robot_file(self):
        static = Collector('/tf_static', TFMessage).wait_for(
            lambda messages: any(
                transform.child_frame_id == 'laser' for message in messages for transform in message.transforms
            ),
            'base_link to laser',
        )
        mount = next(
            transform for message in static for transform in message.transforms if transform.child_frame_id == 'laser'
        )
        self.assertEqual(mount.header.frame_id, 'base_link')
        translation, rotation = mount.transform.translation, mount.transform.rotation
        self.assertEqual((rotation.x, rotation.y, rotation.z), (0.0, 0.0, 0.0))
        np.testing.assert_allclose((translation.x, translation.y, translation.z), laser_mount(), atol=1e-9)

    # --- moved by hand ------------------------------------------------------------------------------------------------

    def test_services_are_gazebos_own_types(self):
        """As gazebo_msgs has them, so that programs that use it can call."""
        self.assertEqual(
            (SetModelState._type, SetModelState._md5sum),
            ('gazebo_msgs/SetModelState', '5b3ab0281d4f5445def017e3a2e4a07b'),
        )
        self.assertEqual(
            (GetModelState._type, GetModelState._md5sum),
            ('gazebo_msgs/GetModelState', '4c515e936d3319c9610c559c60bfc3d4'),
        )
        service = '/gazebo/set_model_state'
        self.assertEqual(rosservice.get_service_type(service), 'gazebo_msgs/SetModelState')
        self.assertEqual(
            rosservice.get_service_headers(service, rosservice.get_service_uri(service))['md5sum'],
            SetModelState._md5sum,
        )

    def test_kidnapped_robot_is_elsewhere_and_its_encoder_sees_nothing(self):
        self.first.unpause_physics()
        self.first.joints.wait_for_stamp(3 * TICK_NS)
        self.first.pause_physics()
        self.wait_until_time_stands(self.first)
        joints = self.first.joints.messages[-1]
        for frame, pose in (('', (2.0, -0.5, 1.0)), ('world', (-3.0, 0.5, -2.0))):
            response = self.first.place(*pose, frame=frame)
            self.assertTrue(response.success, response)
            self.assert_pose(self.first.true_pose(), pose, 1e-6)
        self.first.clear()
        self.first.unpause_physics()
        after = self.first.joints.wait_for_count(2)[1]
        self.assertLessEqual(stamp_ns_of(after) - stamp_ns_of(joints), 3 * TICK_NS)  # time went on
        np.testing.assert_allclose(after.position, joints.position, atol=1e-3)
        scan = self.first.scans.wait_for_count(1)[0]
        expected = true_ranges(-3.0, 0.5, -2.0)
        seen = np.isfinite(expected) & np.isfinite(scan.ranges)
        self.assertGreater(seen.sum(), 300)
        self.assertLess(np.median(np.abs(np.array(scan.ranges) - expected)[seen]), 2.0 * NOISE)

    def test_command_place_robot(self):
        command = ['rosrun', 'diff_encoder_sim', 'place_robot']
        done = subprocess.run(
            command + ['-3.5', '0.25', '-1.5'],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            timeout=2.0 * TIMEOUT_S,
        )
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assert_pose(self.first.true_pose(), (-3.5, 0.25, -1.5), 1e-6)
        done = subprocess.run(
            command + ['nan', '0', '0'], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=2.0 * TIMEOUT_S
        )
        self.assertEqual(done.returncode, 2, done.stdout)
        self.assertIn(b"x: given 'nan'; allowed: -1e6 to 1e6 [m]", done.stdout.splitlines()[-1])
        self.assert_pose(self.first.true_pose(), (-3.5, 0.25, -1.5), 1e-6)

    def test_what_cannot_be_is_refused_and_nothing_moves(self):
        for arguments, words in (
            (dict(model='atlo'), ("'atlo' does not exist", "did you mean 'alto'")),
            (dict(model=''), ("'' does not exist",)),
            (dict(model='hallway_walls'), ("'hallway_walls' is fixed", "'alto'")),
            (dict(frame='base_link'), ("'base_link'", "'world'")),
            (dict(x=NAN), ('position', 'nan')),
            (dict(y=float('inf')), ('position', 'inf')),
            (dict(x=1e300), ('position', '1e+300')),
            (dict(orientation=(0.0, 0.0, 0.0, 0.0)), ('no rotation',)),
            (dict(orientation=(0.0, 0.0, NAN, 1.0)), ('no rotation',)),
            (dict(twist=(NAN, 0.0, 0.0)), ('twist', 'nan')),
        ):
            response = self.first.place(**arguments)
            self.assertFalse(response.success, arguments)
            for word in words:
                self.assertIn(word, response.status_message)
        self.assert_pose(self.first.true_pose(), START, 1e-6)

    # --- time ---------------------------------------------------------------------------------------------------------

    def test_pause_stops_time_and_unpause_goes_on_where_it_stopped(self):
        self.assertEqual(self.first.joints.messages, [])  # started paused
        for _ in range(2):
            self.first.unpause_physics()
            start_ns = self.first.now_ns()
            self.first.clock.wait_for(lambda messages: messages[-1].clock.to_nsec() > start_ns + 10 * TICK_NS, 'time')
            self.first.pause_physics()
            self.wait_until_time_stands(self.first)
            count = len(self.first.joints.messages)
            self.wait_until_time_stands(self.first)  # three more clock messages later
            self.assertEqual(len(self.first.joints.messages), count)
        stamps = [stamp_ns_of(message) for message in self.first.joints.messages]
        self.assertEqual(stamps, list(range(0, stamps[-1] + 1, TICK_NS)))  # no gap over the pause

    def factor(self, simulator, wall_s):
        """Simulated per wall time."""
        simulator.unpause_physics()
        simulator.clock.wait_for(lambda messages: messages and messages[-1].clock.to_nsec() > TICK_NS, 'a start')
        start, start_ns = time.monotonic(), simulator.now_ns()
        time.sleep(wall_s)
        elapsed_ns, elapsed = simulator.now_ns() - start_ns, time.monotonic() - start
        simulator.pause_physics()
        return elapsed_ns / NS_PER_S / elapsed

    def test_real_time_factor(self):
        quarter = self.factor(self.same, 1.0)
        self.assertGreater(quarter, 0.125)
        self.assertLess(quarter, 0.5)
        self.assertGreater(self.factor(self.other, 1.0), 1.0)  # as fast as it can

    # --- services -----------------------------------------------------------------------------------------------------

    def test_reset_simulation_starts_all_again(self):
        self.first.unpause_physics()
        first_message = self.first.joints.wait_for_count(1)[0]
        self.first.drive(0.5, duration=0.2)
        moved = self.first.pose()
        self.assertGreater(math.hypot(moved[0] + 10.0, moved[1] - 0.5), 0.05)
        self.first.clear()
        self.first.reset_simulation()
        self.first.joints.wait_for(lambda messages: messages and stamp_ns_of(messages[-1]) < NS_PER_S, 'an early stamp')
        again = next(message for message in self.first.joints.wait_for_stamp(0) if stamp_ns_of(message) == 0)
        self.assertEqual(again.position, first_message.position)
        self.first.models.clear()
        self.assert_pose(self.first.pose(), START, 1e-3)  # and the last command is forgotten

    def test_reset_world_carries_the_robot_back_and_time_goes_on(self):
        self.first.unpause_physics()
        self.first.drive(0.5, duration=0.2)
        before_ns, turned = self.first.now_ns(), self.first.joints.messages[-1].position
        self.first.reset_world()
        self.first.models.clear()
        self.first.models.wait_for_count(2)  # the first may have been on its way
        self.assert_pose(self.first.pose(), START, 0.05)
        stamps = clock_stamps(self.first)
        self.assertEqual(stamps, sorted(stamps))
        self.assertGreater(self.first.now_ns(), before_ns)
        now_turned = self.first.joints.messages[-1].position
        self.assertTrue(all(now >= then - 0.05 for now, then in zip(now_turned, turned)), (turned, now_turned))

    # --- cmd_vel ------------------------------------------------------------------------------------------------------

    def speeds(self):
        return [(stamp_ns_of(message) / NS_PER_S, message.velocity) for message in self.first.joints.messages]

    def test_command_is_obeyed_within_the_acceleration(self):
        self.first.unpause_physics()
        self.first.drive(0.45, duration=0.3)
        first_x, first_y, first_yaw = self.first.pose()
        self.first.drive(0.3, 0.8, duration=0.3)
        self.assertGreater(angle_between(self.first.pose()[2], first_yaw), 0.1)
        # Straight ahead from the start, as far as wheels turned.
        self.assertLess(abs((first_x + 10.0) * math.sin(0.3) - (first_y - 0.5) * math.cos(0.3)), 0.01)
        self.assertGreater((first_x + 10.0) * math.cos(0.3), 0.1)
        speeds = self.speeds()
        linear = [0.5 * WHEEL_RADIUS * sum(velocity) for _, velocity in speeds]
        steps = [abs(newer - older) for older, newer in zip(linear, linear[1:])]
        # The controller ramps; the physics behind it follows within a fifth.
        self.assertLess(max(steps), 1.2 * ACCELERATION * 0.01)
        self.assertGreater(max(steps), 0.5 * ACCELERATION * 0.01)
        self.assertEqual(self.rosout.warnings_of(self.first.node), [])

    def test_command_that_is_not_finite_keeps_the_last_one(self):
        self.first.unpause_physics()
        self.first.drive(0.3)
        self.first.joints.clear()
        bad = [(NAN, 0.0), (0.0, float('inf')), (NAN, NAN)]

        def disturb():
            self.first.command(*bad[0])
            bad.append(bad.pop(0))

        self.first.drive(0.3, duration=0.6, disturbance=disturb)
        for _, velocity in self.speeds():
            for speed in velocity:
                self.assertAlmostEqual(speed, 0.3 / WHEEL_RADIUS, delta=0.1)
        warned = self.rosout.wait_for_warning(self.first.node, self.first.command_topic, 'finite')
        self.assertEqual(len(warned), 1, warned)

    def test_commands_beyond_the_limits_are_cut_with_a_warning_that_does_not_flood(self):
        self.first.unpause_physics()
        self.first.drive(0.9)
        for step in range(30):  # each a bit different, as a joystick's are
            self.first.command(3.0 + 0.01 * step)
            time.sleep(0.02)
        self.first.drive(TOP_SPEED, duration=0.2)
        top = max(max(velocity) for _, velocity in self.speeds())
        self.assertLess(top, 1.05 * TOP_SPEED / WHEEL_RADIUS)
        warned = self.rosout.wait_for_warning(self.first.node, 'limit')
        self.assertLessEqual(len(warned), 2, warned)

    def test_robot_stops_when_commands_stay_away(self):
        self.first.unpause_physics()
        self.first.drive(0.45, duration=0.2)
        self.first.joints.clear()
        silent_since = self.first.now_ns() / NS_PER_S
        self.first.joints.wait_for(
            lambda messages: messages and all(abs(speed) < 0.01 for speed in messages[-1].velocity), 'a standstill'
        )
        slower = next(stamp for stamp, velocity in self.speeds() if max(velocity) < 0.9 * 0.45 / WHEEL_RADIUS)
        # The last command may have taken effect a moment before or after the clock was read.
        self.assertGreater(slower - silent_since, 0.5 * COMMAND_TIMEOUT)
        self.assertLess(slower - silent_since, 2.0 * COMMAND_TIMEOUT)


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'simulator', SimulatorTest)
