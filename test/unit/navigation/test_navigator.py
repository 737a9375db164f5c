"""The navigator: its inputs, and closed loops of a kinematic robot with encoders and a laser."""

import logging
import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, wrap_angle
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.navigation import navigator_inputs as inputs
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.navigation.navigator_inputs import STOP, ControlRate, GoalStatus, NavigatorInputs, OdometrySample
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from navigation_simulation import LASER_IN_BASE, ClosedLoop, navigator_params, shipped_world, walled_room
from places import CONFIG

MS = 1_000_000
XY_TOLERANCE_M, YAW_TOLERANCE_RAD = 0.05, 0.052
AHEAD = Pose2D(2.0, 0.0, 0.0)
SHIPPED = load_yaml(CONFIG / 'navigation.yaml')
# The square root of 12: a pulse is this many standard deviations of its rounding error.
TWIST_SIGMAS = {'twist_sigmas': 3.47}
PRECISE = {'stop': 'precise', 'latch_margin': 0.2}
PASSAGE = 1.87 / 2  # pillars stand on multiples of 1.87 m


@pytest.fixture(name='room', scope='module')
def fixture_room():
    return walled_room()


# ---- the rate of control


def controlled_ms(stamps_ms, frequency_hz=20.0):
    rate = ControlRate(frequency_hz)
    return [stamp for stamp in stamps_ms if rate.is_due(round(stamp * MS))]


@pytest.mark.parametrize('odometry_hz', [25, 200])
def test_faster_odometry_is_controlled_at_the_rate(odometry_hz):
    due = controlled_ms(np.arange(0, 10_000, 1000 / odometry_hz))
    assert len(due) == pytest.approx(200, abs=1)
    # Only the first period may be half a one; then they are as regular as the stamps that come.
    assert np.abs(np.diff(due)[1:] - 50.0).max() <= 1000 / odometry_hz


def test_slower_odometry_and_jitter_are_controlled_each_time():
    """The encoder samples at the first joint state after each boundary: up to 20 ms late."""
    late = 50.0 * np.arange(1000) + np.random.default_rng(1).uniform(0.0, 20.0, 1000)
    for stamps in (np.arange(0, 10_000, 200.0), np.arange(0, 10_000, 1000 / 19), late):
        assert controlled_ms(stamps) == list(stamps)


def test_gaps_and_time_that_goes_back_begin_a_new_period():
    assert controlled_ms([0, 10, 50, 3000, 3010, 3050, 200, 210, 250]) == [0, 50, 3000, 3050, 200, 250]
    assert controlled_ms([100, 100, 90]) == [100]  # repeated, overtaken


# ---- inputs


def scan_of(*ranges_m, stamp_ns=0):
    return Scan(stamp_ns, 0.0, 0.1, 0.15, 6.0, np.array(ranges_m))


@pytest.mark.parametrize(
    ('method', 'given'),
    [
        ('take_scan', (scan_of(math.nan, 0.14),)),
        ('take_scan', (scan_of(6.1, -math.inf),)),
        ('take_scan', (scan_of(),)),
        ('take_odometry', (OdometrySample(0, Pose2D(math.nan, 0.0, 0.0), 0.0, 0.0),)),
        ('take_odometry', (OdometrySample(0, IDENTITY, 0.0, math.inf),)),
        ('take_odometry', (OdometrySample(0, Pose2D(1e300, 0.0, 0.0), 0.0, 0.0),)),
        ('take_localization', (0, Pose2D(0.0, math.inf, 0.0))),
        ('take_localization', (0, Pose2D(0.0, -1e10, 0.0))),
    ],
)
def test_bad_inputs_are_refused_and_change_nothing(method, given):
    taken = NavigatorInputs(IDENTITY)
    with pytest.raises(InputFault):
        getattr(taken, method)(*given)
    assert taken.missing(0, 0.5).what == 'odometry' and taken.scan is None and not taken.has_pose


def test_a_scan_counts_from_its_laser_where_it_was_taken():
    front, back = Pose2D(0.2, 0.0, 0.0), Pose2D(-0.2, 0.0, 3.0)
    taken = NavigatorInputs(front)
    taken.take_odometry(OdometrySample(0, IDENTITY, 0.0, 1.0))
    taken.take_odometry(OdometrySample(100 * MS, Pose2D(0.2, 0.0, 0.1), 0.0, 1.0))
    for stamp_ns, base in ((-1, IDENTITY), (50 * MS, Pose2D(0.1, 0.0, 0.05)), (200 * MS, Pose2D(0.2, 0.0, 0.1))):
        for given, mount in ((None, front), (back, back)):
            taken.take_scan(scan_of(1.0, stamp_ns=stamp_ns), given)
            assert taken.laser_pose_in_odom() == pytest.approx(base.compose(mount))


