"""Closed loops: a kinematic robot with encoders and a laser, driven by the navigator."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.params import with_changes
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, wrap_angle
from diff_encoder_sim.navigation.global_planner import PlanError
from diff_encoder_sim.navigation.navigator_inputs import STOP, GoalStatus
from navigation_simulation import ClosedLoop, navigator_params, rasterise, read_shapes

AHEAD = Pose2D(2.0, 0.0, 0.0)
XY_TOLERANCE_M, YAW_TOLERANCE_RAD = 0.05, 0.052


# Between pillars the robot should keep off them: a wide and slow decay, as for TurtleBot 3.
WIDE = {'inflation_radius': 1.0, 'cost_scaling_factor': 3.0}


# The square root of 12: a pulse is this many standard deviations of its rounding error.
TWIST_SIGMAS = {'twist_sigmas': 3.47}
PRECISE = {'stop': 'precise', 'latch_margin': 0.2}
PASSAGE = 1.87 / 2  # pillars stand on multiples of 1.87 m


@pytest.fixture(scope='module')
def hallway():
    shapes = read_shapes('hallway')
    return shapes, rasterise(shapes, (-17.0, -4.0), (17.0, 4.0))


@pytest.fixture(scope='module')
def ros_logo():
    shapes = read_shapes('ros_logo')
    return shapes, rasterise(shapes, (-6.5, -6.5), (7.0, 6.5))


def wide_params(dwa=None, **changes):
    return navigator_params(
        {'occdist_scale': 0.02, **(dwa or {})},
        global_costmap=WIDE,
        local_costmap={**WIDE, 'global_frame': 'odom', 'rolling_window': True},
        **changes,
    )


def distance_m(pose, goal):
    return math.hypot(pose.x_m - goal.x_m, pose.y_m - goal.y_m)


def assert_at(loop, goal):
    """The true pose is at the goal: tolerance, and the little that it rolls out after."""
    output = loop.outputs[-1]
    assert output.status is GoalStatus.SUCCEEDED, output.text
    pose = loop.robot.pose
    assert distance_m(pose, goal) <= XY_TOLERANCE_M + 0.02
    assert abs(wrap_angle(pose.yaw_rad - goal.yaw_rad)) <= YAW_TOLERANCE_RAD + 0.02
    assert not loop.touched


@pytest.mark.heavy
@pytest.mark.parametrize(('ppr', 'dwa'), [(None, {}), (4096, {}), (90, {}), (40, TWIST_SIGMAS)])
def test_twenty_metres_down_the_hallway(hallway, ppr, dwa):
    loop = ClosedLoop(*hallway, Pose2D(-10.0, 0.0, 0.0), ppr, params=navigator_params(dwa))
    goal = Pose2D(10.0, 0.0, 0.0)
    loop.navigator.set_goal(goal)
    loop.run(60.0)
    assert_at(loop, goal)
    assert max(abs(pose.y_m) for pose in loop.trace) < 0.1


def test_upstreams_reading_of_a_coarse_twist_is_slow_but_safe(hallway):
    """40 pulses taken at face value: one wheel's tick is a turn of 0.785 rad/s."""
    loop = ClosedLoop(*hallway, Pose2D(5.0, 0.0, 0.0), 40, params=navigator_params({'path_distance_bias': 10.0}))
    loop.navigator.set_goal(Pose2D(10.0, 0.0, 0.0))
    loop.run(40.0)
    assert not loop.touched
    assert loop.robot.pose.x_m > 6.0


@pytest.mark.heavy
@pytest.mark.parametrize(('ppr', 'dwa'), [(None, {}), (90, {}), (40, TWIST_SIGMAS)])
def test_an_s_course_around_pillars(ros_logo, ppr, dwa):
    route = [Pose2D(-PASSAGE, PASSAGE, 0.0), Pose2D(PASSAGE, -PASSAGE, 0.0), Pose2D(3 * PASSAGE, PASSAGE, 1.57)]
    loop = ClosedLoop(*ros_logo, Pose2D(-3 * PASSAGE, PASSAGE, 0.0), ppr, params=wide_params(dwa))
    for index, goal in enumerate(route):
        loop.navigator.set_goal(goal)
        while index < len(route) - 1 and distance_m(loop.robot.pose, goal) > 0.5:
            loop.step()
            assert len(loop.outputs) < 800
    passed = len(loop.outputs)
    loop.run(40.0)
    assert_at(loop, route[-1])
    # It does not stop at waypoints, only slows in the bends before them.
    speeds = [output.command.linear_mps for output in loop.outputs[20:passed]]
    assert len(speeds) > 100 and np.mean(speeds) > 0.35


