"""Odometry that does not move, and goals that are given up for it."""

import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.navigation.navigator_inputs import STOP, Command, GoalStatus
from diff_encoder_sim.navigation.recovery import TravelWatch
from navigation_simulation import ClosedLoop, navigator_params

AHEAD = Pose2D(2.0, 0.0, 0.0)


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


def test_without_a_limit_travel_is_never_over_it():
    watch = TravelWatch(0.0, 0.25)
    for now_ns in range(0, 10**12, 10**11):
        watch.update(now_ns, IDENTITY, Command(1.0, 0.0))
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
