"""The navigator: its inputs, and closed loops of a kinematic robot with encoders and a laser."""

import logging
import math
import subprocess
import sys

import numpy as np
import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.params import with_changes
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, wrap_angle
from diff_encoder_sim.navigation.global_planner import PlanError
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.navigation.navigator_inputs import (
    MOST_AHEAD_S,
    STOP,
    Command,
    ControlRate,
    GoalStatus,
    MissingInput,
    NavigatorInputs,
    OdometrySample,
    Phase,
)
from diff_encoder_sim.navigation.recovery import TravelWatch
from navigation_simulation import LASER_IN_BASE, ClosedLoop, navigator_params, rasterise, read_shapes, walled_room
from places import SOURCE, SUPPORT

MS = 1_000_000


@pytest.fixture(name='room', scope='module')
def fixture_room():
    return walled_room()


def controlled_ms(stamps_ms, frequency_hz=20.0):
    rate = ControlRate(frequency_hz)
    return [stamp for stamp in stamps_ms if rate.is_due(round(stamp * MS))]


@pytest.mark.parametrize('odometry_hz', [25, 30, 200])
def test_faster_odometry_is_controlled_at_the_rate(odometry_hz):
    stamps = np.arange(0, 10_000, 1000 / odometry_hz)
    due = controlled_ms(stamps)
    assert len(due) == pytest.approx(200, abs=1)
    # Only the first period may be half a one; then they are as regular as the stamps that come.
    assert np.abs(np.diff(due)[1:] - 50.0).max() <= 1000 / odometry_hz


@pytest.mark.parametrize('odometry_hz', [5, 19])
def test_slower_odometry_is_controlled_each_time(odometry_hz):
    stamps = list(np.arange(0, 10_000, 1000 / odometry_hz))
    assert controlled_ms(stamps) == stamps


def test_jitter_is_never_skipped():
    """The encoder samples at the first joint state after each boundary: up to 20 ms late."""
    random = np.random.default_rng(1)
    stamps = list(50.0 * np.arange(1000) + random.uniform(0.0, 20.0, 1000))
    assert controlled_ms(stamps) == stamps


def test_gaps_and_time_that_goes_back_begin_a_new_period():
    assert controlled_ms([0, 10, 50, 3000, 3010, 3050, 200, 210, 250]) == [0, 50, 3000, 3050, 200, 250]
    assert controlled_ms([100, 100, 90]) == [100]  # repeated, overtaken


def scan_of(*ranges_m):
    return Scan(0, 0.0, 0.1, 0.15, 6.0, np.array(ranges_m))


@pytest.mark.parametrize('ranges', [(math.nan, 0.14), (6.1, -math.inf)])
def test_a_scan_without_a_valid_range_is_not_fresh(ranges):
    inputs = NavigatorInputs(IDENTITY)
    with pytest.raises(InputFault, match=f'none of {len(ranges)} ranges is valid: from 0.15 to 6 m'):
        inputs.take_scan(scan_of(*ranges))
    assert inputs.scan is None


def test_each_scan_counts_from_its_own_laser():
    front, back = Pose2D(0.2, 0.0, 0.0), Pose2D(-0.2, 0.0, 3.0)
    inputs = NavigatorInputs(front)
    inputs.take_odometry(OdometrySample(0, IDENTITY, 0.0, 0.0))
    inputs.take_scan(scan_of(1.0))
    assert inputs.laser_pose_in_odom() == pytest.approx(front)
    inputs.take_scan(scan_of(1.0), back)
    assert inputs.laser_pose_in_odom() == pytest.approx(back)
    with pytest.raises(InputFault):
        inputs.take_scan(scan_of(math.nan), front)
    assert inputs.laser_pose_in_odom() == pytest.approx(back)


def test_what_is_dated_far_ahead_is_not_fresh():
    """A clock that is ahead must not make a dead sensor look alive."""
    inputs = NavigatorInputs(IDENTITY)
    inputs.take_odometry(OdometrySample(0, IDENTITY, 0.0, 0.0))
    inputs.take_scan(scan_of(1.0))
    inputs.take_localization(round((MOST_AHEAD_S + 0.5) * 1e9), IDENTITY)
    assert str(inputs.missing(0, 0.5)) == 'localization (map->odom) is dated 2.5 s ahead of the clock'


