"""A test's route, driven by beliefs that the test makes up."""
import math

import pytest

from diff_encoder_sim.experiments.definition import TestDefinition
from diff_encoder_sim.experiments.outcome import Outcome, RouteFailed
from diff_encoder_sim.experiments.route_driver import RouteDriver
from diff_encoder_sim.navigation.outcome import GoalStatus
from diff_encoder_sim.se2 import Pose2D, wrap_angle

PERIOD_NS = 50_000_000
ACTIVE, SUCCEEDED = GoalStatus.ACTIVE, GoalStatus.SUCCEEDED


def driver(route, **changes):
    return RouteDriver(TestDefinition.from_mapping(
        {'name': 'T', 'world': 'w', 'route': route, **changes}, ''))


class Clock:
    """Steps a driver at 20 Hz."""

    def __init__(self, driven):
        self.driven, self.now_ns = driven, 0

    def step(self, x_m, y_m, yaw_rad=0.0, status=ACTIVE, text=''):
        self.now_ns += PERIOD_NS
        return self.driven.step(self.now_ns, Pose2D(x_m, y_m, yaw_rad), status, text)


def test_waypoints_are_left_when_near_and_the_goal_when_reached():
    route = [{'through': [{'x': 1.0, 'y': 0.0}, {'x': 1.0, 'y': 2.0}]},
             {'goal': {'x': 3.0, 'y': 2.0, 'yaw': 0.5}}]
    clock = Clock(driver(route, pass_radius=0.3))
    # A waypoint's heading is towards the next one; the last one keeps that of the way to it.
    assert clock.step(0, 0, status=GoalStatus.NONE).goal_in_map == pytest.approx((1, 0, math.pi / 2))
    assert clock.step(0.69, 0).goal_in_map is None
    assert clock.step(0.71, 0).goal_in_map[:2] == (1, 2)
    assert clock.step(1.0, 1.5).goal_in_map is None
    assert clock.step(1.0, 1.75).goal_in_map == (3, 2, 0.5)
    assert clock.step(2.99, 2.0).goal_in_map is None       # near is not enough of a goal
    assert clock.step(2.99, 2.0, status=SUCCEEDED).goal_in_map is None
    for _ in range(19):
        clock.step(2.99, 2.0, status=SUCCEEDED)
        assert not clock.driven.is_over                    # a second at rest
    clock.step(2.99, 2.0, status=SUCCEEDED)
    assert clock.driven.is_over


def test_a_waypoint_that_the_navigator_stops_at_counts_as_passed():
    clock = Clock(driver([{'through': [{'x': 1.0, 'y': 0.0}]}, {'goal': {'x': 2.0}}],
                         pass_radius=0.01))
    clock.step(0, 0)
    assert clock.step(0.96, 0, status=SUCCEEDED).goal_in_map == (2, 0, 0)


def test_turns_are_counted_by_the_belief_and_then_the_goal_is_sent():
    clock = Clock(driver([{'turns': 2}, {'goal': {'yaw': 0.0}}]))
    yaw_rad, turned_rad, outputs = 0.0, 0.0, []
    while not outputs or outputs[-1].goal_in_map is None:
        outputs.append(clock.step(0, 0, yaw_rad, GoalStatus.NONE))
        turned_rad += 0.05 * outputs[-1].turn_rate_radps
        yaw_rad = wrap_angle(turned_rad)
        assert len(outputs) < 400
    assert turned_rad == pytest.approx(4.0 * math.pi, abs=0.05)
    assert outputs[-1].turn_rate_radps == 0.0              # nobody else would stop the robot
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
