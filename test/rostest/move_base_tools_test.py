#!/usr/bin/env python3
"""What move_base_node has for RViz and rqt. Started by move_base_tools.test; the robot is in move_base_robot.py."""

import math
import subprocess

import numpy as np
import rospy
import rostest
from actionlib_msgs.msg import GoalID, GoalStatus
from dynamic_reconfigure.client import Client
from map_msgs.msg import OccupancyGridUpdate
from move_base_msgs.msg import MoveBaseActionGoal, RecoveryStatus
from move_base_robot import NODE, Robot, room_map, unchanged, with_ranges
from nav_msgs.msg import OccupancyGrid
from nav_msgs.srv import GetMap, GetMapResponse, GetPlan, GetPlanRequest
from ros_testing import TIMEOUT_S, Collector, NodeTest, RosoutWatch, connected_publisher, stamp_from_ns, start_test_node
from sensor_msgs.msg import PointCloud2

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.ros.conversions import pose_stamped_message

START, GOAL, CLOSED_CELL = Pose2D(-2.0, -1.0, 0.0), Pose2D(-1.0, -0.8, 0.3), Pose2D(2.4, 1.4, 0.0)
# In docs/live_trials.md.
FAR = Pose2D(-0.2, -1.0, 0.0)


def cells(message):
    """(height, width) of a map or of a change of one."""
    info = message.info if isinstance(message, OccupancyGrid) else message
    return np.array(message.data, np.int8).reshape(info.height, info.width)


def table(cloud):
    """{field: values} of a cloud."""
    names = [field.name for field in cloud.fields]
    values = np.frombuffer(cloud.data, '<f4').reshape(cloud.width, len(names))
    return dict(zip(names, values.T))