@pytest.mark.parametrize('distance', [0.06, 0.35])
@pytest.mark.parametrize('bearing_deg', range(0, 360, 30))
def test_a_goal_close_by_in_any_direction(room, distance, bearing_deg):
    """Straight behind, the DWA alone would dither for ever."""
    bearing = math.radians(bearing_deg)
    loop = ClosedLoop(*room, IDENTITY, 4096)
    goal = Pose2D(distance * math.cos(bearing), distance * math.sin(bearing), 0.0)
    loop.navigator.set_goal(goal)
    loop.run(20.0)
    assert_at(loop, goal)


@pytest.mark.parametrize('distance', [0.02, 0.06, 0.15, 0.35])
@pytest.mark.parametrize('bearing_deg', range(0, 360, 45))
def test_a_precise_stop_at_a_goal_close_by_in_any_direction(room, distance, bearing_deg):
    """Who drives there comes within 2 cm of it, with 40 pulses; who stands within the tolerance may stay."""
    bearing = math.radians(bearing_deg)
    loop = ClosedLoop(*room, IDENTITY, 40, params=navigator_params({**TWIST_SIGMAS, **PRECISE}))
    goal = Pose2D(distance * math.cos(bearing), distance * math.sin(bearing), 2.0 * bearing)
    loop.navigator.set_goal(goal)
    loop.run(25.0)
    assert_at(loop, goal)
    assert distance == 0.02 or distance_m(loop.robot.pose, goal) < 0.02


@pytest.mark.heavy
@pytest.mark.parametrize(('ppr', 'dwa', 'expected_m'), [(None, {}, 0.007), (40, TWIST_SIGMAS, 0.02)])
def test_a_precise_stop_after_twenty_metres(hallway, ppr, dwa, expected_m):
    loop = ClosedLoop(*hallway, Pose2D(-10.0, 0.0, 0.0), ppr, params=navigator_params({**dwa, **PRECISE}))
    goal = Pose2D(10.0, 0.0, 0.0)
    loop.navigator.set_goal(goal)
    loop.run(60.0)
    assert_at(loop, goal)
    assert distance_m(loop.robot.pose, goal) < expected_m


def test_a_precise_stop_goes_on_while_plans_are_renewed(room):
    goal = Pose2D(1.0, 0.3, 1.0)
    loop = ClosedLoop(*room, IDENTITY, params=navigator_params(PRECISE, planner_frequency=10.0))
    loop.navigator.set_goal(goal)
    loop.run(30.0)
    assert_at(loop, goal)
    assert distance_m(loop.robot.pose, goal) < 0.007


def test_a_precise_stop_close_to_a_wall(room):
    """The wall is nearer than the robot would come in sim_time at the speed of the approach."""
    goal = Pose2D(3.0 - 0.25 - 0.2, 0.0, 0.0)
    loop = ClosedLoop(*room, IDENTITY, params=navigator_params(PRECISE))
    loop.navigator.set_goal(goal)
    loop.run(30.0)
    assert_at(loop, goal)
    assert distance_m(loop.robot.pose, goal) < 0.007


def test_a_goal_behind_the_robot(room):
    loop = ClosedLoop(*room, Pose2D(1.5, 0.0, 0.0))
    goal = Pose2D(-1.5, 0.0, 0.0)
    loop.navigator.set_goal(goal)
    loop.run(30.0)
    assert_at(loop, goal)


def test_equal_inputs_give_equal_commands(room):
    def drive():
        loop = ClosedLoop(*room, Pose2D(-2.0, -1.0, 0.5), 90, seed=3)
        loop.navigator.set_goal(Pose2D(2.0, 1.0, 0.0))
        loop.run(15.0)
        return [output.command for output in loop.outputs]

    assert drive() == drive()


def test_it_goes_on_when_the_way_opens(room):
    shapes, grid = room
    goal = Pose2D(2.0, 0.0, 0.0)
    loop = ClosedLoop(
        shapes.with_box(1.0, 0.0, 0.1, 4.0), grid, Pose2D(-1.0, 0.0, 0.0), params=navigator_params(planner_patience=3.0)
    )
    loop.navigator.set_goal(goal)
    loop.run(8.0)
    assert loop.outputs[-1].status is GoalStatus.ACTIVE
    loop.robot.shapes = shapes
    loop.run(60.0)
    assert_at(loop, goal)


def test_an_obstacle_that_is_not_on_the_map_is_driven_around(room):
    shapes, grid = room
    goal = Pose2D(2.2, 0.0, 0.0)
    loop = ClosedLoop(
        shapes.with_box(0.3, 0.2, 0.3, 0.8), grid, Pose2D(-2.2, 0.0, 0.0), params=wide_params(planner_frequency=1.0)
    )
    loop.navigator.set_goal(goal)
    loop.run(40.0)
    assert_at(loop, goal)