def test_nothing_moves_before_the_first_inputs(room):
    navigator = Navigator(navigator_params(), room[1], LASER_IN_BASE)
    navigator.set_goal(Pose2D(1.0, 0.0, 0.0))
    output = navigator.step(0)
    assert output.command == STOP and output.text == 'stopped: odometry has not been received yet'


def test_a_scan_counts_from_where_it_was_taken(room):
    navigator = Navigator(navigator_params(), room[1], IDENTITY)
    navigator.take_odometry(0, IDENTITY, 0.0, 1.0)
    navigator.take_odometry(100_000_000, Pose2D(0.2, 0.0, 0.1), 0.0, 1.0)
    navigator.take_scan(Scan(50_000_000, 0.0, 1.0, 0.1, 6.0, np.array([1.0])))
    assert navigator.inputs.laser_pose_in_odom() == pytest.approx((0.1, 0.0, 0.05))


def test_bad_inputs_are_refused_and_change_nothing(room):
    navigator = Navigator(navigator_params(), room[1], LASER_IN_BASE)
    with pytest.raises(InputFault, match='odometry'):
        navigator.take_odometry(0, Pose2D(math.nan, 0.0, 0.0), 0.0, 0.0)
    with pytest.raises(InputFault, match='map->odom'):
        navigator.take_localization(0, Pose2D(0.0, math.inf, 0.0))
    with pytest.raises(InputFault, match=r'odometry is at \(1e\+300, 0\) m'):
        navigator.take_odometry(0, Pose2D(1e300, 0.0, 0.0), 0.0, 0.0)
    with pytest.raises(InputFault, match=r'map->odom is at \(0, -1e\+10\) m'):
        navigator.take_localization(0, Pose2D(0.0, -1e10, 0.0))
    with pytest.raises(InputFault, match='no rays'):
        navigator.take_scan(Scan(0, 0.0, 0.1, 0.1, 6.0, np.empty(0)))
    assert navigator.inputs.missing(0, 0.5) == ('odometry', 'has not been received yet')


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
@pytest.mark.parametrize(('ppr', 'dwa'), [(None, {}), (40, TWIST_SIGMAS)])
def test_twenty_metres_down_the_hallway(hallway, ppr, dwa):
    loop = ClosedLoop(*hallway, Pose2D(-10.0, 0.0, 0.0), ppr, params=navigator_params(dwa))
    goal = Pose2D(10.0, 0.0, 0.0)
    loop.navigator.set_goal(goal)
    loop.run(60.0)
    assert_at(loop, goal)
    assert max(abs(pose.y_m) for pose in loop.trace) < 0.1


@pytest.mark.heavy
@pytest.mark.parametrize(('ppr', 'dwa'), [(90, {}), (40, TWIST_SIGMAS)])
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
@pytest.mark.parametrize('bearing_deg', [0, 60, 150, 180, 270])
def test_a_goal_close_by_in_any_direction(room, distance, bearing_deg):
    """Straight behind, the DWA alone would dither for ever."""
    bearing = math.radians(bearing_deg)
    loop = ClosedLoop(*room, IDENTITY, 4096)
    goal = Pose2D(distance * math.cos(bearing), distance * math.sin(bearing), 0.0)
    loop.navigator.set_goal(goal)
    loop.run(20.0)
    assert_at(loop, goal)


@pytest.mark.parametrize('distance', [0.02, 0.15])
@pytest.mark.parametrize('bearing_deg', [0, 135, 180, 270])
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


def test_a_goal_in_a_wall_is_given_up_at_once_with_the_reason(room):
    loop = ClosedLoop(*room, IDENTITY)
    loop.navigator.set_goal(Pose2D(3.1, 0.0, 0.0))
    output = loop.run(1.0)
    assert output.status is GoalStatus.ABORTED and loop.period == 1
    assert output.text == 'the goal (3.10, 0.00) is in a wall of the map'
    assert output.command == STOP


PATIENCE = {'planner_patience': 0.5, 'controller_patience': 1.0}


