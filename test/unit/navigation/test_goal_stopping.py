"""The end of a drive, step by step, turns to the path, and recovery behaviours."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, wrap_angle
from diff_encoder_sim.navigation import goal_stopping
from diff_encoder_sim.navigation.goal_stopping import (
    Motion,
    PreciseStop,
    StopSpread,
    TurnToPath,
    stop_parts,
    stop_spread,
)
from diff_encoder_sim.navigation.navigator_inputs import STOP, Command
from diff_encoder_sim.navigation.navigator_params import CLEAR_COSTMAP, ROTATE, NavigatorParams, recoveries_of
from navigation_simulation import PERIOD_S, Robot, dwa_params, local_costmap, straight_plan, winding_plan

GOAL = Pose2D(0.0, 0.0, 1.0)
TOLERANCE_M, YAW_TOLERANCE_RAD = 0.05, 0.052
CLOSE_BY_M = pytest.approx(4.0 * math.hypot(0.26, 0.31))  # of ALTO's corners, with footprint_padding
FAR, NEAR = ('conservative_reset', CLEAR_COSTMAP, 2.0), ('aggressive_reset', CLEAR_COSTMAP, CLOSE_BY_M)
TURN, LOOK, OWN = ('rotate_recovery', ROTATE, 3.0), ('look_around', ROTATE, 3.0), ('mine', CLEAR_COSTMAP, 3.0)
LISTED = [{'name': name, 'type': kind} for name, kind, _ in (LOOK, NEAR, OWN)]


def controller(**changes):
    return goal_stopping.LatchedStopRotate(dwa_params(**changes), 0.05)


def always(*_):
    return True


def at(x_m, yaw_rad=0.0, linear_mps=0.0, angular_radps=0.0, y_m=0.0):
    return Motion(Pose2D(x_m, y_m, yaw_rad), linear_mps, angular_radps)


@pytest.mark.parametrize(
    ('changes', 'reached'),
    [
        ({}, [False, True, True]),
        ({'latch_xy_goal_tolerance': False}, [False, True, False]),
        # Localization moves by millimetres while it turns: who stopped on the edge would be outside.
        ({'latch_margin': 0.2}, [False, False, False]),
    ],
)
def test_position_is_reached_within_tolerance_and_then_latched(changes, reached):
    stop = controller(**changes)
    assert [stop.is_position_reached(at(x_m), GOAL) for x_m in (0.06, 0.05, 0.07)] == reached
    if 'latch_margin' in changes:
        assert stop.is_position_reached(at(0.039), GOAL) and stop.is_position_reached(at(0.06), GOAL)
    stop.reset()
    assert not stop.is_position_reached(at(0.07), GOAL)


@pytest.mark.parametrize(
    ('yaw', 'linear', 'angular', 'expected'),
    [
        (1.05, 0.0, 0.0, True),
        (1.06, 0.0, 0.0, False),
        (1.0, 0.11, 0.0, False),
        (1.0, 0.0, 0.11, False),
        (1.0 - 2 * math.pi, 0.0, 0.0, True),
    ],
)
def test_goal_is_reached_only_when_it_stands_and_looks_there(yaw, linear, angular, expected):
    assert controller().is_goal_reached(at(0.03, yaw, linear, angular), GOAL) is expected


def test_it_brakes_then_turns_then_stops():
    stop = controller()
    assert stop.command(at(0.0, 0.0, 0.3, -0.5), GOAL, always) == pytest.approx((0.265, -0.255))
    assert stop.command(at(0.0, 0.0, 0.05), GOAL, always) == pytest.approx((0.0, 0.245))
    # Turning, it may be fast without that counting as not stopped.
    assert stop.command(at(0.0, 0.0, 0.0, 0.7), GOAL, always) == pytest.approx((0.0, 0.945))
    assert stop.command(at(0.0, 0.97, 0.0, 0.3), GOAL, always) == (0.0, 0.0)
    for each in (controller(), PreciseStop(dwa_params(), 0.05)):
        assert each.command(at(0.0), GOAL, lambda *_: False) is None  # it would collide


@pytest.mark.parametrize(
    ('yaw', 'angular', 'expected'),
    [
        (0.9, 0.0, 0.2),  # min_vel_theta, the rest of 0.1 rad would ask for less
        (-2.0, 0.9, 1.0),  # max_vel_theta
        (1.4, -0.5, -0.4),  # to the right, as fast as the rest in one second
        (0.7, 0.9, 0.655),  # no more braking than the acceleration limit
    ],
)
def test_turning_speed_keeps_all_limits(yaw, angular, expected):
    stop = controller()
    stop.command(at(0.0, yaw), GOAL, always)  # it stands, so it turns
    assert stop.command(at(0.0, yaw, 0.0, angular), GOAL, always)[1] == pytest.approx(expected)


def robot_at(pose, speed_mps=0.0, latency_ticks=2, ppr=None, seed=0):
    return Robot(None, pose, ppr, seed, speed_mps, latency_ticks)


def stop_at(goal, robot, period_s=0.05, limit_s=20.0, is_clear=always, **changes):
    """Drive until the goal is reached; returns the commands, and the pose by odometry."""
    stop, command, commands, start = PreciseStop(dwa_params(**changes), period_s), (robot.linear, 0.0), [], robot.pose
    while True:
        motion = Motion(start.compose(robot.odometry()[0]), *command)
        assert stop.is_position_reached(motion, goal), f'left the tolerance at {motion.base_pose}'
        if stop.is_goal_reached(motion, goal):
            robot.drive(STOP, 50)
            return commands, start.compose(robot.odometry()[0])
        command = stop.command(motion, goal, is_clear)
        commands.append(command)
        assert len(commands) * period_s < limit_s
        robot.drive(Command(*command), round(period_s * 100))


@pytest.mark.parametrize(
    ('start', 'is_clear'),
    [
        # After turns in place an estimate is some millimetres off: that is no reason to drive.
        (
            Pose2D(-0.9 * goal_stopping.SET_OUT * TOLERANCE_M, 0.02, 0.9 * goal_stopping.SET_OUT * YAW_TOLERANCE_RAD),
            True,
        ),
        (Pose2D(0.03, -0.02, 0.0), True),  # it never drives backwards
        (Pose2D(-0.035, 0.0, 0.8 * YAW_TOLERANCE_RAD), False),  # and leaves a turn that is not needed
    ],
)
def test_a_robot_that_stands_close_enough_or_whose_way_is_not_clear_does_not_move(start, is_clear):
    assert set(stop_at(IDENTITY, robot_at(start), is_clear=lambda *_: is_clear)[0]) == {(0.0, 0.0)}


def test_the_check_of_the_way_ends_at_the_goal():
    asked_mps = []
    stop_at(IDENTITY, robot_at(Pose2D(-0.04, 0.0, 0.0), 0.04), is_clear=lambda linear, _: not asked_mps.append(linear))
    assert max(asked_mps) * dwa_params().sim_time == pytest.approx(0.04)


@pytest.mark.parametrize('pulses', [40, 4096])
def test_all_starts_end_close_in_time_and_for_good(pulses):
    """With poses that jump by pulses, at 5 to 20 Hz, and all limits: by the pose, in one turn and without a search."""
    random, pulse_rad = np.random.default_rng(pulses), math.pi * 0.2 / pulses / 0.4
    for seed in range(60):
        bearing, distance_m = random.uniform(-0.5, 0.5), random.uniform(0.005, 0.04)
        start = Pose2D(-distance_m * math.cos(bearing), -distance_m * math.sin(bearing), random.uniform(-0.2, 0.2))
        robot = robot_at(start, random.uniform(0.0, 0.05), random.integers(0, 6), pulses, seed)
        goal, period_s = Pose2D(0.0, 0.0, random.uniform(-3.0, 3.0)), random.choice([0.05, 0.1, 0.2])
        limits = {'acc_lim_x': random.uniform(0.3, 2.5), 'acc_lim_theta': random.uniform(1.0, 6.0)}
        limits['min_vel_theta'] = random.choice([0.0, 0.1, 0.2])
        commands, pose = stop_at(goal, robot, period_s, 16.0, **limits)
        assert math.hypot(*pose[:2]) <= TOLERANCE_M / 2
        assert abs(wrap_angle(goal.yaw_rad - pose.yaw_rad)) <= YAW_TOLERANCE_RAD + pulse_rad
        turns = [math.copysign(1.0, angular) for linear, angular in commands if linear == 0.0 and angular != 0.0]
        assert np.count_nonzero(np.diff(turns)) <= 1  # slowing down from steering, then in one direction


@pytest.mark.parametrize('is_latched', [True, False])
def test_when_localization_moves_the_goal_the_heading_is_turned_to_and_the_position_may_be_latched(is_latched):
    stop, here = PreciseStop(dwa_params(latch_xy_goal_tolerance=is_latched), 0.05), at(0.0)
    assert stop.is_position_reached(here, IDENTITY)
    assert stop.command(here, IDENTITY, always) == (0.0, 0.0) and stop.is_goal_reached(here, IDENTITY)
    turned = Pose2D(0.0, 0.0, 0.1)
    assert not stop.is_goal_reached(here, turned) and stop.command(here, turned, always)[1] > 0.0
    assert stop.is_position_reached(here, Pose2D(0.07, 0.0, 0.0)) is is_latched


@pytest.mark.parametrize(
    ('changes', 'slowest', 'fastest'),
    [({'min_vel_trans': 0.08}, 0.08, 0.45), ({'min_vel_x': 0.1}, 0.1, 0.45), ({'max_vel_x': 0.03}, 0.03, 0.03)],
)
def test_speeds_keep_the_limits(changes, slowest, fastest):
    commands, _ = stop_at(IDENTITY, robot_at(Pose2D(-0.04, 0.0, 0.0), slowest), **changes)
    speeds = [linear for linear, _ in commands if linear > 0.0]
    assert min(speeds) == pytest.approx(slowest) and max(speeds) <= fastest + 1e-9
    assert np.abs(np.diff(speeds)).max(initial=0.0) <= 0.7 * 0.05 + 1e-9


def spread(params, pulse):
    return stop_spread(params, stop_parts(params, 0.05, 0.02, pulse))


@pytest.mark.parametrize(
    ('changes', 'expected_m'),
    [({}, 0.05), ({'latch_margin': 0.2}, 0.04), ({'latch_margin': 0.2, 'latch_xy_goal_tolerance': False}, 0.05)],
)
def test_latch_ends_on_the_edge_of_what_it_latches(changes, expected_m):
    assert spread(dwa_params(**changes), StopSpread(0.02, 0.04)) == pytest.approx((expected_m, 0.052))


def test_precise_is_what_the_control_loop_leaves_and_a_pulse_up_to_the_tolerance():
    """At 20 Hz: 39 mm/s at the end, 1.1 mm of braking, 1 mm of half a period, 0.8 mm of latency, 5 mm aside."""
    pulses = StopSpread(0.0, 0.0), StopSpread(0.0157, 0.03), StopSpread(1.0, 1.0)
    fine, coarse, none = (spread(dwa_params(stop='precise'), pulse) for pulse in pulses)
    speed = 0.7 * (math.sqrt(0.1**2 + 2 * 0.005 / 0.7) - 0.1)
    along_m = speed**2 / 1.4 + 0.5 * speed * 0.05 + speed * 0.02
    assert fine == pytest.approx((math.hypot(along_m, 0.005), 0.052 / 3.0)) and 0.005 < fine.position_m < 0.006
    assert fine.position_m + 0.01 < coarse.position_m < 0.02 and fine.yaw_rad < coarse.yaw_rad < 0.052
    assert none == pytest.approx((0.05, 0.052))


def test_a_plan_behind_the_robot_is_turned_to():
    plan, turn, still = straight_plan(1.4, math.pi), TurnToPath(dwa_params(), PERIOD_S), at(0.0, 0.1)
    assert turn.command(still, plan, always) == (0.0, pytest.approx(0.245))
    assert turn.command(still, plan, lambda *_: False) is None
    assert turn.command(at(0.0, math.pi - 0.9, 0.0, 1.0), plan, always) is None
    assert TurnToPath(dwa_params(turn_to_path_angle=0.0), PERIOD_S).command(still, plan, always) is None


def test_the_bearing_is_that_of_the_first_point_far_enough_from_the_nearest():
    random = np.random.default_rng(7)
    for points in (1, 2, 10, 60):
        plan = winding_plan(random, points)
        x_m, y_m = random.normal(0.0, 0.3, 2)
        nearest = int(np.argmin(np.hypot(plan[:, 0] - x_m, plan[:, 1] - y_m)))
        travelled_m = np.append(0.0, np.cumsum(np.hypot(*np.diff(plan[nearest:, :2], axis=0).T)))
        far = np.flatnonzero(travelled_m >= goal_stopping.LOOKAHEAD_M)
        ahead = plan[nearest + far[0] if len(far) else -1]
        assert goal_stopping.bearing_ahead(plan, x_m, y_m) == math.atan2(ahead[1] - y_m, ahead[0] - x_m)


def test_a_robot_that_came_past_its_goal_turns_to_it():
    stop = PreciseStop(dwa_params(), 0.05)
    aside = [at(x_m, linear_mps=0.04, y_m=0.035) for x_m in (-0.06, -0.02)]  # it drives into the tolerance
    assert [stop.is_position_reached(motion, IDENTITY) for motion in aside] == [False, True]
    linear_mps, angular_radps = stop.command(aside[1], IDENTITY, always)
    assert linear_mps < 0.04 and angular_radps < 0.0
    linear_mps, angular_radps = stop.command(at(-0.02, -1.0, 0.0, -0.5, 0.035), IDENTITY, always)
    assert linear_mps > 0.0 and angular_radps < 0.0


# ---- recovery; clearing is in test_costmap and test_navigator


def test_rotation_goes_once_around():
    yaw, speeds, text = 0.3, [], ''
    rotation = goal_stopping.Rotation(dwa_params(), 0, Pose2D(0.0, 0.0, yaw))
    while text != 'turned once around':
        speed, text = rotation.step(50_000_000 * len(speeds), Pose2D(0.0, 0.0, wrap_angle(yaw)), local_costmap())
        speeds.append(speed or 0.0)
        yaw += speeds[-1] * 0.05
        assert len(speeds) < 400
    assert yaw - 0.3 == pytest.approx(2.0 * math.pi, abs=0.1)
    assert set(speeds[:-1]) == {1.0}  # max_vel_theta: 4.9 rad/s^2 stops it within 0.1 rad


@pytest.mark.parametrize(
    ('obstacle_m', 'after_s', 'turns'), [(0.35, 0.0, False), (0.5, 0.0, True), (0.5, 30.0, True), (0.5, 32.0, False)]
)
def test_rotation_ends_if_it_would_collide_or_the_robot_does_not_turn(obstacle_m, after_s, turns):
    rotation = goal_stopping.Rotation(dwa_params(), 0, IDENTITY)
    speed, _ = rotation.step(int(after_s * 1e9), IDENTITY, local_costmap([(obstacle_m, 0.0)]))
    assert (speed is not None) is turns


@pytest.mark.parametrize(
    ('given', 'expected'),
    [
        ({}, [FAR, TURN, NEAR, TURN]),
        ({'clearing_rotation_allowed': False}, [FAR, NEAR]),
        ({'recovery_behavior_enabled': False}, []),
        ({'recovery_behaviors': LISTED, 'clearing_rotation_allowed': False}, [LOOK, NEAR, OWN]),
    ],
)
def test_order_of_recoveries_is_move_bases_or_that_of_the_list(given, expected):
    local = {'rolling_window': True, 'global_frame': 'odom'}
    params = {'conservative_reset_dist': 2.0, 'local_costmap': local, **given}
    assert recoveries_of(NavigatorParams.from_mapping(params, ''), math.hypot(0.26, 0.31)) == expected
