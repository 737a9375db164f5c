#!/usr/bin/env python3
"""The contract of move_base_node. Started by navigation.test; the robot is in move_base_robot.py.

Simulated time is the test's: it goes on when the node has answered, so that nothing depends on the machine's speed.
"""

import math
import os
import signal
import socket
import subprocess
import xmlrpc.client

import numpy as np
import ros_testing as ros
import rosgraph
import rosgraph.network
import rospy
import rostest
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from dynamic_reconfigure.client import Client
from geometry_msgs.msg import PolygonStamped, PoseStamped
from move_base_msgs.msg import MoveBaseActionFeedback, MoveBaseActionGoal, RecoveryStatus
from move_base_robot import NODE, ODOM_IN_MAP, Robot, room_map, twist_of, unchanged, with_ranges
from nav_msgs.msg import OccupancyGrid, Path
from nav_msgs.srv import GetMap, GetMapResponse, GetPlan, GetPlanRequest
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Empty

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.ros.messages import pose_from_message, pose_stamped_message

START = Pose2D(-2.0, -1.0, 0.0)
NEAR = Pose2D(-1.3, -0.9, 0.3)  # two seconds from the start
FAR = Pose2D(-1.0, 1.2, 1.5)
AHEAD = Pose2D(-0.2, -1.0, 0.0)  # in docs/live_trials.md
CLOSED_CELL = Pose2D(2.4, 1.4, 0.0)
STOP = (0.0, 0.0)
FILLED = {Path: 'poses', PolygonStamped: 'points', PointCloud2: 'data'}


def subscriber_that_never_reads(topic, message_type):
    """The socket of one: an RViz that is stopped in a debugger, or behind a bad radio link."""
    node = xmlrpc.client.ServerProxy(rosgraph.Master(rospy.get_name()).lookupNode(NODE))
    _, host, port = node.requestTopic('/hung', topic, [['TCPROS']])[2]
    hung = socket.socket()
    hung.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    hung.connect((host, port))
    header = {'topic': topic, 'type': message_type, 'md5sum': '*', 'callerid': '/hung'}
    rosgraph.network.write_ros_handshake_header(hung, header)
    return hung


def cells(message):
    """(height, width) of a map or of a change of one."""
    info = message.info if isinstance(message, OccupancyGrid) else message
    return np.array(message.data, np.int8).reshape(info.height, info.width)


def distance(first, second):
    return math.hypot(first.x_m - second.x_m, first.y_m - second.y_m)


