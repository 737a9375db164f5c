"""A test's route: turns in place on a robot that lags, stages by made-up pose estimates, robots that do not fit."""

import logging
import math
from collections import deque

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.drives.test_definition import SpeedLimits, TestDefinition
from diff_encoder_sim.drives.trial_definition import RouteFailed
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.navigator_inputs import GoalStatus
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.simulation.simulator import DriveParams
from diff_encoder_sim.trials.route_driver import POSE_TIMEOUT_S, STOP_WITHIN_RAD, RouteDriver, TurnInPlace, misfit

PERIOD_S, PERIOD_NS = 0.05, 50_000_000
ACTIVE, SUCCEEDED = GoalStatus.ACTIVE, GoalStatus.SUCCEEDED
DELAY_PERIODS, LAG_S, MOST_PERIODS = 3, 0.1, 2000
FULL_TURN_RAD = 2.0 * math.pi


def turn(angle_rad, yaw_rad=0.0, estimate=lambda turned_rad, yaw_rad: yaw_rad, limits=SpeedLimits()):
    """The angle that a robot has turned when it rests, whether the turn is over, and the commands.

    It obeys a rate after a delay and by a first-order lag; `estimate` is of its turned angle and true heading.
    """
    task, commands, turned_rad, rate_radps = TurnInPlace(angle_rad, limits), [], 0.0, 0.0
    on_their_way, fraction, resting = deque([0.0] * DELAY_PERIODS), math.exp(-PERIOD_S / LAG_S), 0
    while resting < 40:
        if task.is_over or len(commands) >= MOST_PERIODS:
            resting += 1
        else:
            heading_rad = estimate(turned_rad, wrap_angle(yaw_rad + turned_rad))
            commands.append(task.rate(len(commands) * PERIOD_NS, heading_rad))
        on_their_way.append(0.0 if resting else commands[-1])
        wanted = on_their_way.popleft()
        # The lag's closed form over a period with one command.
        turned_rad += wanted * PERIOD_S + (rate_radps - wanted) * LAG_S * (1.0 - fraction)
        rate_radps = wanted + (rate_radps - wanted) * fraction
    return turned_rad, task.is_over, np.array(commands)


@pytest.mark.parametrize('turns', [5.0, -5.0, 0.25, -1.0])
@pytest.mark.parametrize('acceleration', [0.5, 4.9])
@pytest.mark.parametrize('start_yaw_rad', [0.0, math.pi - 1e-9, -math.pi])
def test_a_turn_ends_within_tolerance_of_the_whole_angle_and_keeps_the_limits(turns, acceleration, start_yaw_rad):
    limits = SpeedLimits(angular_acceleration=acceleration)
    turned_rad, is_over, commands = turn(FULL_TURN_RAD * turns, start_yaw_rad, limits=limits)
    assert is_over
    assert turned_rad == pytest.approx(FULL_TURN_RAD * turns, abs=STOP_WITHIN_RAD)
    commands = math.copysign(1.0, turns) * commands
    assert commands[0] == commands[-1] == min(commands) == 0.0
    assert commands.max() == limits.angular_speed or abs(turns) < 1.0
    assert np.abs(np.diff(commands[:-1])).max() <= acceleration * PERIOD_S + 1e-12  # the last command is the stop


def test_a_noisy_estimate_about_half_a_turn_loses_no_turn():
    """The wrap is within the noise: each crossing of +-pi must count as a small step."""
    rng = np.random.default_rng(5)
    noisy = lambda _, yaw_rad: wrap_angle(yaw_rad + rng.normal(0.0, 0.01))  # noqa: E731
    turned_rad, is_over, _ = turn(5.0 * FULL_TURN_RAD, math.pi, noisy)
    assert is_over
    assert turned_rad == pytest.approx(5.0 * FULL_TURN_RAD, abs=STOP_WITHIN_RAD + 0.04)