def test_a_blocked_way_ends_after_recoveries(room):
    """A new wall across the room, which the map does not show."""
    shapes, grid = room
    loop = ClosedLoop(
        shapes.with_box(1.0, 0.0, 0.1, 4.0), grid, Pose2D(-1.0, 0.0, 0.0), params=navigator_params(**PATIENCE)
    )
    loop.navigator.set_goal(Pose2D(2.0, 0.0, 0.0))
    output = loop.run(60.0)
    assert output.status is GoalStatus.ABORTED
    assert 'after 4 recovery behaviours' in output.text
    texts = {output.text for output in loop.outputs}
    assert any(text.startswith('rotate_recovery') for text in texts)
    assert any(output.phase is Phase.CLEARING for output in loop.outputs)
    assert not loop.touched


def test_no_progress_calls_recovery(room):
    loop = ClosedLoop(*room, Pose2D(-1.0, 0.0, 0.0), params=navigator_params(oscillation_timeout=2.0))
    loop.robot.drive = lambda command, ticks: setattr(
        loop.robot, 'now_ns', loop.robot.now_ns + ticks * 10_000_000
    )  # stuck
    loop.navigator.set_goal(Pose2D(2.0, 0.0, 0.0))
    loop.run(4.0)
    texts = [output.text for output in loop.outputs]
    assert any(text.startswith('conservative_reset') for text in texts)


def test_a_stop_is_logged_once_and_so_is_the_return(room, caplog):
    caplog.set_level(logging.INFO)
    loop = ClosedLoop(*room, Pose2D(-2.0, 0.0, 0.0))
    loop.navigator.set_goal(AHEAD)
    loop.run(2.0)
    caplog.clear()
    loop.muted.add('scan')
    loop.run(3.0)
    loop.muted.clear()
    loop.run(1.0)
    assert [record.getMessage() for record in caplog.records] == [
        'scan is 0.6 s old (input_timeout 0.5 s); robot stopped',
        'scan received again: driving on with a new plan',
    ]


def test_the_user_may_say_what_is_missing(room):
    loop = ClosedLoop(*room, Pose2D(-2.0, 0.0, 0.0))
    loop.navigator.set_goal(AHEAD)
    loop.run(2.0)
    output = loop.navigator.wait(MissingInput('/odom', 'is silent'))
    assert (output.command, output.status) == (STOP, GoalStatus.ACTIVE)
    assert output.text == 'stopped: /odom is silent'
    assert loop.run(30.0).status is GoalStatus.SUCCEEDED


def test_a_new_goal_goes_on_from_the_command_in_force(room):
    loop = ClosedLoop(*room, Pose2D(-2.0, 0.0, 0.0), ppr=40, params=navigator_params({'twist_sigmas': 3.47}))
    loop.navigator.set_goal(AHEAD)
    loop.run(4.0)
    before = loop.outputs[-1].command.linear_mps
    loop.navigator.set_goal(Pose2D(2.0, 0.2, 0.0))
    assert before > 0.3 and abs(loop.step().command.linear_mps - before) < 0.05


def test_a_goal_sent_during_a_recovery_turn_is_driven_to(room):
    shapes, grid = room
    loop = ClosedLoop(
        shapes.with_box(1.0, 0.0, 0.1, 4.0), grid, Pose2D(-1.0, 0.0, 0.0), params=navigator_params(planner_patience=0.5)
    )
    loop.navigator.set_goal(AHEAD)
    while not loop.step().text.startswith('rotate_recovery'):
        pass
    loop.run(1.0)
    loop.navigator.set_goal(Pose2D(-2.0, 0.5, 1.0))
    assert loop.step().phase is Phase.CONTROLLING
    assert loop.run(30.0).status is GoalStatus.SUCCEEDED
    assert not loop.touched


def freeze(loop):
    """From now on odometry sends what it sent last, at a stand; returns what mends it."""
    read, frozen = loop.robot.odometry, (loop.robot.odometry()[0], 0.0, 0.0)
    loop.robot.odometry = lambda: frozen
    return lambda: setattr(loop.robot, 'odometry', read)


def test_travel_sums_up_while_the_pose_stays():
    watch = TravelWatch(0.3, turning_radius_m=0.25)
    watch.update(0, IDENTITY, Command(0.4, 1.0))
    assert watch.unseen_m == 0.0
    watch.update(500_000_000, IDENTITY, Command(0.4, -0.4))
    assert watch.unseen_m == pytest.approx(0.25) and not watch.is_over_limit
    watch.update(600_000_000, IDENTITY, Command(-0.4, 0.4))
    assert watch.unseen_m == pytest.approx(0.3)
    watch.update(650_000_000, IDENTITY, Command(0.4, 0.0))
    assert watch.is_over_limit
    watch.update(700_000_000, Pose2D(0.0, 0.0, 1e-6), Command(0.4, 0.0))
    assert watch.unseen_m == 0.0 and not watch.is_over_limit


