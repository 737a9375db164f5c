"""What stops the robot: inputs that say nothing, odometry that does not see it move; and that a new goal works then."""

import logging
import math
import subprocess
import sys

import numpy as np
import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.navigation.goal_status import STOP, Command, GoalStatus, Phase
from diff_encoder_sim.navigation.navigator_inputs import MOST_AHEAD_S, MissingInput, NavigatorInputs
from diff_encoder_sim.navigation.plan_error import PlanError
from diff_encoder_sim.navigation.travel_watch import TravelWatch
from navigation_simulation import ClosedLoop, navigator_params, walled_room
from places import SOURCE, SUPPORT

PERIOD_NS = 50_000_000
AHEAD = Pose2D(2.0, 0.0, 0.0)


@pytest.fixture(name='room', scope='module')
def fixture_room():
    return walled_room()


def freeze(loop):
    """From now on odometry sends what it sent last, at a stand; returns what mends it."""
    read, frozen = loop.robot.odometry, (loop.robot.odometry()[0], 0.0, 0.0)
    loop.robot.odometry = lambda: frozen
    return lambda: setattr(loop.robot, 'odometry', read)


# ---- travel that odometry does not see


def test_travel_sums_up_while_the_pose_stays():
    watch = TravelWatch(0.3, turning_radius_m=0.25)
    watch.enter(0, IDENTITY, Command(0.4, 1.0))
    assert watch.unseen_m == 0.0
    watch.enter(500_000_000, IDENTITY, Command(0.4, -0.4))
    assert watch.unseen_m == pytest.approx(0.25) and not watch.is_over_limit
    watch.enter(600_000_000, IDENTITY, Command(-0.4, 0.4))
    assert watch.unseen_m == pytest.approx(0.3)
    watch.enter(650_000_000, IDENTITY, Command(0.4, 0.0))
    assert watch.is_over_limit
    watch.enter(700_000_000, Pose2D(0.0, 0.0, 1e-6), Command(0.4, 0.0))
    assert watch.unseen_m == 0.0 and not watch.is_over_limit


def test_without_a_limit_travel_is_never_over_it():
    watch = TravelWatch(0.0, 0.25)
    for now_ns in range(0, 10**12, 10**11):
        watch.enter(now_ns, IDENTITY, Command(1.0, 0.0))
    assert watch.unseen_m > 100.0 and not watch.is_over_limit


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


@pytest.mark.parametrize('goal', [AHEAD, Pose2D(-2.0, 0.0, 3.0)], ids=['straight', 'turn'])
def test_few_pulses_are_far_from_the_limit(room, goal):
    """40 pulses: 16 mm each."""
    loop = ClosedLoop(*room, Pose2D(-2.0, 0.0, 0.0), ppr=40, params=navigator_params({'twist_sigmas': 3.47}))
    watch, highest_m = loop.navigator._parts.travel_watch, 0.0
    loop.navigator.set_goal(goal)
    while not loop.step().status.is_over and loop.period < 600:
        highest_m = max(highest_m, watch.unseen_m)
    assert loop.navigator.status is GoalStatus.SUCCEEDED
    assert 0.0 < highest_m < 0.1


# ---- scans


def scan_of(*ranges_m):
    return Scan(0, 0.0, 0.1, 0.15, 6.0, np.array(ranges_m))


@pytest.mark.parametrize('ranges', [(math.nan, math.nan), (0.0, 0.14), (6.1, 7.0), (-math.inf,)])
def test_a_scan_that_tells_nothing_is_not_fresh(ranges):
    inputs = NavigatorInputs(IDENTITY)
    with pytest.raises(InputFault, match=f'none of {len(ranges)} ranges is valid: from 0.15 to 6 m'):
        inputs.take_scan(scan_of(*ranges))
    assert inputs.scan is None


@pytest.mark.parametrize('ranges', [(math.inf, math.inf), (math.nan, 0.15), (6.0, 0.0)])
def test_one_valid_range_will_do(ranges):
    inputs = NavigatorInputs(IDENTITY)
    inputs.take_scan(scan_of(*ranges))
    assert inputs.scan is not None


def test_each_scan_counts_from_its_own_laser():
    front, back = Pose2D(0.2, 0.0, 0.0), Pose2D(-0.2, 0.0, 3.0)
    inputs = NavigatorInputs(front)
    inputs.take_odometry(0, IDENTITY, 0.0, 0.0)
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
    inputs.take_odometry(0, IDENTITY, 0.0, 0.0)
    inputs.take_scan(scan_of(1.0))
    inputs.take_localization(round((MOST_AHEAD_S + 0.5) * 1e9), IDENTITY)
    assert str(inputs.missing(0, 0.5)) == 'localization (map->odom) is dated 2.5 s ahead'


# ---- waiting


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
        'scan is 0.6 s old (input_timeout 0.5 s); stopped',
        'scan is back: planning anew',
    ]


def test_the_user_may_say_what_is_missing(room):
    loop = ClosedLoop(*room, Pose2D(-2.0, 0.0, 0.0))
    loop.navigator.set_goal(AHEAD)
    loop.run(2.0)
    output = loop.navigator.wait(MissingInput('/odom', 'is silent'))
    assert (output.command, output.status) == (STOP, GoalStatus.ACTIVE)
    assert output.text == 'stopped: /odom is silent'
    assert loop.run(30.0).status is GoalStatus.SUCCEEDED


# ---- goals after goals


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


def test_make_plan_needs_a_pose_and_finite_numbers(room):
    loop = ClosedLoop(*room, IDENTITY)
    with pytest.raises(InputFault, match='where the robot is'):
        loop.navigator.make_plan(None, AHEAD)
    with pytest.raises(PlanError, match='tolerance nan'):
        loop.navigator.make_plan(IDENTITY, AHEAD, math.nan)
    assert len(loop.navigator.make_plan(IDENTITY, AHEAD)) > 2


# ---- compiling ahead

DRIVE_AFTER_WARM_UP = """
import importlib, pkgutil
import diff_encoder_sim.navigation as navigation
from diff_encoder_sim.navigation.navigation_warm_up import warm_up
from diff_encoder_sim.base.se2 import Pose2D
from numba.core.dispatcher import Dispatcher
import navigation_simulation as simulation

def compiled():
    return {f'{module.name}.{name}': len(value.signatures)
            for module in pkgutil.iter_modules(navigation.__path__, navigation.__name__ + '.')
            for name, value in vars(importlib.import_module(module.name)).items() if isinstance(value, Dispatcher)}

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