def test_an_input_dated_far_ahead_is_not_fresh():
    """A clock that is ahead must not make a dead sensor look alive."""
    taken = NavigatorInputs(IDENTITY)
    taken.take_odometry(OdometrySample(0, IDENTITY, 0.0, 0.0))
    taken.take_scan(scan_of(1.0))
    for ahead_s, missing in ((-0.5, None), (0.5, 'localization (map->odom)')):
        taken.take_localization(round((inputs.MOST_AHEAD_S + ahead_s) * 1e9), IDENTITY)
        assert getattr(taken.missing(0, 0.5), 'what', None) == missing


# ---- driving


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


def assert_drives_to_goal(world, start, goal, limit_s=30.0, ppr=None, params=None):
    loop = ClosedLoop(*world, start, ppr, params=params)
    loop.navigator.set_goal(goal)
    loop.run(limit_s)
    assert_at(loop, goal)
    return loop


def under_way(room, seconds=2.0, **options):
    loop = ClosedLoop(*room, Pose2D(-2.0, 0.0, 0.0), **options)
    loop.navigator.set_goal(AHEAD)
    loop.run(seconds)
    return loop


def blocked(room, **patience):
    """A loop with a wall across the room that the map does not show."""
    shapes, grid = room
    world = shapes.with_box(1.0, 0.0, 0.1, 4.0), grid
    loop = ClosedLoop(*world, Pose2D(-1.0, 0.0, 0.0), params=navigator_params(**patience))
    loop.navigator.set_goal(AHEAD)
    return loop


@pytest.mark.parametrize(('ppr', 'dwa', 'within_m'), [(40, TWIST_SIGMAS, 0.07), (None, PRECISE, 0.007)])
def test_twenty_metres_down_the_hallway(ppr, dwa, within_m):
    goal = Pose2D(10.0, 0.0, 0.0)
    loop = assert_drives_to_goal(
        shipped_world('hallway'), Pose2D(-10.0, 0.0, 0.0), goal, 60.0, ppr, navigator_params(dwa)
    )
    assert max(abs(pose.y_m) for pose in loop.trace) < 0.1
    assert distance_m(loop.robot.pose, goal) < within_m


def test_an_s_course_around_pillars():
    route = [Pose2D(-PASSAGE, PASSAGE, 0.0), Pose2D(PASSAGE, -PASSAGE, 0.0), Pose2D(3 * PASSAGE, PASSAGE, 1.57)]
    start, params = Pose2D(-3 * PASSAGE, PASSAGE, 0.0), NavigatorParams.from_mapping(SHIPPED, '')
    loop = ClosedLoop(*shipped_world('ros_logo'), start, 40, params=params)
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


@pytest.mark.parametrize('distance_m', [0.06, 0.35])
@pytest.mark.parametrize('bearing_deg', [0, 150, 180, 270])
def test_a_goal_close_by_in_any_direction(room, distance_m, bearing_deg):
    """Straight behind, the DWA alone would dither for ever."""
    bearing = math.radians(bearing_deg)
    assert_drives_to_goal(
        room, IDENTITY, Pose2D(distance_m * math.cos(bearing), distance_m * math.sin(bearing), 0.0), ppr=4096
    )


@pytest.mark.parametrize(
    ('goal', 'ppr', 'changes', 'within_m'),
    [
        # Who stands within the tolerance may stay.
        (Pose2D(-0.014, 0.014, -1.5), 40, {}, 0.05),
        # Who drives there comes within 2 cm of it, with 40 pulses.
        (Pose2D(0.15, 0.0, 0.0), 40, {}, 0.02),
        (Pose2D(-0.106, 0.106, -1.5), 40, {}, 0.02),
        (Pose2D(0.0, -0.15, -3.1), 40, {}, 0.02),
        (Pose2D(1.0, 0.3, 1.0), None, {'planner_frequency': 10.0}, 0.007),  # while plans are renewed
        # The wall is nearer than it would come in sim_time.
        (Pose2D(3.0 - 0.25 - 0.2, 0.0, 0.0), None, {}, 0.007),
    ],
)
def test_a_precise_stop(room, goal, ppr, changes, within_m):
    noise = TWIST_SIGMAS if ppr else {}
    loop = assert_drives_to_goal(
        room, IDENTITY, goal, ppr=ppr, params=navigator_params({**noise, **PRECISE}, **changes)
    )
    assert distance_m(loop.robot.pose, goal) < within_m


def test_an_obstacle_that_is_not_on_the_map_is_driven_around(room):
    shapes, grid = room
    world = shapes.with_box(0.3, 0.2, 0.3, 0.8), grid
    params = NavigatorParams.from_mapping({**SHIPPED, 'planner_frequency': 1.0}, '')
    assert_drives_to_goal(world, Pose2D(-2.2, 0.0, 0.0), Pose2D(2.2, 0.0, 0.0), 40.0, params=params)


# ---- goals, plans and inputs that end or change


