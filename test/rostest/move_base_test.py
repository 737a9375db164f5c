#!/usr/bin/env python3
"""The contract of move_base_node. Started by move_base.test; the robot is in move_base_robot.py.

Simulated time is the test's: it goes on when the node has answered, so that nothing depends on the machine's speed.
"""

import math
import os
import signal
import socket
import xmlrpc.client

import rosgraph
import rosgraph.network
import rospy
import rostest
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from geometry_msgs.msg import PolygonStamped, PoseStamped
from move_base_msgs.msg import MoveBaseActionFeedback, MoveBaseActionGoal
from move_base_robot import NAN, NODE, ODOM_IN_MAP, Robot, room_map, twist_of, unchanged, with_ranges
from nav_msgs.msg import Path
from nav_msgs.srv import GetMap, GetMapResponse, GetPlan, GetPlanRequest
from ros_testing import (
    TIMEOUT_S,
    Collector,
    NodeTest,
    RosoutWatch,
    angle_between,
    connected_publisher,
    stamp_from_ns,
    start_test_node,
    wait_for_listeners,
    wait_until,
)
from std_srvs.srv import Empty

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.ros.conversions import pose_from_message, pose_stamped_message

START = Pose2D(-2.0, -1.0, 0.0)
NEAR = Pose2D(-1.3, -0.9, 0.3)  # two seconds from the start
FAR = Pose2D(-1.0, 1.2, 1.5)
STOP = (0.0, 0.0)
STOPPED_AFTER_S = 0.5  # input_timeout


def subscriber_that_never_reads(topic, message_type):
    """The socket of one: an RViz that is stopped in a debugger, or behind a bad radio link."""
    node = xmlrpc.client.ServerProxy(rosgraph.Master(rospy.get_name()).lookupNode(NODE))
    _, host, port = node.requestTopic('/hung', topic, [['TCPROS']])[2]
    hung = socket.socket()
    hung.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    hung.connect((host, port))
    rosgraph.network.write_ros_handshake_header(
        hung, {'topic': topic, 'type': message_type, 'md5sum': '*', 'callerid': '/hung'}
    )
    return hung


