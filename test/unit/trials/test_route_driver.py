"""A test's route, driven by pose estimates that the test makes up."""

import logging
import math

import pytest

from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.drives.trial_definition import Outcome, RouteFailed
from diff_encoder_sim.navigation.navigator_inputs import GoalStatus
from diff_encoder_sim.trials.route_driver import POSE_TIMEOUT_S, RouteDriver

PERIOD_NS = 50_000_000
ACTIVE, SUCCEEDED = GoalStatus.ACTIVE, GoalStatus.SUCCEEDED


def driver(route, **changes):
    return RouteDriver(TestDefinition.from_mapping({'name': 'T', 'world': 'w', 'route': route, **changes}, ''))


class Clock:
    """Steps a driver at 20 Hz."""

    def __init__(self, driven):
        self.driven, self.now_ns = driven, 0

    def step(self, x_m, y_m, yaw_rad=0.0, status=ACTIVE, text=''):
        self.now_ns += PERIOD_NS
        return self.driven.step(self.now_ns, Pose2D(x_m, y_m, yaw_rad), status, text)


def test_waypoints_are_left_when_near_and_the_goal_when_reached():
    route = [{'through': [{'x': 1.0, 'y': 0.0}, {'x': 1.0, 'y': 2.0}]}, {'goal': {'x': 3.0, 'y': 2.0, 'yaw': 0.5}}]
    clock = Clock(driver(route, pass_radius=0.3))
    # A waypoint's heading is towards the next one; that of the last one is 0.
    assert clock.step(0, 0, status=GoalStatus.NONE).goal_in_map == pytest.approx((1, 0, math.pi / 2))
    assert clock.step(0.69, 0).goal_in_map is None
    assert clock.step(0.71, 0).goal_in_map[:2] == (1, 2)
    assert clock.step(1.0, 1.5).goal_in_map is None
    assert clock.step(1.0, 1.75).goal_in_map == (3, 2, 0.5)
    assert clock.step(2.99, 2.0).goal_in_map is None  # near is not enough of a goal
    assert clock.step(2.99, 2.0, status=SUCCEEDED).goal_in_map is None
    for _ in range(19):
        clock.step(2.99, 2.0, status=SUCCEEDED)
        assert not clock.driven.is_over  # a second at rest
    clock.step(2.99, 2.0, status=SUCCEEDED)
    assert clock.driven.is_over


def test_a_waypoint_that_the_navigator_stops_at_counts_as_passed():
    clock = Clock(driver([{'through': [{'x': 1.0, 'y': 0.0}]}, {'goal': {'x': 2.0}}], pass_radius=0.01))
    clock.step(0, 0)
    assert clock.step(0.96, 0, status=SUCCEEDED).goal_in_map == (2, 0, 0)


def test_turns_are_counted_by_the_pose_estimate_and_then_the_goal_is_sent():
    clock = Clock(driver([{'turns': 2}, {'goal': {'yaw': 0.0}}]))
    yaw_rad, turned_rad, outputs = 0.0, 0.0, []
    while not outputs or outputs[-1].goal_in_map is None:
        outputs.append(clock.step(0, 0, yaw_rad, GoalStatus.NONE))
        turned_rad += 0.05 * outputs[-1].turn_rate_radps
        yaw_rad = wrap_angle(turned_rad)
        assert len(outputs) < 400
    assert turned_rad == pytest.approx(4.0 * math.pi, abs=0.05)
    assert outputs[-1].turn_rate_radps == 0.0  # nobody else would stop the robot
    assert clock.step(0, 0, yaw_rad).turn_rate_radps is None


@pytest.mark.parametrize('status', [GoalStatus.ABORTED, GoalStatus.PREEMPTED])
def test_a_goal_given_up_fails_the_route_and_says_why(status):
    clock = Clock(driver([{'through': [{'x': 1.0, 'y': -2.0}]}, {'goal': {'x': 2.0}}]))
    clock.step(0, 0)
    with pytest.raises(RouteFailed, match=r'waypoint \(1.00, -2.00\) was not reached: no way'):
        clock.step(0, 0, status=status, text='no way')


def test_a_route_has_a_time_limit_whether_the_robot_knows_where_it_is_or_not():
    driven = driver([{'goal': {'x': 2.0}}], time_limit=1.0)
    for index in range(21):
        driven.watch(7 * PERIOD_NS + index * PERIOD_NS)
    with pytest.raises(RouteFailed, match=r'after 1 s \(time_limit\)') as failure:
        driven.watch(7 * PERIOD_NS + 21 * PERIOD_NS)
    assert failure.value.ending.outcome is Outcome.TIMED_OUT


def test_a_robot_that_turns_stops_while_no_pose_estimate_comes_and_continues_from_rest(caplog):
    """The navigator watches over its inputs only while it has a goal."""
    caplog.set_level(logging.INFO)
    clock = Clock(driver([{'turns': 2}, {'goal': {'yaw': 0.0}}]))
    rates = [clock.step(0, 0, 0.01 * index).turn_rate_radps for index in range(20)]
    assert rates[-1] == 1.0
    watched = {index: clock.driven.watch(clock.now_ns + index * PERIOD_NS).turn_rate_radps for index in range(30)}
    fresh = round(POSE_TIMEOUT_S * 1e9) // PERIOD_NS
    assert watched == {index: None if index <= fresh else 0.0 for index in range(30)}
    clock.now_ns += 30 * PERIOD_NS
    again = [clock.step(0, 0, 0.2).turn_rate_radps for _ in range(3)]
    assert again == pytest.approx([0.0, 4.9 * 0.05, 2 * 4.9 * 0.05])
    assert clock.driven.watch(clock.now_ns).turn_rate_radps is None
    assert [record.getMessage() for record in caplog.records] == [
        'turn in place paused: the newest pose estimate is 0.6 s old',
        'turn in place continues: pose estimates are received again',
    ]


def test_of_a_robot_that_drives_to_a_goal_the_navigator_takes_care():
    clock = Clock(driver([{'turns': 1}, {'goal': {'x': 2.0}}]))
    yaw_rad = 0.0
    while clock.step(0, 0, wrap_angle(yaw_rad)).goal_in_map is None:
        yaw_rad += 0.05
    assert clock.driven.watch(clock.now_ns + 10**10).turn_rate_radps is None