def test_nothing_moves_before_the_first_inputs(room):
    navigator = Navigator(navigator_params(), room[1], LASER_IN_BASE)
    with pytest.raises(InputFault, match='pose is not known yet'):
        navigator.make_plan(None, AHEAD)
    navigator.set_goal(AHEAD)
    output = navigator.step(0)
    assert output.command == STOP and output.text == 'stopped: odometry has not been received yet'


@pytest.mark.parametrize('name', ['odometry', 'scan', 'localization'])
def test_a_stale_input_stops_the_robot_until_it_returns(room, name, caplog):
    caplog.set_level(logging.INFO)
    loop = under_way(room, 3.0)
    assert loop.outputs[-1].command.linear_mps > 0.2
    caplog.clear()
    loop.muted.add(name)
    loop.run(0.7)
    output = loop.outputs[-1]
    assert output.command == STOP and output.status is GoalStatus.ACTIVE
    assert output.text.startswith(f'stopped: {name}')
    loop.run(20.0)  # longer than every patience: waiting is not failing
    assert loop.outputs[-1].status is GoalStatus.ACTIVE
    loop.muted.clear()
    loop.run(1.0)
    # Logged once, and so is the return.
    assert [('stopped' in text, 'received again' in text) for text in caplog.messages] == [(True, False), (False, True)]
    loop.run(20.0)
    assert_at(loop, AHEAD)


# ---- recovery


def test_a_blocked_way_ends_after_recoveries(room):
    loop = blocked(room, planner_patience=0.5, controller_patience=1.0)
    output = loop.run(60.0)
    assert output.status is GoalStatus.ABORTED and 'after 4 recovery behaviours' in output.text
    started = [output.started_recovery for output in loop.outputs if output.started_recovery]
    names = ['conservative_reset', 'rotate_recovery', 'aggressive_reset', 'rotate_recovery']
    # Whenever a plan is found again they begin from the first.
    assert [(one.name, one.number, one.total) for one in started[-4:]] == [(name, i, 4) for i, name in enumerate(names)]
    assert any(output.phase is inputs.Phase.CLEARING for output in loop.outputs)
    assert not loop.touched


def test_it_goes_on_when_the_way_opens(room):
    loop = blocked(room, planner_patience=3.0)
    loop.run(8.0)
    assert loop.outputs[-1].status is GoalStatus.ACTIVE
    loop.robot.shapes = room[0]
    loop.run(60.0)
    assert_at(loop, AHEAD)


def test_no_progress_calls_recovery(room):
    loop = ClosedLoop(*room, Pose2D(-1.0, 0.0, 0.0), params=navigator_params(oscillation_timeout=2.0))
    base = loop.robot
    base.drive = lambda _, ticks: setattr(base, 'now_ns', base.now_ns + ticks * 10 * MS)  # it is stuck
    loop.navigator.set_goal(AHEAD)
    loop.run(4.0)
    assert any(output.text.startswith('conservative_reset') for output in loop.outputs)


def rotating(room):
    loop = blocked(room, planner_patience=0.5, controller_patience=0.5)
    while not loop.step().text.startswith('rotate_recovery'):
        assert loop.period < 1000
    return loop


def test_a_goal_sent_during_a_recovery_turn_is_driven_to(room):
    loop = rotating(room)
    loop.run(1.0)
    loop.navigator.set_goal(Pose2D(-2.0, 0.5, 1.0))
    assert loop.step().phase is inputs.Phase.CONTROLLING
    assert loop.run(30.0).status is GoalStatus.SUCCEEDED
    assert not loop.touched


def freeze(loop):
    """From now on odometry sends what it sent last, at a stand; returns what mends it."""
    read, frozen = loop.robot.odometry, (loop.robot.odometry()[0], 0.0, 0.0)
    loop.robot.odometry = lambda: frozen
    return lambda: setattr(loop.robot, 'odometry', read)


def test_frozen_odometry_ends_the_goal_and_the_next_one_works(room):
    loop = under_way(room, 3.0, ppr=90)
    mend, frozen_at = freeze(loop), loop.robot.pose
    output = loop.run(20.0)  # by a twist of zero it commands little
    assert (output.status, output.command) == (GoalStatus.ABORTED, STOP)
    assert output.text == 'odometry has not moved for 0.30 m of commanded travel (max_unseen_travel)'
    assert 0.2 < loop.robot.pose.x_m - frozen_at.x_m < 0.45  # with what it rolls on
    mend()
    loop.navigator.set_goal(AHEAD)
    assert loop.run(30.0).status is GoalStatus.SUCCEEDED


def test_neither_new_goals_nor_a_recovery_turn_hide_frozen_odometry(room):
    loop = ClosedLoop(*room, Pose2D(-2.0, 0.0, 0.0))
    freeze(loop)
    for _ in range(100):
        loop.navigator.set_goal(AHEAD)
        if loop.run(0.5).status is GoalStatus.ABORTED:
            break
    assert loop.navigator.status is GoalStatus.ABORTED and loop.robot.pose.x_m < -1.6
    turning = rotating(room)
    freeze(turning)
    assert turning.run(5.0).status is GoalStatus.ABORTED