def test_frozen_odometry_ends_the_goal_and_the_next_one_works(room):
    loop = ClosedLoop(*room, Pose2D(-2.0, 0.0, 0.0), ppr=90)
    loop.navigator.set_goal(AHEAD)
    loop.run(3.0)
    mend, frozen_at = freeze(loop), loop.robot.pose
    output = loop.run(20.0)  # by a twist of zero it commands little
    assert (output.status, output.command) == (GoalStatus.ABORTED, STOP)
    assert output.text == 'odometry has not moved for 0.30 m of commanded travel (max_unseen_travel)'
    assert 0.2 < loop.robot.pose.x_m - frozen_at.x_m < 0.45  # with what it rolls on
    mend()
    loop.navigator.set_goal(AHEAD)
    assert loop.run(30.0).status is GoalStatus.SUCCEEDED


def test_goals_in_quick_succession_do_not_hide_frozen_odometry(room):
    loop = ClosedLoop(*room, Pose2D(-2.0, 0.0, 0.0))
    freeze(loop)
    for _ in range(100):
        loop.navigator.set_goal(AHEAD)
        if loop.run(0.5).status is GoalStatus.ABORTED:
            break
    assert loop.navigator.status is GoalStatus.ABORTED
    assert loop.robot.pose.x_m < -1.6


DRIVE_AFTER_WARM_UP = """
import importlib, pkgutil
import diff_encoder_sim.navigation as navigation
from diff_encoder_sim.navigation.navigator import warm_up
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.kernels import Kernel
import navigation_simulation as simulation

def compiled():
    return {f'{module.name}.{name}': len(value.signatures)
            for module in pkgutil.iter_modules(navigation.__path__, navigation.__name__ + '.')
            for name, value in vars(importlib.import_module(module.name)).items() if isinstance(value, Kernel)}

warm_up()
before = compiled()
assert sum(before.values()) > 5, before
shapes, grid = simulation.walled_room()
loop = simulation.ClosedLoop(shapes.with_box(1.0, 0.0, 0.1, 4.0), grid, Pose2D(-1.0, 0.0, 0.0),
                             params=simulation.navigator_params(planner_patience=0.5,
                                                                NavfnROS={'use_dijkstra': False}))
for goal in Pose2D(2.0, 0.0, 0.0), Pose2D(-2.0, 0.5, 2.0):      # the first is out of reach: recoveries
    loop.navigator.set_goal(goal)
    print(loop.run(60.0).status.name)
assert compiled() == before, (before, compiled())
"""


def test_nothing_is_left_to_compile_after_the_warm_up():
    result = subprocess.run(
        [sys.executable, '-c', DRIVE_AFTER_WARM_UP],
        cwd=str(SUPPORT),
        capture_output=True,
        text=True,
        env={'PYTHONPATH': f'{SOURCE}:{SUPPORT}', 'PATH': ''},
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout.split() == ['ABORTED', 'SUCCEEDED']


def test_make_plan_needs_a_pose_and_finite_numbers(room):
    loop = ClosedLoop(*room, IDENTITY)
    with pytest.raises(InputFault, match='pose is not known yet'):
        loop.navigator.make_plan(None, AHEAD)
    with pytest.raises(PlanError, match='tolerance nan'):
        loop.navigator.make_plan(IDENTITY, AHEAD, math.nan)
    assert len(loop.navigator.make_plan(IDENTITY, AHEAD)) > 2


def test_frozen_odometry_ends_a_recovery_turn_too(room):
    shapes, grid = room
    loop = ClosedLoop(
        shapes.with_box(1.0, 0.0, 0.1, 4.0),
        grid,
        Pose2D(-1.0, 0.0, 0.0),
        params=navigator_params(planner_patience=0.5, controller_patience=0.5),
    )
    loop.navigator.set_goal(AHEAD)
    while not loop.step().text.startswith('rotate_recovery'):
        pass
    freeze(loop)
    output = loop.run(5.0)
    assert output.status is GoalStatus.ABORTED and 'odometry has not moved' in output.text
