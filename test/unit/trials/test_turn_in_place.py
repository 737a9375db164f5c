"""Turning in place by an estimate: it ends where it should, on a robot that lags behind commands."""

import math
from collections import deque

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import wrap_angle
from diff_encoder_sim.drives.test_definition import SpeedLimits
from diff_encoder_sim.trials.route_driver import STOP_WITHIN_RAD, TurnInPlace

LIMITS = SpeedLimits()

PERIOD_S, PERIOD_NS = 0.05, 50_000_000

DELAY_PERIODS, LAG_S = 3, 0.1

MOST_PERIODS = 2000


class LaggingRobot:
    """Obeys a rate after a delay and by a first-order lag."""

    def __init__(self, yaw_rad=0.0):
        self.yaw_rad, self.turned_rad, self.rate_radps = yaw_rad, 0.0, 0.0
        self._on_their_way = deque([0.0] * DELAY_PERIODS)

    def step(self, command_radps):
        self._on_their_way.append(command_radps)
        wanted = self._on_their_way.popleft()
        # The lag's closed form over a period in which the command stands.
        fraction = math.exp(-PERIOD_S / LAG_S)
        step_rad = wanted * PERIOD_S + (self.rate_radps - wanted) * LAG_S * (1.0 - fraction)
        self.rate_radps = wanted + (self.rate_radps - wanted) * fraction
        self.turned_rad += step_rad
        self.yaw_rad = wrap_angle(self.yaw_rad + step_rad)


def turn(angle_rad, start_yaw_rad=0.0, estimate=lambda robot: robot.yaw_rad, limits=LIMITS):
    """The robot after it has come to rest, the turn, and what was commanded."""
    robot, task, commands = LaggingRobot(start_yaw_rad), TurnInPlace(angle_rad, limits), []
    while not task.is_over and len(commands) < MOST_PERIODS:
        commands.append(task.rate(len(commands) * PERIOD_NS, estimate(robot)))
        robot.step(commands[-1])
    for _ in range(40):
        robot.step(0.0)
    return robot, task, np.array(commands)


@pytest.mark.parametrize('turns', [5.0, -5.0, 0.25, -1.0])
@pytest.mark.parametrize('start_yaw_rad', [0.0, math.pi - 1e-9, -math.pi, 3.0])
def test_it_ends_within_tolerance_of_the_whole_angle(turns, start_yaw_rad):
    robot, task, _ = turn(2.0 * math.pi * turns, start_yaw_rad)
    assert task.is_over
    assert robot.turned_rad == pytest.approx(2.0 * math.pi * turns, abs=STOP_WITHIN_RAD)


@pytest.mark.parametrize('acceleration', [0.5, 4.9])
def test_it_hardly_overshoots(acceleration):
    """Not on the way either: what is turned too far would have to be turned back."""
    limits = SpeedLimits(angular_acceleration=acceleration)
    robot, _, commands = turn(10.0 * math.pi, limits=limits)
    assert robot.turned_rad - 10.0 * math.pi < STOP_WITHIN_RAD
    assert min(commands) == 0.0


def test_rates_keep_both_limits():
    _, _, commands = turn(10.0 * math.pi)
    assert commands[0] == 0.0
    assert np.abs(commands).max() == LIMITS.angular_speed
    steps = np.abs(np.diff(commands[:-1]))  # the last command is the stop
    assert steps.max() <= LIMITS.angular_acceleration * PERIOD_S + 1e-12
    assert commands[-1] == 0.0


def test_a_noisy_estimate_about_half_a_turn_loses_no_turn():
    """The wrap falls on the noise: each crossing of +-pi must count as the small step that it is."""
    rng = np.random.default_rng(5)
    robot, task, _ = turn(10.0 * math.pi, math.pi, lambda robot: wrap_angle(robot.yaw_rad + rng.normal(0.0, 0.01)))
    assert task.is_over
    assert robot.turned_rad == pytest.approx(10.0 * math.pi, abs=STOP_WITHIN_RAD + 0.04)


def test_nothing_to_turn_is_over_at_once():
    task = TurnInPlace(0.5 * STOP_WITHIN_RAD, LIMITS)
    assert task.rate(0, 1.0) == 0.0
    assert task.is_over


def test_an_estimate_that_stands_still_is_never_taken_for_a_turn():
    _, task, commands = turn(2.0 * math.pi, estimate=lambda robot: 0.3)
    assert not task.is_over
    assert np.abs(commands).max() == LIMITS.angular_speed


@pytest.mark.parametrize('turns', [5.0, -5.0])
@pytest.mark.parametrize('step_rad', [0.056, 0.079])
def test_an_estimate_too_coarse_to_stop_by_ends_within_one_of_its_steps(turns, step_rad):
    """An encoder of 28 or 20 PPR: no heading that it can tell is within STOP_WITHIN_RAD of the whole angle."""

    def estimate(robot):
        return wrap_angle(step_rad * (math.floor((robot.turned_rad - turns * 2.0 * math.pi) / step_rad) + 0.5))

    robot, task, _ = turn(2.0 * math.pi * turns, estimate=estimate)
    assert task.is_over
    assert robot.turned_rad == pytest.approx(2.0 * math.pi * turns, abs=step_rad)


def test_an_estimate_that_jumps_past_the_end_is_turned_back_to():
    """Localization corrects itself: once is no sign of coarseness."""
    corrections = [0.0]

    def estimate(robot):
        if robot.turned_rad > math.pi - 0.1:
            corrections[0] = 0.3
        return wrap_angle(robot.yaw_rad + corrections[0])

    robot, task, _ = turn(math.pi, estimate=estimate)
    assert task.is_over
    assert robot.turned_rad == pytest.approx(math.pi - 0.3, abs=2 * STOP_WITHIN_RAD)