@pytest.mark.parametrize('turns', [5.0, -5.0])
@pytest.mark.parametrize('step_rad', [0.056, 0.079])
def test_an_estimate_too_coarse_to_stop_by_ends_within_one_of_its_steps(turns, step_rad):
    """An encoder of 28 or 20 PPR: no heading that it can report is within STOP_WITHIN_RAD of the whole angle."""

    def estimate(turned_rad, _):
        return wrap_angle(step_rad * (math.floor((turned_rad - turns * FULL_TURN_RAD) / step_rad) + 0.5))

    turned_rad, is_over, _ = turn(FULL_TURN_RAD * turns, estimate=estimate)
    assert is_over
    assert turned_rad == pytest.approx(FULL_TURN_RAD * turns, abs=step_rad)


def test_after_an_estimate_that_jumps_past_the_end_the_robot_turns_back():
    """Localization corrects itself: once is no sign of coarseness."""
    corrections = [0.0]

    def estimate(turned_rad, yaw_rad):
        if turned_rad > math.pi - 0.1:
            corrections[0] = 0.3
        return wrap_angle(yaw_rad + corrections[0])

    turned_rad, is_over, _ = turn(math.pi, estimate=estimate)
    assert is_over
    assert turned_rad == pytest.approx(math.pi - 0.3, abs=2 * STOP_WITHIN_RAD)


class Clock:
    """Steps a driver at 20 Hz."""

    def __init__(self, route, **changes):
        definition = {'name': 'T', 'world': 'w', 'route': route, **changes}
        self.driven, self.now_ns = RouteDriver(TestDefinition.from_mapping(definition, '')), 0

    def step(self, x_m, y_m, yaw_rad=0.0, status=ACTIVE, text=''):
        self.now_ns += PERIOD_NS
        return self.driven.step(self.now_ns, Pose2D(x_m, y_m, yaw_rad), status, text)


def test_waypoints_are_left_when_near_and_the_goal_when_reached():
    route = [{'through': [{'x': 1.0, 'y': 0.0}, {'x': 1.0, 'y': 2.0}]}, {'goal': {'x': 3.0, 'y': 2.0, 'yaw': 0.5}}]
    clock = Clock(route, pass_radius=0.3)
    # A waypoint's heading is towards the next one; that of the last one is 0.
    assert clock.step(0, 0, status=GoalStatus.NONE).goal_in_map == pytest.approx((1, 0, math.pi / 2))
    assert clock.step(0.69, 0).goal_in_map is None
    assert clock.step(0.71, 0).goal_in_map[:2] == (1, 2)
    assert clock.step(1.0, 1.5).goal_in_map is None
    assert clock.step(1.0, 1.65, status=SUCCEEDED).goal_in_map == (3, 2, 0.5)  # where the navigator stops is passed
    assert clock.step(2.99, 2.0).goal_in_map is None  # near is not enough for a goal
    for _ in range(20):
        assert clock.step(2.99, 2.0, status=SUCCEEDED).goal_in_map is None
        assert not clock.driven.is_over  # a second at rest
    clock.step(2.99, 2.0, status=SUCCEEDED)
    assert clock.driven.is_over


def test_turns_are_counted_by_the_pose_estimate_and_then_the_goal_is_sent():
    clock = Clock([{'turns': 2}, {'goal': {'yaw': 0.0}}])
    yaw_rad, turned_rad, outputs = 0.0, 0.0, []
    while not outputs or outputs[-1].goal_in_map is None:
        outputs.append(clock.step(0, 0, yaw_rad, GoalStatus.NONE))
        turned_rad += 0.05 * outputs[-1].turn_rate_radps
        yaw_rad = wrap_angle(turned_rad)
        assert len(outputs) < 400
    assert turned_rad == pytest.approx(2.0 * FULL_TURN_RAD, abs=0.05)
    assert outputs[-1].turn_rate_radps == 0.0  # no other node would stop the robot
    assert clock.step(0, 0, yaw_rad).turn_rate_radps is None
    assert clock.driven.watch(clock.now_ns + 10**10).turn_rate_radps is None  # the navigator watches over its inputs