class MoveBaseTest(NodeTest):
    @classmethod
    def setUpClass(cls):
        start_test_node('move_base_test')
        cls.robot = Robot(1000 * 10**9)
        cls.feedback = Collector(NODE + '/feedback', MoveBaseActionFeedback)
        cls.status = Collector(NODE + '/status', GoalStatusArray)
        cls.current_goals = Collector(NODE + '/current_goal', PoseStamped)
        cls.goals = connected_publisher(NODE + '/goal', MoveBaseActionGoal)
        cls.simple_goals = connected_publisher('/move_base_simple/goal', PoseStamped)
        cls.cancels = connected_publisher(NODE + '/cancel', GoalID)
        for publisher in (cls.goals, cls.simple_goals, cls.cancels):
            wait_for_listeners(publisher, [NODE])
        for service in ('make_plan', 'clear_costmaps'):
            rospy.wait_for_service(f'{NODE}/{service}', TIMEOUT_S)
        cls.make_plan = rospy.ServiceProxy(NODE + '/make_plan', GetPlan)
        cls.clear_costmaps = rospy.ServiceProxy(NODE + '/clear_costmaps', Empty)
        cls.rosout = RosoutWatch()
        cls.count = 0
        cls.plan_without_map = cls.plan_error(FAR)
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
        robot.muted, robot.is_frozen, robot.odometry_per_period = set(), False, 1
        robot.change_scan = robot.change_odometry = unchanged
        if robot.pending():
            self.cancels.publish(GoalID())
            robot.live_until(lambda: not robot.pending(), lambda: f'the end of {robot.pending()}')

    # ---- helpers

    @classmethod
    def new_goal(cls, target):
        cls.count += 1
        goal = MoveBaseActionGoal(goal_id=GoalID(stamp_from_ns(cls.robot.now_ns), f'goal {cls.count}'))
        goal.goal.target_pose = target
        cls.robot.sent.add(goal.goal_id.id)
        cls.goals.publish(goal)
        return goal.goal_id.id

    def send(self, pose, frame='map'):
        return self.new_goal(pose_stamped_message(pose, self.robot.now_ns, frame))

    def result(self, goal_id):
        return next((result for result in self.robot.results.messages if result.status.goal_id.id == goal_id), None)

    def assert_ends(self, goal_id, status, *words):
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
        pose = self.robot.pose
        self.assertLess(math.hypot(pose.x_m - goal.x_m, pose.y_m - goal.y_m), 0.12)
        self.assertLess(angle_between(pose.yaw_rad, goal.yaw_rad), 0.12)

    @classmethod
    def plan_error(cls, goal, goal_frame='map', **request):
        """What make_plan refuses with, or 'no plan' for one without poses; empty where it gives a plan."""
        try:
            return '' if cls.plan(goal, goal_frame, **request) else 'no plan'
        except rospy.ServiceException as error:
            return str(error).replace("\\'", "'")

    @classmethod
    def plan(cls, goal, goal_frame='map', **request):
        target = goal if isinstance(goal, PoseStamped) else pose_stamped_message(goal, cls.robot.now_ns, goal_frame)
        return cls.make_plan(GetPlanRequest(goal=target, **request)).plan.poses

    def assert_stops_and_resumes(self, break_it, mend_it, *words, dropped=()):
        """The robot stops for want of an input, says which, stays where it is, and goes on by itself."""
        self.rosout.clear()
        goal_id = self.drive()
        break_it()
        broken_ns = self.robot.now_ns
        self.robot.live_until(lambda: self.robot.twist == STOP, 'a stop', TIMEOUT_S)
        stopped_ns, stopped_at, count = self.robot.now_ns, self.robot.pose, len(self.robot.commands.messages)
        self.robot.live_until(lambda: len(self.robot.commands.messages) > count + 2, 'more stops')
        self.assertEqual(self.robot.pose, stopped_at)
        self.assertIsNone(self.result(goal_id))
        self.robot.live_until(lambda: self.text_of(goal_id).startswith('stopped: '), 'a status that says so')
        for word in words:
            self.assertIn(word, self.text_of(goal_id))
        self.rosout.wait_for_warning(NODE, 'stopped', *words)
        if dropped:  # what comes with each message is logged every five seconds
            self.robot.live_until(
                lambda: any(all(word in text for word in dropped) for text in self.rosout.warnings_of(NODE)),
                'a warning of the drops',
            )
        mend_it()
        self.wait_for_motion()
        self.assertIsNone(self.result(goal_id))
        return (stopped_ns - broken_ns) / 1e9

    # ---- goals

    def test_a_goal_is_reached(self):
        views = [
            Collector(f'{NODE}/{topic}', message)
            for topic, message in (
                ('NavfnROS/plan', Path),
                ('DWAPlannerROS/global_plan', Path),
                ('DWAPlannerROS/local_plan', Path),
                ('global_costmap/footprint', PolygonStamped),
                ('local_costmap/footprint', PolygonStamped),
            )
        ]
        result = self.assert_ends(self.send(NEAR), GoalStatus.SUCCEEDED, 'goal reached')
        self.assert_at(NEAR)
        shown = self.current_goals.wait_for_count(1)[0]
        self.assertEqual(shown.header.frame_id, 'map')
        self.assertAlmostEqual(shown.pose.position.x, NEAR.x_m)
        feedback = self.feedback.wait_for_count(10)[-1]
        self.assertEqual(feedback.status.goal_id, result.status.goal_id)
        pose = pose_from_message(feedback.feedback.base_position.pose)
        self.assertLess(math.hypot(pose.x_m - NEAR.x_m, pose.y_m - NEAR.y_m), 0.2)
        for collector, frame in zip(views, ('map', 'odom', 'odom', 'map', 'odom')):
            messages = collector.wait_for(
                lambda messages: any(
                    message.poses if isinstance(message, Path) else message.polygon.points for message in messages
                ),
                'a line',
            )
            self.assertEqual({message.header.frame_id for message in messages}, {frame})

    def test_a_cancelled_goal_stops_within_a_period(self):
        goal_id = self.drive()
        self.cancels.publish(GoalID(id=goal_id))
        wait_until(
            lambda: any(
                status.status == GoalStatus.PREEMPTING
                for message in self.status.messages
                for status in message.status_list
            ),
            'the request to arrive',
        )
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
        self.assert_ends(second, GoalStatus.SUCCEEDED)
        self.assert_at(NEAR)

    def test_a_simple_goal_in_another_frame(self):
        self.simple_goals.publish(pose_stamped_message(NEAR.relative_to(ODOM_IN_MAP), 0, 'odom'))
        self.robot.live_until(self.goals_known, 'the goal')
        goal_id = self.goals_known()[0]
        self.robot.sent.add(goal_id)
        self.assert_ends(goal_id, GoalStatus.SUCCEEDED)
        self.assert_at(NEAR)
        shown = self.current_goals.wait_for_count(1)[0]
        self.assertEqual(shown.header.frame_id, 'map')
        self.assertAlmostEqual(shown.pose.position.x, NEAR.x_m)

    def goals_known(self):
        return [
            status.goal_id.id
            for message in self.status.messages
            for status in message.status_list
            if not status.goal_id.id.startswith('goal ')
        ]

    def test_goals_that_are_no_poses_are_refused(self):
        for target, words in (
            (pose_stamped_message(Pose2D(NAN, 0.0, 0.0), 0, 'map'), ('position', 'nan')),
            (pose_stamped_message(Pose2D(0.0, 0.0, NAN), 0, 'map'), ('no rotation',)),
            (PoseStamped(), ('no rotation',)),
            (self.leaning(), ('upright',)),
            (pose_stamped_message(NEAR, 0, 'moon'), ("'moon'", "'map'")),
        ):
            self.assert_ends(self.new_goal(target), GoalStatus.ABORTED, *words)
            self.assertEqual(len(self.rosout.wait_for_warning(NODE, 'refused')), 1)
            self.rosout.clear()

    @staticmethod
    def leaning():
        target = pose_stamped_message(NEAR, 0, 'map')
        target.pose.orientation.x = 0.5
        return target

    def test_a_refused_goal_ends_the_one_before(self):
        """As upstream: there is one goal at a time."""
        first = self.drive()
        second = self.send(NEAR, 'moon')
        self.assert_ends(second, GoalStatus.ABORTED)
        self.assert_ends(first, GoalStatus.PREEMPTED)

    def test_goals_that_cannot_be_reached_are_given_up(self):
        for goal, words in (
            (Pose2D(9.0, 0.0, 0.0), 'outside the map'),
            (Pose2D(0.5, 0.0, 0.0), 'in a wall'),
            (Pose2D(2.4, 1.4, 0.0), 'after 2 recovery behaviours: there is no path'),
        ):
            sent_ns = self.robot.now_ns
            self.assert_ends(self.send(goal), GoalStatus.ABORTED, words)
            self.assertLess(self.robot.now_ns - sent_ns, 5 * 10**9)
        self.drive()

    # ---- inputs

    def test_odometry_falls_silent(self):
        self.assert_stops_and_resumes(
            lambda: self.robot.muted.add('/odom'),
            self.robot.muted.clear,
            '/odom',
            'has not been received',
            'input_timeout 0.5 s',
        )

    def test_a_goal_can_be_cancelled_while_odometry_is_silent(self):
        goal_id = self.drive()
        self.robot.muted.add('/odom')
        self.robot.live_until(lambda: self.robot.twist == STOP, 'a stop')
        self.cancels.publish(GoalID())
        self.assert_ends(goal_id, GoalStatus.PREEMPTED)

    def test_the_scan_falls_silent(self):
        delay_s = self.assert_stops_and_resumes(
            lambda: self.robot.muted.add('/scan'), self.robot.muted.clear, 'scan', 'old', 'input_timeout 0.5 s'
        )
        self.assertLessEqual(delay_s, STOPPED_AFTER_S + 0.2)

    def test_localization_stops(self):
        delay_s = self.assert_stops_and_resumes(
            lambda: self.robot.muted.add('/tf'), self.robot.muted.clear, 'map->odom', 'old'
        )
        self.assertLessEqual(delay_s, STOPPED_AFTER_S + 0.2)

    def test_a_laser_without_a_valid_range(self):
        def blind():
            self.robot.change_scan = with_ranges(NAN)

        self.assert_stops_and_resumes(
            blind, self.see_again, 'scan', 'old', dropped=('/scan', 'none of 180 ranges is valid')
        )

    def see_again(self):
        self.robot.change_scan = unchanged

    def test_odometry_that_is_not_a_number(self):
        def change(odometry):
            odometry.pose.pose.position.x = NAN
            return odometry

        def break_it():
            self.robot.change_odometry = change

        def mend_it():
            self.robot.change_odometry = unchanged

        self.assert_stops_and_resumes(
            break_it, mend_it, '/odom', 'has not been received', dropped=('/odom', 'position (nan')
        )

    def test_a_display_that_hangs_does_not_stop_the_robot(self):
        hung = subscriber_that_never_reads(NODE + '/global_costmap/costmap', 'nav_msgs/OccupancyGrid')
        for _ in range(5):  # about 4 MB of costmaps: more than fits into its socket
            self.robot.place(START)
            self.assert_ends(self.send(NEAR), GoalStatus.SUCCEEDED)
        hung.close()

    def test_odometry_that_comes_late(self):
        def change(odometry):
            odometry.header.stamp -= rospy.Duration(0.7)
            return odometry

        def break_it():
            self.robot.change_odometry = change

        def mend_it():
            self.robot.change_odometry = unchanged

        self.assert_stops_and_resumes(break_it, mend_it, '/odom', 's late')

    def test_frozen_odometry_ends_the_goal_and_the_next_one_works(self):
        goal_id = self.drive()
        self.robot.is_frozen = True
        frozen_at = self.robot.pose
        self.assert_ends(goal_id, GoalStatus.ABORTED, 'odometry has not moved for 0.30 m of commanded travel')
        travel = math.hypot(self.robot.pose.x_m - frozen_at.x_m, self.robot.pose.y_m - frozen_at.y_m)
        self.assertLess(travel, 0.35)
        self.robot.is_frozen = False
        self.assert_ends(self.send(NEAR), GoalStatus.SUCCEEDED)

    def test_time_that_goes_back_restarts(self):
        goal_id = self.drive()
        self.robot.now_ns -= 60 * 10**9
        self.assert_ends(goal_id, GoalStatus.PREEMPTED, 'time went back')
        self.rosout.wait_for_warning(NODE, 'time went back')
        self.robot.now_ns += 60 * 10**9  # the action server takes no goal that is older than the last
        self.robot.live(20)
        self.drive()

    # ---- services

    def test_make_plan(self):
        plan = self.plan(Pose2D(2.0, -1.0, 0.0))
        self.assertEqual({pose.header.frame_id for pose in plan}, {'map'})
        points = [(pose.pose.position.x, pose.pose.position.y) for pose in plan]
        self.assertLess(math.hypot(points[0][0] - START.x_m, points[0][1] - START.y_m), 0.01)
        self.assertAlmostEqual(points[-1][0], 2.0)
        self.assertGreater(max(y for _, y in points), 0.4)  # around the wall
        start, goal = Pose2D(-1.0, 1.0, 0.0), Pose2D(1.5, -1.0, 0.0)
        plan = self.plan(
            goal.relative_to(ODOM_IN_MAP),
            'odom',
            start=pose_stamped_message(start.relative_to(ODOM_IN_MAP), 0, '/odom'),
        )
        ends = [pose_from_message(pose.pose) for pose in (plan[0], plan[-1])]
        self.assertAlmostEqual(math.hypot(ends[0].x_m - start.x_m, ends[0].y_m - start.y_m), 0.0)
        self.assertAlmostEqual(math.hypot(ends[1].x_m - goal.x_m, ends[1].y_m - goal.y_m), 0.0)

    def test_clear_costmaps_forgets_obstacles(self):
        self.robot.change_scan = with_ranges(0.8)
        self.robot.live_until(lambda: self.plan_error(FAR) == 'no plan', 'an obstacle all around')
        self.robot.muted.add('/scan')
        self.robot.live(4)
        self.assertEqual(self.plan_error(FAR), 'no plan')
        self.clear_costmaps()
        self.assertEqual(self.plan_error(FAR), '')

    # ---- the end

    def test_zz_it_stops_the_robot_when_it_is_shut_down(self):
        """The last test: there is no node after it."""
        goal_id = self.drive()
        node = xmlrpc.client.ServerProxy(rosgraph.Master(rospy.get_name()).lookupNode(NODE))
        os.kill(node.getPid(rospy.get_name())[2], signal.SIGINT)
        self.robot.commands.wait_for(lambda messages: twist_of(messages[-1]) == STOP, 'a stop')
        wait_until(lambda: self.result(goal_id), 'a result')
        self.assertEqual(self.result(goal_id).status.status, GoalStatus.ABORTED)
        self.robot.sent.clear()


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'move_base_contract', MoveBaseTest)
