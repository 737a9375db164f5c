"""The precise stop of a unicycle whose commands arrive late, with poses as exact or as coarse as an encoder's."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, move_along_arc, wrap_angle
from diff_encoder_sim.navigation.goal_stopping import NEAR, SET_OUT, LatchedStopRotate, Motion, PreciseStop
from navigation_scenes import dwa_params

TOLERANCE_M, YAW_TOLERANCE_RAD = 0.05, 0.052
TICK_S = 0.01
SEPARATION_M = 0.4


def always(*_):
    return True


class Unicycle:
    """A robot with the acceleration limits of ALTO's motors; `pulse_m` is what its odometry counts in."""

    def __init__(self, pose, speed_mps=0.0, latency_ticks=2, pulse_m=0.0, phases=(0.0, 0.0)):
        self.pose, self.speeds = pose, np.array([speed_mps, 0.0])
        self._late = [(speed_mps, 0.0)] * latency_ticks
        self._pulse_m, self._phases_m = pulse_m, np.array(phases) * pulse_m
        self._travel_m = np.zeros(2)
        self._counted_m = self._counts_m()
        self.odometry = pose

    def _counts_m(self):
        if self._pulse_m == 0.0:
            return self._travel_m.copy()
        return np.floor((self._travel_m + self._phases_m) / self._pulse_m) * self._pulse_m

    def drive(self, command, period_s):
        for _ in range(round(period_s / TICK_S)):
            self._late.append(command)
            wanted = np.array(self._late.pop(0))
            self.speeds += np.clip(wanted - self.speeds, [-0.015, -0.06], [0.015, 0.06])
            linear, angular = self.speeds * TICK_S
            self.pose = move_along_arc(self.pose, linear, angular)
            self._travel_m += [linear - 0.5 * SEPARATION_M * angular, linear + 0.5 * SEPARATION_M * angular]
        before_m, self._counted_m = self._counted_m, self._counts_m()
        left_m, right_m = self._counted_m - before_m
        self.odometry = move_along_arc(self.odometry, 0.5 * (left_m + right_m), (right_m - left_m) / SEPARATION_M)


def stop_at(goal, robot, period_s=0.05, limit_s=20.0, is_clear=always, **changes):
    """Drive until the goal is reached; returns the time that took, and the commands."""
    stop, command, commands = PreciseStop(dwa_params(**changes), period_s), (robot.speeds[0], 0.0), []
    while True:
        motion = Motion(robot.odometry, *command)
        assert stop.is_position_reached(motion, goal), f'left the tolerance at {robot.odometry}'
        if stop.is_goal_reached(motion, goal):
            robot.drive((0.0, 0.0), 0.5)
            return len(commands) * period_s, commands
        command = stop.command(motion, goal, is_clear)
        commands.append(command)
        assert len(commands) * period_s < limit_s
        robot.drive(command, period_s)


@pytest.mark.parametrize('rate_hz', [5.0, 10.0, 20.0, 50.0])
@pytest.mark.parametrize('latency_ticks', [0, 2, 5])
@pytest.mark.parametrize('speed_mps', [0.0, 0.04, 0.1])
def test_on_a_straight_line_it_ends_at_the_goal(rate_hz, latency_ticks, speed_mps):
    robot = Unicycle(Pose2D(-0.04, 0.0, 0.0), speed_mps, latency_ticks)
    stop_at(IDENTITY, robot, 1.0 / rate_hz)
    assert abs(robot.pose.x_m) < 0.002
    assert robot.pose.y_m == 0.0


def test_it_stops_beside_a_goal_to_the_side():
    """It goes on to the nearest place on its line where the goal is not worth steering to."""
    aside_m = 0.9 * NEAR * TOLERANCE_M
    robot = Unicycle(Pose2D(-0.039, aside_m, 0.0), 0.04)
    stop_at(IDENTITY, robot)
    assert abs(robot.pose.x_m) < 0.003 and robot.pose.y_m == pytest.approx(aside_m)


def test_it_steers_to_a_goal_farther_to_the_side():
    robot = Unicycle(Pose2D(-0.035, 0.02, 0.0), 0.04)
    stop_at(IDENTITY, robot)
    assert math.hypot(*robot.pose[:2]) < 0.006
    assert abs(robot.pose.yaw_rad) < SET_OUT * YAW_TOLERANCE_RAD


def test_a_robot_that_stands_close_enough_does_not_move():
    """After turns in place an estimate is some millimetres off: that is no reason to drive."""
    robot = Unicycle(Pose2D(-0.9 * SET_OUT * TOLERANCE_M, 0.02, 0.9 * SET_OUT * YAW_TOLERANCE_RAD))
    assert set(stop_at(IDENTITY, robot)[1]) == {(0.0, 0.0)}


def test_a_robot_that_came_past_its_goal_turns_to_it():
    stop = PreciseStop(dwa_params(), 0.05)
    for x_m in (-0.06, -0.02):  # it drives into the tolerance
        beside = Motion(Pose2D(x_m, 0.035, 0.0), 0.04, 0.0)
        is_reached = stop.is_position_reached(beside, IDENTITY)
    assert is_reached
    linear_mps, angular_radps = stop.command(beside, IDENTITY, always)
    assert linear_mps < 0.04 and angular_radps < 0.0
    facing = Motion(Pose2D(-0.02, 0.035, -1.0), 0.0, -0.5)
    linear_mps, angular_radps = stop.command(facing, IDENTITY, always)
    assert linear_mps > 0.0 and angular_radps < 0.0


def test_it_never_drives_backwards():
    robot = Unicycle(Pose2D(0.03, -0.02, 0.0))
    assert set(stop_at(IDENTITY, robot)[1]) == {(0.0, 0.0)}