@pytest.mark.parametrize(
    ('name', 'text'),
    [('odometry', 'odometry is'), ('scan', 'scan is'), ('localization', 'localization (map->odom) is')],
)
def test_a_stale_input_stops_the_robot_until_it_returns(room, name, text):
    goal = Pose2D(2.0, 0.0, 0.0)
    loop = ClosedLoop(*room, Pose2D(-2.0, 0.0, 0.0))
    loop.navigator.set_goal(goal)
    loop.run(3.0)
    assert loop.outputs[-1].command.linear_mps > 0.2
    loop.muted.add(name)
    loop.run(0.7)
    output = loop.outputs[-1]
    assert output.command == STOP and output.status is GoalStatus.ACTIVE
    assert output.text.startswith('stopped: ') and text in output.text
    assert 'input_timeout 0.5 s' in output.text
    loop.run(20.0)  # longer than every patience: waiting is not failing
    assert loop.outputs[-1].status is GoalStatus.ACTIVE
    loop.muted.clear()
    loop.run(20.0)
    assert_at(loop, goal)


def test_time_that_jumps_back_ends_the_goal_and_starts_over(room):
    loop = ClosedLoop(*room, Pose2D(-2.0, 0.0, 0.0))
    loop.navigator.set_goal(Pose2D(2.0, 0.0, 0.0))
    loop.run(2.0)
    output = loop.navigator.step(0)
    assert (output.status, output.text, output.command) == (GoalStatus.PREEMPTED, 'time went back', STOP)
    loop.robot.now_ns = 0
    goal = Pose2D(2.0, 1.0, 0.0)
    loop.navigator.set_goal(goal)
    loop.run(30.0)
    assert_at(loop, goal)


def test_cancel_stops(room):
    loop = ClosedLoop(*room, Pose2D(-2.0, 0.0, 0.0))
    loop.navigator.set_goal(Pose2D(2.0, 0.0, 0.0))
    loop.run(2.0)
    loop.navigator.cancel()
    output = loop.step()
    assert output.status is GoalStatus.PREEMPTED and output.command == STOP
    assert len(loop.navigator.local_plan_in_odom) == 0


def test_a_new_goal_replaces_the_old_one(room):
    loop = ClosedLoop(*room, Pose2D(-2.0, 0.0, 0.0))
    loop.navigator.set_goal(Pose2D(2.0, 0.0, 0.0))
    loop.run(2.0)
    goal = Pose2D(-1.0, -1.0, -1.57)
    loop.navigator.set_goal(goal)
    loop.run(30.0)
    assert_at(loop, goal)


def test_make_plan_and_clear_costmaps_need_no_goal(room):
    loop = ClosedLoop(*room, Pose2D(-2.0, 0.0, 0.0))
    assert loop.step().status is GoalStatus.NONE
    plan = loop.navigator.make_plan(None, Pose2D(2.0, 0.0, 0.0))
    assert plan[0, :2] == pytest.approx((-2.0, 0.0))
    with pytest.raises(PlanError, match='wall'):
        loop.navigator.make_plan(None, Pose2D(3.1, 0.0, 0.0))
    loop.navigator.clear_costmaps()
    assert (loop.navigator.local_costmap.costs == 0).all()


def test_make_plan_needs_a_pose_and_finite_numbers(room):
    loop = ClosedLoop(*room, IDENTITY)
    with pytest.raises(InputFault, match='pose is not known yet'):
        loop.navigator.make_plan(None, AHEAD)
    with pytest.raises(PlanError, match='tolerance nan'):
        loop.navigator.make_plan(IDENTITY, AHEAD, math.nan)
    assert len(loop.navigator.make_plan(IDENTITY, AHEAD)) > 2


def test_parameters_that_change_on_the_way_count_from_then_on(hallway):
    """The goal stays, the plan stays, and another local planner follows it."""
    loop = ClosedLoop(*hallway, IDENTITY, params=navigator_params())
    loop.navigator.set_goal(AHEAD)
    for _ in range(30):
        loop.step()
    plan = loop.navigator.global_plan_in_map
    assert loop.outputs[-1].command.linear_mps > 0.3
    loop.navigator.reconfigure(navigator_params({'max_vel_x': 0.2, 'max_vel_trans': 0.2}))
    for _ in range(20):
        loop.step()
    assert 0.15 < loop.outputs[-1].command.linear_mps <= 0.2
    assert loop.navigator.global_plan_in_map is plan
    loop.run(30.0)
    assert_at(loop, AHEAD)


def test_what_did_not_change_is_kept(hallway):
    navigator = ClosedLoop(*hallway, IDENTITY, params=navigator_params()).navigator
    costmaps = navigator.global_costmap, navigator.local_costmap
    navigator.reconfigure(with_changes(navigator.params, {'local_costmap': {'publish_frequency': 7.0}}, ''))
    assert navigator.global_costmap is costmaps[0] and navigator.local_costmap is not costmaps[1]
    assert navigator.local_costmap.params.publish_frequency == 7.0