class MoveBaseToolsTest(NodeTest):
    @classmethod
    def setUpClass(cls):
        start_test_node('move_base_tools_test')
        cls.robot = Robot(1000 * 10**9)
        cls.goals = connected_publisher(NODE + '/goal', MoveBaseActionGoal)
        cls.map_server = rospy.Service('static_map', GetMap, lambda _: GetMapResponse(room_map()))
        rospy.wait_for_service(f'{NODE}/NavfnROS/make_plan', TIMEOUT_S)
        cls.make_plan = rospy.ServiceProxy(NODE + '/NavfnROS/make_plan', GetPlan)
        cls.robot.live_until(cls.has_map, 'a plan')
        cls.rosout, cls.count = RosoutWatch(), 0

    @classmethod
    def has_map(cls):
        try:
            return cls.plan().poses
        except rospy.ServiceException:
            return None

    @classmethod
    def plan(cls):
        start, goal = (pose_stamped_message(pose, cls.robot.now_ns, 'map') for pose in (START, GOAL))
        return cls.make_plan(GetPlanRequest(start, goal, 0.0)).plan

    def setUp(self):
        super().setUp()
        self.robot.change_scan = unchanged
        self.robot.place(START)
        self.robot.live(10)

    def send(self, pose):
        type(self).count += 1
        goal = MoveBaseActionGoal(goal_id=GoalID(stamp_from_ns(self.robot.now_ns), f'goal {self.count}'))
        goal.goal.target_pose = pose_stamped_message(pose, self.robot.now_ns, 'map')
        self.robot.sent.add(goal.goal_id.id)
        self.goals.publish(goal)

    def end(self):
        self.robot.live_until(lambda: not self.robot.pending(), 'the end of the goal')
        return self.robot.results.messages[-1].status

    def test_a_plan_of_navfn_has_the_poses_that_were_asked_for(self):
        """Also while the robot drives."""
        self.send(GOAL)
        self.robot.live_until(lambda: self.robot.twist[0] > 0.1, 'motion')
        plan = self.plan()
        self.assertEqual(plan.header.frame_id, 'map')
        ends = [(pose.pose.position.x, pose.pose.position.y) for pose in (plan.poses[0], plan.poses[-1])]
        self.assertEqual(ends, [(START.x_m, START.y_m), (GOAL.x_m, GOAL.y_m)])
        self.assertEqual(self.end().status, GoalStatus.SUCCEEDED)

    def test_changes_of_a_costmap_add_up_to_it(self):
        """Whole at first, then only the cells that have changed: by both, a display has what a newcomer gets."""
        updates = Collector(NODE + '/global_costmap/costmap_updates', OccupancyGridUpdate)
        first = self.whole_costmap()
        self.assertEqual(first.header.frame_id, 'map')
        updates.clear()
        grids = Collector(NODE + '/global_costmap/costmap', OccupancyGrid)
        self.robot.live_until(lambda: grids.messages, 'the costmap')
        for change in (with_ranges(0.8), unchanged):
            self.robot.change_scan = change
            self.robot.live(10)
        shown, changes = cells(grids.messages[0]), updates.wait_for_count(2)
        for change in changes:
            if change.header.stamp > grids.messages[0].header.stamp:
                window = slice(change.y, change.y + change.height), slice(change.x, change.x + change.width)
                shown[window] = cells(change)
        self.assertEqual({change.header.frame_id for change in changes}, {'map'})
        self.assertLess(max(change.height * change.width for change in changes), 0.7 * shown.size)
        self.assertEqual(len(grids.messages), 1)
        grids.stop()
        self.assertTrue((cells(self.whole_costmap()) == shown).all())

    def whole_costmap(self):
        """What a newcomer gets."""
        grids = Collector(NODE + '/global_costmap/costmap', OccupancyGrid)
        self.robot.live_until(lambda: grids.messages, 'the costmap')
        grids.stop()
        return grids.messages[0]

    def test_recoveries_are_told_when_they_begin(self):
        recoveries = Collector(NODE + '/recovery_status', RecoveryStatus)
        self.send(CLOSED_CELL)
        self.assertEqual(self.end().status, GoalStatus.ABORTED)
        told = recoveries.wait_for_count(2)
        self.assertEqual(
            [(one.current_recovery_number, one.total_number_of_recoveries, one.recovery_behavior_name) for one in told],
            [(0, 2, 'conservative_reset'), (1, 2, 'aggressive_reset')],
        )
        place = told[0].pose_stamped
        self.assertEqual(place.header.frame_id, 'map')
        self.assertLess(math.hypot(place.pose.position.x - START.x_m, place.pose.position.y - START.y_m), 0.01)

    def test_the_clouds_of_the_dwa(self):
        trajectories = Collector(NODE + '/DWAPlannerROS/trajectory_cloud', PointCloud2)
        costs = Collector(NODE + '/DWAPlannerROS/cost_cloud', PointCloud2)
        self.send(GOAL)
        self.assertEqual(self.end().status, GoalStatus.SUCCEEDED)
        counts = [len(collector.wait_for_count(3)) for collector in (trajectories, costs)]
        first, grid = trajectories.messages[0], costs.messages[0]
        self.assertEqual([first.header.frame_id, grid.header.frame_id], ['odom', 'odom'])
        points, around = table(first), table(grid)
        self.assertEqual(list(points), ['x', 'y', 'z', 'theta', 'cost'])
        self.assertEqual(list(around), ['x', 'y', 'z', 'path_cost', 'goal_cost', 'occ_cost', 'total_cost'])
        here = self.robot.pose_in_odom()
        for values in (points, around):
            distances = np.hypot(values['x'] - here.x_m, values['y'] - here.y_m)
            self.assertLess(distances.max(), 3.5)
            self.assertGreater(len(distances), 30)
        self.assertGreaterEqual(points['cost'].min(), 0.0)
        self.assertLess(around['occ_cost'].max(), 253)
        self.robot.live(10)  # nothing is chosen any more
        self.assertEqual([len(collector.messages) for collector in (trajectories, costs)], counts)

    # ---- dynamic_reconfigure

    def client(self, part=''):
        client = Client(NODE + part, timeout=TIMEOUT_S)
        self.addCleanup(client.close)
        return client

    def test_the_namespaces_of_upstream_offer_its_parameters(self):
        for part, names in (
            ('', 'planner_frequency controller_frequency recovery_behavior_enabled oscillation_timeout'),
            ('/DWAPlannerROS', 'max_vel_x acc_lim_theta vx_samples use_dwa path_distance_bias restore_defaults'),
            ('/global_costmap', 'update_frequency publish_frequency footprint robot_radius footprint_padding'),
            ('/local_costmap', 'width height resolution'),
            ('/global_costmap/inflation_layer', 'enabled inflation_radius cost_scaling_factor'),
            ('/local_costmap/obstacle_layer', 'enabled combination_method footprint_clearing_enabled'),
        ):
            client = self.client(part)
            offered = {one['name']: one for one in client.get_parameter_descriptions(TIMEOUT_S)}
            self.assertEqual(set(names.split()) - set(offered), set(), part)
            values = client.get_configuration(TIMEOUT_S)
            self.assertTrue(
                all(one['min'] <= values[name] <= one['max'] or one['type'] == 'str' for name, one in offered.items())
            )
        self.assertEqual(self.client('/DWAPlannerROS').get_configuration(TIMEOUT_S)['max_vel_x'], 0.45)

    def test_a_speed_that_is_changed_on_the_way_is_kept(self):
        client = self.client('/DWAPlannerROS')
        self.send(FAR)
        self.robot.live_until(lambda: self.robot.twist[0] > 0.3, 'speed')
        # As docs/live_trials.md says it.
        subprocess.check_call(
            ['rosrun', 'dynamic_reconfigure', 'dynparam', 'set', '/move_base/DWAPlannerROS', 'max_vel_x', '0.2']
        )
        self.assertEqual(client.get_configuration(TIMEOUT_S)['max_vel_x'], 0.2)
        self.robot.live_until(lambda: self.robot.twist[0] < 0.21, 'less speed')
        self.robot.commands.clear()
        self.assertEqual(self.end().status, GoalStatus.SUCCEEDED)
        self.assertLessEqual(max(message.linear.x for message in self.robot.commands.messages), 0.2001)
        self.assertEqual(rospy.get_param(NODE + '/DWAPlannerROS/max_vel_x'), 0.2)
        self.assertEqual(rospy.get_param(NODE + '/DWAPlannerROS/sim_time'), 1.7)
        restored = client.update_configuration({'restore_defaults': True})
        self.assertEqual((restored['max_vel_x'], restored['restore_defaults']), (0.45, False))

    def test_what_is_beyond_the_limits_is_clamped_and_what_cannot_be_is_refused(self):
        client = self.client('/DWAPlannerROS')
        self.assertEqual(client.update_configuration({'acc_lim_theta': 25.0})['acc_lim_theta'], 20.0)
        self.assertEqual(client.update_configuration({'acc_lim_theta': 4.9})['acc_lim_theta'], 4.9)
        self.rosout.clear()
        self.assertEqual(client.update_configuration({'min_vel_x': 0.6})['min_vel_x'], 0.0)
        self.rosout.wait_for_warning(NODE, 'not changed', 'min_vel_x not above max_vel_x')
        self.assertEqual(client.update_configuration({'sim_time': float('nan')})['sim_time'], 1.7)
        self.rosout.wait_for_warning(NODE, 'not changed', 'sim_time', 'nan')
        planner = self.client().update_configuration({'base_local_planner': 'teb_local_planner/TebLocalPlannerROS'})
        self.assertEqual(planner['base_local_planner'], 'dwa_local_planner/DWAPlannerROS')

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
        self.robot.muted.clear()
        self.robot.change_scan = unchanged
        self.robot.live(10)
        self.send(GOAL)
        self.assertEqual(self.end().status, GoalStatus.SUCCEEDED)


if __name__ == '__main__':
    rostest.rosrun('diff_encoder_sim', 'move_base_tools', MoveBaseToolsTest)