def test_it_stops_where_the_way_is_not_clear_and_leaves_a_turn_that_is_not_needed():
    robot = Unicycle(Pose2D(-0.035, 0.0, 0.8 * YAW_TOLERANCE_RAD))
    assert set(stop_at(IDENTITY, robot, is_clear=lambda *_: False)[1]) == {(0.0, 0.0)}
    stop = PreciseStop(dwa_params(), 0.05)
    assert stop.command(Motion(IDENTITY, 0.0, 0.0), Pose2D(0.0, 0.0, 1.0), lambda *_: False) is None


def test_the_check_of_the_way_ends_at_the_goal():
    """A wall behind the goal is none of its business."""
    params, asked = dwa_params(), []

    def is_clear(linear_mps, angular_radps):
        asked.append(linear_mps * params.sim_time)
        return True

    stop_at(IDENTITY, Unicycle(Pose2D(-0.04, 0.0, 0.0), 0.04), is_clear=is_clear)
    assert max(asked) == pytest.approx(0.04)


@pytest.mark.heavy
@pytest.mark.parametrize('pulses', [40, 90, 1024, 4096])
def test_all_starts_end_close_in_time_and_for_good(pulses):
    """With poses that jump by pulses, at 5 to 20 Hz, and all limits: by the pose, in one turn and without a search."""
    random, pulse_m = np.random.default_rng(pulses), math.pi * 0.2 / pulses
    for _ in range(60):
        bearing, distance_m = random.uniform(-0.5, 0.5), random.uniform(0.005, 0.04)
        start = Pose2D(-distance_m * math.cos(bearing), -distance_m * math.sin(bearing), random.uniform(-0.2, 0.2))
        robot = Unicycle(start, random.uniform(0.0, 0.05), random.integers(0, 6), pulse_m, random.random(2))
        goal, period_s = Pose2D(0.0, 0.0, random.uniform(-3.0, 3.0)), random.choice([0.05, 0.1, 0.2])
        limits = {
            'acc_lim_x': random.uniform(0.3, 2.5),
            'acc_lim_theta': random.uniform(1.0, 6.0),
            'min_vel_theta': random.choice([0.0, 0.1, 0.2]),
        }
        _, commands = stop_at(goal, robot, period_s, 16.0, **limits)
        assert math.hypot(*robot.odometry[:2]) <= TOLERANCE_M / 2
        assert abs(wrap_angle(goal.yaw_rad - robot.odometry.yaw_rad)) <= YAW_TOLERANCE_RAD + pulse_m / SEPARATION_M
        turns = [math.copysign(1.0, angular) for linear, angular in commands if linear == 0.0 and angular != 0.0]
        assert np.count_nonzero(np.diff(turns)) <= 1  # slowing down from steering, then in one direction


def test_a_heading_that_leaves_the_tolerance_is_turned_to_again():
    stop = PreciseStop(dwa_params(), 0.05)
    aligned = Motion(IDENTITY, 0.0, 0.0)
    assert stop.command(aligned, IDENTITY, always) == (0.0, 0.0)
    assert stop.is_position_reached(aligned, IDENTITY) and stop.is_goal_reached(aligned, IDENTITY)
    turned = Pose2D(0.0, 0.0, 0.1)  # localization's next update
    assert not stop.is_goal_reached(aligned, turned)
    assert stop.command(aligned, turned, always)[1] > 0.0


def test_arrival_is_latched_as_the_parameter_says():
    """Localization's next update moves the goal away."""
    here, away = Motion(IDENTITY, 0.0, 0.0), Pose2D(0.07, 0.0, 0.0)
    for is_latched in (True, False):
        stop = PreciseStop(dwa_params(latch_xy_goal_tolerance=is_latched), 0.05)
        assert stop.is_position_reached(here, IDENTITY)
        stop.command(here, IDENTITY, always)
        assert stop.is_position_reached(here, away) is is_latched


def test_before_arrival_nothing_is_latched():
    stop, goal = PreciseStop(dwa_params(latch_margin=0.2), 0.05), IDENTITY
    for x_m, is_reached in ((-0.041, False), (-0.039, True), (-0.049, True), (-0.051, False), (-0.045, False)):
        motion = Motion(Pose2D(x_m, 0.0, 0.0), 0.04, 0.0)
        assert stop.is_position_reached(motion, goal) is is_reached
        if is_reached:
            assert stop.command(motion, goal, always)[0] > 0.0


@pytest.mark.parametrize(
    ('changes', 'slowest', 'fastest'),
    [({'min_vel_trans': 0.08}, 0.08, 0.45), ({'min_vel_x': 0.1}, 0.1, 0.45), ({'max_vel_x': 0.03}, 0.03, 0.03)],
)
def test_speeds_keep_the_limits(changes, slowest, fastest):
    _, commands = stop_at(IDENTITY, Unicycle(Pose2D(-0.04, 0.0, 0.0), slowest), **changes)
    speeds = [linear for linear, _ in commands if linear > 0.0]
    assert min(speeds) == pytest.approx(slowest) and max(speeds) <= fastest + 1e-9
    assert np.abs(np.diff(speeds)).max(initial=0.0) <= 0.7 * 0.05 + 1e-9


def test_latch_ends_where_it_enters_the_tolerance():
    """As before there was a choice."""
    stop = LatchedStopRotate(dwa_params(), 0.05)
    edge = Motion(Pose2D(-0.05, 0.0, 0.05), 0.0, 0.0)
    assert stop.is_goal_reached(edge, IDENTITY)
    assert stop.command(edge, IDENTITY, always) == (0.0, 0.0)
