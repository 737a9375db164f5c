"""Goals that are given up, that wait for an input and that follow each other."""

import logging
import math

import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.navigation.navigator_inputs import STOP, GoalStatus, MissingInput, Phase
from navigation_simulation import ClosedLoop, navigator_params

AHEAD = Pose2D(2.0, 0.0, 0.0)


def test_a_goal_in_a_wall_is_given_up_at_once_with_the_reason(room):
    loop = ClosedLoop(*room, IDENTITY)
    loop.navigator.set_goal(Pose2D(3.1, 0.0, 0.0))
    output = loop.run(1.0)
    assert output.status is GoalStatus.ABORTED and loop.period == 1
    assert output.text == 'the goal (3.10, 0.00) is in a wall of the map'
    assert output.command == STOP


@pytest.mark.parametrize(
    ('goal', 'text'), [(Pose2D(math.nan, 0.0, 0.0), 'not finite'), (Pose2D(50.0, 0.0, 0.0), 'outside the map')]
)
def test_impossible_goals_are_given_up_at_once(room, goal, text):
    loop = ClosedLoop(*room, IDENTITY)
    loop.navigator.set_goal(goal)
    output = loop.run(1.0)
    assert output.status is GoalStatus.ABORTED and text in output.text


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


def test_without_recoveries_it_ends_sooner(room):
    shapes, grid = room
    loop = ClosedLoop(
        shapes.with_box(1.0, 0.0, 0.1, 4.0),
        grid,
        Pose2D(-1.0, 0.0, 0.0),
        params=navigator_params(recovery_behavior_enabled=False, **PATIENCE),
    )
    loop.navigator.set_goal(Pose2D(2.0, 0.0, 0.0))
    output = loop.run(20.0)
    assert output.status is GoalStatus.ABORTED
    assert output.text == 'no plan was found: there is no path to the goal (2.00, 0.00)'


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