class MoveBaseTest(ros.NodeTest):
    @classmethod
    def setUpClass(cls):
        ros.start_test_node('move_base_test')
        cls.robot = Robot(1000 * 10**9)
        cls.feedback = ros.Collector(NODE + '/feedback', MoveBaseActionFeedback)
        cls.status = ros.Collector(NODE + '/status', GoalStatusArray)
        cls.current_goals = ros.Collector(NODE + '/current_goal', PoseStamped)
        cls.goals = ros.connected_publisher(NODE + '/goal', MoveBaseActionGoal, [NODE])
        cls.simple_goals = ros.connected_publisher('/move_base_simple/goal', PoseStamped, [NODE])
        cls.cancels = ros.connected_publisher(NODE + '/cancel', GoalID, [NODE])
        for service in ('NavfnROS/make_plan', 'clear_costmaps'):
            rospy.wait_for_service(f'{NODE}/{service}', ros.TIMEOUT_S)
        cls.make_plan = rospy.ServiceProxy(NODE + '/make_plan', GetPlan)
        cls.rosout, cls.count = ros.RosoutWatch(), 0
        cls.map_server = rospy.Service('static_map', GetMap, lambda _: GetMapResponse(room_map()))
        cls.robot.live_until(lambda: not cls.plan_error(FAR), 'a plan')

    def setUp(self):
        super().setUp()
        self.robot.place(START)
        self.robot.live(10)
        for collector in (self.robot.commands, self.feedback, self.status, self.current_goals):
            collector.clear()

    def tearDown(self):
        robot = self.robot
        robot.muted = set()
        robot.change_scan = robot.change_odometry = unchanged
        if robot.pending():
            self.cancels.publish(GoalID())
            robot.live_until(lambda: not robot.pending(), lambda: f'the end of {robot.pending()}')

    # ---- helpers

    def send(self, pose, frame='map'):
        """Send a goal, a pose or a message; its id."""
        type(self).count += 1
        goal = MoveBaseActionGoal(goal_id=GoalID(ros.stamp_from_ns(self.robot.now_ns), f'goal {self.count}'))
        is_message = isinstance(pose, PoseStamped)
        goal.goal.target_pose = pose if is_message else pose_stamped_message(pose, self.robot.now_ns, frame)
        self.robot.sent.add(goal.goal_id.id)
        self.goals.publish(goal)
        return goal.goal_id.id

    def result(self, goal_id):
        return next((result for result in self.robot.results.messages if result.status.goal_id.id == goal_id), None)

    def assert_ends(self, goal_id, status=GoalStatus.SUCCEEDED, *words):
        result = self.robot.live_until(
            lambda: self.result(goal_id), lambda: f'the result of {goal_id}; status: {self.text_of(goal_id)}'
        )
        self.assertEqual(result.status.status, status, result.status.text)
        for word in words:
            self.assertIn(word, result.status.text)
        self.robot.live()
        self.assertEqual(self.robot.twist, STOP)
        return result

    def text_of(self, goal_id):
        statuses = [status for message in self.status.messages[-1:] for status in message.status_list]
        return next((status.text for status in statuses if status.goal_id.id == goal_id), '')

    def drive(self, pose=FAR):
        """Send a goal and return its id when the robot is on its way."""
        goal_id = self.send(pose)
        self.wait_for_motion()
        return goal_id

    def wait_for_motion(self):
        self.robot.live_until(lambda: self.robot.twist[0] > 0.2, 'motion')

    def assert_at(self, goal):
        self.assertLess(distance(self.robot.pose, goal), 0.12)
        self.assertLess(ros.angle_between(self.robot.pose.yaw_rad, goal.yaw_rad), 0.12)

    @classmethod
    def plan_error(cls, goal):
        """What make_plan refuses with, or 'no plan' for one without poses; empty where it gives a plan."""
        try:
            return '' if cls.plan(goal) else 'no plan'
        except rospy.ServiceException as error:
            return str(error)

    @classmethod
    def plan(cls, goal, frame='map', **request):
        target = pose_stamped_message(goal, cls.robot.now_ns, frame)
        return cls.make_plan(GetPlanRequest(goal=target, **request)).plan.poses

    def whole_costmap(self):
        """What a newcomer gets."""
        grids = ros.Collector(NODE + '/global_costmap/costmap', OccupancyGrid)
        self.robot.live_until(lambda: grids.messages, 'the costmap')
        grids.stop()
        return grids.messages[0]

    # ---- goals

    def test_a_goal_is_reached_and_shown(self):
        kinds = {'NavfnROS/plan': Path, 'DWAPlannerROS/global_plan': Path, 'DWAPlannerROS/local_plan': Path}
        kinds.update(dict.fromkeys(('global_costmap/footprint', 'local_costmap/footprint'), PolygonStamped))
        kinds.update(dict.fromkeys(('DWAPlannerROS/trajectory_cloud', 'DWAPlannerROS/cost_cloud'), PointCloud2))
        views = [ros.Collector(f'{NODE}/{topic}', message) for topic, message in kinds.items()]
        result = self.assert_ends(self.send(NEAR), GoalStatus.SUCCEEDED, 'goal reached')
        self.assert_at(NEAR)
        shown = self.current_goals.wait_for_count(1)[0]
        self.assertEqual(shown.header.frame_id, 'map')
        self.assertAlmostEqual(shown.pose.position.x, NEAR.x_m)
        feedback = self.feedback.wait_for_count(10)[-1]
        self.assertEqual(feedback.status.goal_id, result.status.goal_id)
        self.assertLess(distance(pose_from_message(feedback.feedback.base_position.pose), NEAR), 0.2)
        for collector, frame in zip(views, ('map', 'odom', 'odom', 'map', 'odom', 'odom', 'odom')):

            def is_shown(messages):
                return any(len(getattr(getattr(each, 'polygon', each), FILLED[type(each)])) > 2 for each in messages)

            messages = collector.wait_for(is_shown, 'a line or a cloud')
            self.assertEqual({message.header.frame_id for message in messages}, {frame})

    def test_a_cancelled_goal_stops_within_a_period(self):
        goal_id = self.drive()
        self.cancels.publish(GoalID(id=goal_id))

        def is_preempting():
            statuses = [status.status for message in self.status.messages for status in message.status_list]
            return GoalStatus.PREEMPTING in statuses

        ros.wait_until(is_preempting, 'the request to arrive')
        self.robot.live(2)  # the server says so a moment before it knows
        self.assertEqual(self.robot.twist, STOP)
        self.assert_ends(goal_id, GoalStatus.PREEMPTED, 'cancelled')

    def test_a_new_goal_replaces_the_old_one_without_a_stop(self):
        first = self.drive()
        self.robot.commands.clear()
        second = self.send(NEAR)
        self.robot.live_until(lambda: self.result(first), 'the end of the first')
        self.assertEqual(self.result(first).status.status, GoalStatus.PREEMPTED)
        self.assertGreater(min(message.linear.x for message in self.robot.commands.messages), 0.1)
        self.assert_ends(second)
        self.assert_at(NEAR)

    def test_a_simple_goal_in_another_frame(self):
        self.simple_goals.publish(pose_stamped_message(NEAR.relative_to(ODOM_IN_MAP), 0, 'odom'))

        def ids():
            statuses = [status.goal_id.id for message in self.status.messages for status in message.status_list]
            return [goal_id for goal_id in statuses if not goal_id.startswith('goal ')]

        goal_id = self.robot.live_until(ids, 'the goal')[0]
        self.robot.sent.add(goal_id)
        self.assert_ends(goal_id)
        self.assert_at(NEAR)
        shown = self.current_goals.wait_for_count(1)[0]
        self.assertEqual(shown.header.frame_id, 'map')
        self.assertAlmostEqual(shown.pose.position.x, NEAR.x_m)

    def test_goals_that_are_no_poses_are_refused_and_end_the_one_before(self):
        """As upstream: there is one goal at a time."""
        first, leaning = self.drive(), pose_stamped_message(NEAR, 0, 'map')
        leaning.pose.orientation.x = 0.5
        for target, words in (
            (pose_stamped_message(NEAR, 0, 'moon'), ("'moon'", "'map'")),
            (pose_stamped_message(Pose2D(ros.NAN, 0.0, 0.0), 0, 'map'), ('position', 'nan')),
            (pose_stamped_message(Pose2D(0.0, 0.0, ros.NAN), 0, 'map'), ('no rotation',)),
            (PoseStamped(), ('no rotation',)),
            (leaning, ('upright',)),
        ):
            self.assert_ends(self.send(target), GoalStatus.ABORTED, *words)
            self.assert_warned_once(NODE, 'refused')
            self.rosout.clear()
        self.assert_ends(first, GoalStatus.PREEMPTED)

    def test_goals_that_cannot_be_reached_are_given_up_after_recoveries_that_are_published(self):
        recoveries = ros.Collector(NODE + '/recovery_status', RecoveryStatus)
        for goal, words in (
            (Pose2D(9.0, 0.0, 0.0), 'outside the map'),
            (Pose2D(0.5, 0.0, 0.0), 'in a wall'),
            (CLOSED_CELL, 'after 2 recovery behaviours: there is no path'),
        ):
            sent_ns = self.robot.now_ns
            self.assert_ends(self.send(goal), GoalStatus.ABORTED, words)
            self.assertLess(self.robot.now_ns - sent_ns, 5 * 10**9)
        told = recoveries.wait_for_count(2)[-2:]
        self.assertEqual(
            [(one.current_recovery_number, one.total_number_of_recoveries, one.recovery_behavior_name) for one in told],
            [(0, 2, 'conservative_reset'), (1, 2, 'aggressive_reset')],
        )
        self.assertEqual(told[0].pose_stamped.header.frame_id, 'map')
        self.assertLess(distance(pose_from_message(told[0].pose_stamped.pose), START), 0.01)
        self.drive()

    # ---- inputs

    def assert_stops_and_resumes(self, break_it, *words, dropped=()):
        """The robot stops for want of an input, says which, stays where it is, and goes on by itself."""
        goal_id = self.drive()
        break_it()
        broken_ns = self.robot.now_ns
        self.robot.live_until(lambda: self.robot.twist == STOP, 'a stop', ros.TIMEOUT_S)
        stopped_ns, stopped_at, count = self.robot.now_ns, self.robot.pose, len(self.robot.commands.messages)
        self.robot.live_until(lambda: len(self.robot.commands.messages) > count + 2, 'more stops')
        self.assertEqual(self.robot.pose, stopped_at)
        self.robot.live_until(lambda: self.text_of(goal_id).startswith('stopped: '), 'a status that says so')
        for word in words:
            self.assertIn(word, self.text_of(goal_id))
        self.rosout.wait_for_warning(NODE, 'stopped', *words)
        if dropped:  # what comes with each message is logged every five seconds
            self.robot.live_until(
                lambda: any(all(word in text for word in dropped) for text in self.rosout.warnings_of(NODE)),
                'a warning of the drops',
            )
        self.robot.muted.clear()
        self.robot.change_scan = self.robot.change_odometry = unchanged
        self.wait_for_motion()
        self.assertIsNone(self.result(goal_id))
        return (stopped_ns - broken_ns) / 1e9

    def test_it_stops_for_want_of_odometry_scan_or_localization(self):
        robot = self.robot

        def lose(topic):
            return lambda: robot.muted.add(topic)

        def not_a_number(odometry):
            odometry.pose.pose.position.x = ros.NAN
            return odometry

        def late(odometry):
            odometry.header.stamp -= rospy.Duration(0.7)
            return odometry

        def change_to(change):
            return lambda: setattr(robot, 'change_odometry', change)

        for break_it, words, dropped in (
            (lose('/odom'), ('/odom', 'has not been received', 'input_timeout 0.5 s'), ()),
            (lose('/scan'), ('scan', 'old', 'input_timeout 0.5 s'), ()),
            (lose('/tf'), ('map->odom', 'old'), ()),
            (change_to(not_a_number), ('/odom', 'has not been received'), ('/odom', 'position (nan')),
            (change_to(late), ('/odom', 's late'), ()),
        ):
            delay_s = self.assert_stops_and_resumes(break_it, *words, dropped=dropped)
            if words[0] != '/odom':  # without it, the test's clock does not wait for the node
                self.assertLessEqual(delay_s, 0.7)
            self.tearDown()
            self.setUp()

    def test_a_goal_can_be_cancelled_while_odometry_is_silent(self):
        goal_id = self.drive()
        self.robot.muted.add('/odom')
        self.robot.live_until(lambda: self.robot.twist == STOP, 'a stop')
        self.cancels.publish(GoalID())
        self.assert_ends(goal_id, GoalStatus.PREEMPTED)

    def test_a_display_that_hangs_does_not_stop_the_robot(self):
        hung = subscriber_that_never_reads(NODE + '/global_costmap/costmap', 'nav_msgs/OccupancyGrid')
        for _ in range(5):  # about 4 MB of costmaps: more than fits into its socket
            self.robot.place(START)
            self.assert_ends(self.send(NEAR))
        hung.close()

    def test_time_that_goes_back_restarts(self):
        goal_id = self.drive()
        self.robot.now_ns -= 60 * 10**9
        self.assert_ends(goal_id, GoalStatus.PREEMPTED, 'time went back')
        self.rosout.wait_for_warning(NODE, 'time went back')
        self.robot.now_ns += 60 * 10**9  # the action server takes no goal that is older than the last
        self.robot.live(20)
        self.drive()

    # ---- services

    def test_plans_of_both_services(self):
        plan = self.plan(Pose2D(2.0, -1.0, 0.0))
        self.assertEqual({pose.header.frame_id for pose in plan}, {'map'})
        self.assertLess(distance(pose_from_message(plan[0].pose), START), 0.01)
        self.assertAlmostEqual(plan[-1].pose.position.x, 2.0)
        self.assertGreater(max(pose.pose.position.y for pose in plan), 0.4)  # around the wall
        start, goal = Pose2D(-1.0, 1.0, 0.0), Pose2D(1.5, -1.0, 0.0)
        of_odom = pose_stamped_message(start.relative_to(ODOM_IN_MAP), 0, '/odom')
        plan = self.plan(goal.relative_to(ODOM_IN_MAP), 'odom', start=of_odom)
        for pose, expected in ((plan[0], start), (plan[-1], goal)):
            self.assertAlmostEqual(distance(pose_from_message(pose.pose), expected), 0.0)
        self.drive()
        start, goal = (pose_stamped_message(pose, self.robot.now_ns, 'map') for pose in (START, NEAR))
        of_navfn = rospy.ServiceProxy(NODE + '/NavfnROS/make_plan', GetPlan)(GetPlanRequest(start, goal, 0.0)).plan
        ends = [pose_from_message(pose.pose)[:2] for pose in (of_navfn.poses[0], of_navfn.poses[-1])]
        self.assertEqual((of_navfn.header.frame_id, ends), ('map', [START[:2], NEAR[:2]]))

    def test_clear_costmaps_forgets_obstacles(self):
        self.robot.change_scan = with_ranges(0.8)
        self.robot.live_until(lambda: self.plan_error(FAR) == 'no plan', 'an obstacle all around')
        self.robot.muted.add('/scan')
        self.robot.live(4)
        self.assertEqual(self.plan_error(FAR), 'no plan')
        rospy.ServiceProxy(NODE + '/clear_costmaps', Empty)()
        self.assertEqual(self.plan_error(FAR), '')

    # ---- dynamic_reconfigure

    def client(self, part=''):
        client = Client(NODE + part, timeout=ros.TIMEOUT_S)
        self.addCleanup(client.close)
        return client

    def test_the_namespaces_of_upstream_offer_its_parameters_within_limits(self):
        for part, names in (
            ('', 'planner_frequency controller_frequency recovery_behavior_enabled oscillation_timeout'),
            ('/DWAPlannerROS', 'max_vel_x acc_lim_theta vx_samples use_dwa path_distance_bias restore_defaults'),
            ('/global_costmap', 'update_frequency publish_frequency footprint robot_radius footprint_padding'),
            ('/local_costmap', 'width height resolution'),
            ('/global_costmap/inflation_layer', 'enabled inflation_radius cost_scaling_factor'),
            ('/local_costmap/obstacle_layer', 'enabled combination_method footprint_clearing_enabled'),
        ):
            client = self.client(part)
            offered = {one['name']: one for one in client.get_parameter_descriptions(ros.TIMEOUT_S)}
            self.assertEqual(set(names.split()) - set(offered), set(), part)
            values = client.get_configuration(ros.TIMEOUT_S)
            for name, one in offered.items():
                self.assertTrue(one['type'] == 'str' or one['min'] <= values[name] <= one['max'], name)
        client = self.client('/DWAPlannerROS')
        self.assertEqual(client.update_configuration({'acc_lim_theta': 25.0})['acc_lim_theta'], 20.0)
        self.assertEqual(client.update_configuration({'acc_lim_theta': 4.9})['acc_lim_theta'], 4.9)
        for name, value, used, words in (
            ('min_vel_x', 0.6, 0.0, ('min_vel_x not above max_vel_x',)),
            ('sim_time', ros.NAN, 1.7, ('sim_time', 'nan')),
        ):
            self.assertEqual(client.update_configuration({name: value})[name], used)
            self.rosout.wait_for_warning(NODE, 'not changed', *words)
        planner = self.client().update_configuration({'base_local_planner': 'teb_local_planner/TebLocalPlannerROS'})
        self.assertEqual(planner['base_local_planner'], 'dwa_local_planner/DWAPlannerROS')

    def test_a_speed_that_is_changed_on_the_way_is_kept(self):
        client = self.client('/DWAPlannerROS')
        goal_id = self.send(AHEAD)
        self.robot.live_until(lambda: self.robot.twist[0] > 0.3, 'speed')
        # As in docs/live_trials.md.
        subprocess.check_call(
            ['rosrun', 'dynamic_reconfigure', 'dynparam', 'set', '/move_base/DWAPlannerROS', 'max_vel_x', '0.2']
        )
        self.assertEqual(client.get_configuration(ros.TIMEOUT_S)['max_vel_x'], 0.2)
        self.robot.live_until(lambda: self.robot.twist[0] < 0.21, 'less speed')
        self.robot.commands.clear()
        self.assert_ends(goal_id)
        self.assertLessEqual(max(message.linear.x for message in self.robot.commands.messages), 0.2001)
        kept = rospy.get_param(NODE + '/DWAPlannerROS')
        self.assertEqual((kept['max_vel_x'], kept['sim_time']), (0.2, 1.7))
        restored = client.update_configuration({'restore_defaults': True})
        self.assertEqual((restored['max_vel_x'], restored['restore_defaults']), (0.45, False))

    def test_layers_of_a_costmap_are_changed_and_obstacles_stay(self):
        inflation, obstacles = (self.client(f'/global_costmap/{name}_layer') for name in ('inflation', 'obstacle'))
        self.robot.change_scan = with_ranges(1.5)  # not as on the map
        self.robot.live(10)
        self.robot.muted.add('/scan')
        seen = cells(self.whole_costmap())
        inflation.update_configuration({'inflation_radius': 0.1})
        self.assertLess((cells(self.whole_costmap()) > 0).sum(), 0.5 * (seen > 0).sum())
        inflation.update_configuration({'enabled': False})
        bare = cells(self.whole_costmap())
        self.assertEqual(set(np.unique(bare)) - {-1}, {0, 100})
        self.assertTrue(((seen == 100) == (bare == 100)).all())
        obstacles.update_configuration({'enabled': False})
        self.assertLess((cells(self.whole_costmap()) == 100).sum(), (bare == 100).sum())
        inflation.update_configuration({'enabled': True, 'inflation_radius': 0.55})
        obstacles.update_configuration({'enabled': True})

    # ---- the end

    def test_zz_it_stops_the_robot_when_it_is_shut_down(self):
        """The last test: there is no node after it."""
        goal_id = self.drive()
        node = xmlrpc.client.ServerProxy(rosgraph.Master(rospy.get_name()).lookupNode(NODE))
        os.kill(node.getPid(rospy.get_name())[2], signal.SIGINT)
        self.robot.commands.wait_for(lambda messages: twist_of(messages[-1]) == STOP, 'a stop')
        ros.wait_until(lambda: self.result(goal_id), 'a result')
        self.assertEqual(self.result(goal_id).status.status, GoalStatus.ABORTED)
        self.robot.sent.clear()


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'move_base_contract', MoveBaseTest)