@pytest.mark.parametrize('status', [GoalStatus.ABORTED, GoalStatus.PREEMPTED])
def test_a_goal_given_up_fails_the_route_with_the_reason(status):
    clock = Clock([{'through': [{'x': 1.0, 'y': -2.0}]}, {'goal': {'x': 2.0}}])
    clock.step(0, 0)
    with pytest.raises(RouteFailed, match=r'waypoint \(1.00, -2.00\) was not reached: no way'):
        clock.step(0, 0, status=status, text='no way')


def test_a_turn_stops_without_pose_estimates_and_continues_from_rest(caplog):
    """The navigator watches over its inputs only while it has a goal."""
    caplog.set_level(logging.INFO)
    clock = Clock([{'turns': 2}, {'goal': {'yaw': 0.0}}])
    rates = [clock.step(0, 0, 0.01 * index).turn_rate_radps for index in range(20)]
    assert rates[-1] == 1.0
    watched = {index: clock.driven.watch(clock.now_ns + index * PERIOD_NS).turn_rate_radps for index in range(30)}
    fresh = round(POSE_TIMEOUT_S * 1e9) // PERIOD_NS
    assert watched == {index: None if index <= fresh else 0.0 for index in range(30)}
    clock.now_ns += 30 * PERIOD_NS
    again = [clock.step(0, 0, 0.2).turn_rate_radps for _ in range(3)]
    assert again == pytest.approx([0.0, 4.9 * 0.05, 2 * 4.9 * 0.05])
    assert clock.driven.watch(clock.now_ns).turn_rate_radps is None
    assert len(caplog.records) == 2  # one when it pauses, one when it continues


PATH = {'goal': {'x': 6.0, 'y': 2.0, 'yaw': 0.0}}
# 8 m x 4 m, and a wall across at x = 4 m with a gap of 1.5 m around y = 2 m.
ROOM = OccupancyGrid(np.zeros((80, 160), np.int8), 0.05, Pose2D(0.0, 0.0, 0.0))
ROOM.cells[:, 80] = ROOM.cells[[0, -1], :] = 100
ROOM.cells[25:55, 80] = 0
ROOM.cells[:, [0, -1]] = 100


def unfit(size_m=(0.5, 0.6), drive=None, ahead_m=0.5, **test):
    length_m, side = size_m[0], 0.5 * size_m[1]
    front_m = ahead_m * length_m
    outline = [[front_m, -side], [front_m, side], [front_m - length_m, side], [front_m - length_m, -side]]
    costmaps = {name: {'footprint': outline} for name in ('global_costmap', 'local_costmap')}
    costmaps['local_costmap'].update(static_map=False, rolling_window=True, global_frame='odom')
    asked = {'name': 'T', 'world': 'w', 'start': {'x': 2.0, 'y': 2.0, 'yaw': 0.0}, 'route': [PATH], **test}
    navigator = NavigatorParams.from_mapping(costmaps, '')
    return misfit(TestDefinition.from_mapping(asked, ''), navigator, DriveParams.from_mapping(drive or {}, ''), ROOM)


def test_a_robot_that_does_not_fit_through_a_door_or_cannot_turn_is_refused():
    assert unfit(size_m=(0.5, 1.8)).startswith('test T: not for this robot: ')
    assert unfit(size_m=(0.5, 1.2)) is None
    # The circle inside an outline whose origin is near the front would pass; its sides do not.
    assert 'touches a wall' in unfit(size_m=(0.5, 1.8), ahead_m=0.1)
    place = {'x': 2.0, 'y': 0.7, 'yaw': 0.0}
    turn_there = [{'turns': 1}, {'goal': place}]
    assert unfit(size_m=(1.4, 0.5), start=place, route=turn_there) is not None
    assert unfit(size_m=(0.6, 0.5), start=place, route=turn_there) is None


def test_a_robot_that_cannot_be_there_in_time_is_refused():
    assert unfit(drive={'max_linear_speed': 0.5}, time_limit=60.0) is None
    answer = unfit(drive={'max_linear_speed': 0.01}, time_limit=60.0)
    assert 'at least 4' in answer and 'at 0.01 m/s; time_limit is 60 s' in answer
    assert 'time_limit' in unfit(route=[{'turns': 10}, PATH], drive={'max_angular_speed': 0.1}, time_limit=600.0)
