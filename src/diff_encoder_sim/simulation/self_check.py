"""Whether a robot drives as its wheels turn, stands on them, has the torque, and where its scanner is."""

from __future__ import annotations

import math
from contextlib import closing
from typing import Callable, Dict, List, NamedTuple, Sequence, Tuple

import numpy as np
from tabulate import tabulate

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.robots.description import RobotDescription
from diff_encoder_sim.robots.robot_file import proposed_laser_line
from diff_encoder_sim.robots.simulated_robot import SimulatedRobot
from diff_encoder_sim.robots.solids import Mesh
from diff_encoder_sim.simulation.lidar import LidarParams
from diff_encoder_sim.simulation.physics import GRAVITY_MPS2, BulletPhysics, PhysicsParams
from diff_encoder_sim.simulation.simulator import DriveController, DriveParams, SimulatorParams, clamp
from diff_encoder_sim.simulation.state import STATES_PERIOD_S, TICK_NS, TICK_S
from diff_encoder_sim.simulation.world import Model, Plane, Solid, World

SPEEDS_MPS = (0.1, 1.0)  # or the robot's limit
TOLERANCE = 1e-3  # truth against wheels, relative
# A robot that drives straight may turn by so much unnoticed by its wheels: 0.1 % of the way to the side.
TOLERANCE_RADPM = 2e-3
LEAST_WHEEL_LOAD = 0.1  # of the weight, on each wheel
LARGEST_PITCH_AT_REST_DEG, LARGEST_PITCH_DEG = 1.0, 5.0
LEAST_REACHED = 0.98  # of the commanded speed, when the ramp is over
STANDSTILL = 1e-3  # m or rad: a drive that is none

_FLOOR = World('floor', [Model('floor', np.eye(4), [Solid('floor', Plane(), np.eye(4))])])
_WAY_M, _LONGEST_CRUISE_S = 2.0, 20.0  # of a wheel at constant speed
_SETTLING_S = 0.5
_LONGEST_RAMP_S = 2.0  # a robot that accelerates slowly is tried at a lower speed
# Half a turn in a second: no navigator turns faster, and where the centre of mass is off the axle robots slip then.
_FASTEST_TURN_RADPS = 3.0
_MOTOR_LAG_S = 0.05

_RAYS = 360
_FAR_M = 5.0  # beyond any part of a robot
_MOST_HIDDEN = 0.1  # of the rays: posts and cables
_LEAST_HIDDEN = 0.01  # PyBullet hits a cylinder from inside by single rays along its axes


class Check(NamedTuple):
    """One property that was checked."""

    name: str
    value: str
    is_ok: bool
    advice: str  # what to do; '' if there is nothing


def checks_table(checks: Sequence[Check]) -> str:
    """Format checks as a table, followed by what to do."""
    rows = [[check.name, check.value, 'ok' if check.is_ok else 'NOT OK'] for check in checks]
    table = tabulate(rows, ['check', 'value', ''], disable_numparse=True)
    advice = [f'{check.name}: {check.advice}' for check in checks if check.advice]
    return '\n'.join([table, *([''] if advice else []), *advice])


class FlatDrive(NamedTuple):
    """A drive from rest to rest: the motion by the wheels, and that of the axle's middle."""

    wheel_distance_m: float  # signed, along the way
    true_distance_m: float
    wheel_turn_rad: float
    true_turn_rad: float
    pitches_rad: Tuple[float, float]  # lowest and highest; positive is nose down
    speed: float  # commanded, signed [m/s], of a turn in place [rad/s]
    reached: float  # fraction of the commanded wheel speed at the end of the ramp


class RolledDrive(NamedTuple):
    """What wheels rolled on a drive, and where that ended."""

    times_s: np.ndarray  # (n,) of each tick, since the start
    ways_m: np.ndarray  # (n, 2) of the left and of the right wheel's rim since the start
    separation_m: float  # between the wheels' contact points
    end: Pose2D  # true one of the axle's middle, as seen from where it began


class FlatFloor:
    """A robot on a floor, driven by its own controller within its own limits."""

    def __init__(self, robot: SimulatedRobot, drive: DriveParams, physics: PhysicsParams) -> None:
        description = robot.description
        self._wheels, self._axle, self._drive = robot.wheels, Pose2D(description.axle_x_m, 0.0, 0.0), drive
        self._half_separation_m, self._radii_m = 0.5 * description.wheel_separation_m, description.radii_m
        self._controller = DriveController(drive, self._radii_m, description.wheel_separation_m)
        self.physics = BulletPhysics(_FLOOR, robot, IDENTITY, drive.wheel_torque, physics)
        self.close = self.physics.close
        self._now_ns = 0

    def rest(self) -> Dict[str, float]:
        """Stand still, and return the fraction of the weight on each of PyBullet's links that touches the floor."""
        for _ in range(round(_SETTLING_S / TICK_S)):
            self._tick()
        return self.physics.floor_loads()

    def pitch_rad(self) -> float:
        """Return the pitch of the body; positive is nose down."""
        x, y, z, w = self.physics.base_pose()[1]
        return math.asin(clamp(2.0 * (w * y - z * x), 1.0))

    def straight(self, speed_mps: float) -> FlatDrive:
        """Drive straight at a speed, or as fast as the limits allow."""
        limit_mps = min(self._drive.max_linear_speed, _LONGEST_RAMP_S * self._drive.max_linear_acceleration)
        return self._there_and_stop(clamp(speed_mps, limit_mps), 0.0)

    def turn(self, speed_mps: float) -> FlatDrive:
        """Turn in place, counter-clockwise if positive, with wheels at a speed, or as fast as the limits allow."""
        ramp_radps = _LONGEST_RAMP_S * self._drive.max_angular_acceleration
        limit_radps = min(self._drive.max_angular_speed, ramp_radps, _FASTEST_TURN_RADPS)
        return self._there_and_stop(0.0, clamp(speed_mps / self._half_separation_m, limit_radps))

    def follow(self, command_at: Callable[[float], Tuple[float, float]], duration_s: float) -> RolledDrive:
        """Drive by commands, linear [m/s] and angular [rad/s], of the time since the start [s].

        Each holds for STATES_PERIOD_S, in which the true pose of a trial is sampled.
        """
        start, angles_rad = self._axle_pose(), [self.physics.wheels().angles_rad]
        ticks = round(STATES_PERIOD_S / TICK_S)
        for index in range(math.ceil(duration_s / TICK_S)):
            if index % ticks == 0:
                self._controller.command(self._now_ns, *command_at(index * TICK_S))
            self._tick()
            angles_rad.append(self.physics.wheels().angles_rad)
        ways_m = (np.array(angles_rad) - angles_rad[0]) * self._wheels[:2]
        end = self._axle_pose().relative_to(start)
        return RolledDrive(TICK_S * np.arange(len(ways_m)), ways_m, self._wheels.separation_m, end)

    def _there_and_stop(self, linear_mps: float, angular_radps: float) -> FlatDrive:
        """Drive from rest to a velocity, keep it for _WAY_M of a wheel, and stop; within the robot's limits."""
        swing_mps = self._half_separation_m * angular_radps
        ramp_s = max(
            abs(linear_mps) / self._drive.max_linear_acceleration,
            abs(angular_radps) / self._drive.max_angular_acceleration,
        )
        before_rad = np.array(self.physics.wheels().angles_rad)
        poses, pitches_rad = [self._axle_pose()], [self.pitch_rad()]

        def drive(linear_mps: float, angular_radps: float, duration_s: float) -> None:
            for _ in range(math.ceil(duration_s / TICK_S)):
                self._controller.command(self._now_ns, linear_mps, angular_radps)
                self._tick()
                poses.append(self._axle_pose())
                pitches_rad.append(self.pitch_rad())

        drive(linear_mps, angular_radps, ramp_s + _MOTOR_LAG_S)
        wanted_radps = np.array([linear_mps - swing_mps, linear_mps + swing_mps]) / self._radii_m
        reached = float((self.physics.wheels().speeds_radps / wanted_radps).min())
        drive(linear_mps, angular_radps, min(_WAY_M / abs(linear_mps + swing_mps), _LONGEST_CRUISE_S))
        drive(0.0, 0.0, ramp_s + _SETTLING_S)
        left_m, right_m = ((self.physics.wheels().angles_rad - before_rad) * self._wheels[:2]).tolist()
        x_m, y_m, yaw_rad = np.array(poses).T
        yaw_rad = np.unwrap(yaw_rad)
        middle_rad = 0.5 * (yaw_rad[1:] + yaw_rad[:-1])
        true_m = float((np.cos(middle_rad) * np.diff(x_m) + np.sin(middle_rad) * np.diff(y_m)).sum())
        turn_rad, true_turn_rad = (right_m - left_m) / self._wheels.separation_m, float(yaw_rad[-1] - yaw_rad[0])
        pitches = min(pitches_rad), max(pitches_rad)
        speed = linear_mps or angular_radps
        return FlatDrive(0.5 * (left_m + right_m), true_m, turn_rad, true_turn_rad, pitches, speed, reached)

    def _tick(self) -> None:
        self.physics.tick(*self._controller.wheel_speeds_radps(self._now_ns, TICK_S))
        self._now_ns += TICK_NS

    def _axle_pose(self) -> Pose2D:
        return self.physics.base_pose_in_plane().compose(self._axle)


def self_check(robot: SimulatedRobot, params: SimulatorParams) -> List[Check]:
    """Drive a robot on a flat floor of its own, within its own limits, and return the checks; it takes a second."""
    mass, wheels, limits = robot.description.mass, robot.wheels, params.drive
    with closing(FlatFloor(robot, limits, params.physics)) as floor:
        loads, rest_deg = floor.rest(), math.degrees(floor.pitch_rad())
        laser = check_laser(robot.description, floor.physics, params.lidar)
        ahead, back = ([floor.straight(sign * speed) for speed in SPEEDS_MPS] for sign in (1.0, -1.0))
        left, right = ([floor.turn(sign * speed) for speed in SPEEDS_MPS] for sign in (1.0, -1.0))
    straight, checks = [*ahead, *back], []

    def judge(name: str, value: str, is_ok: bool, advice: str) -> None:
        checks.append(Check(name, value, is_ok, '' if is_ok else advice))

    slips = 'the robot slips or tips: see weight, pitch and torque; lower accelerations in simulator.drive'
    for name, drives in (('straight, forward', ahead), ('straight, backward', back)):
        distance = max(_ratio(each.true_distance_m - each.wheel_distance_m, each.wheel_distance_m) for each in drives)
        turn_radpm = max(_ratio(each.true_turn_rad - each.wheel_turn_rad, each.wheel_distance_m) for each in drives)
        value = f'{100 * distance:.4f} % of the distance, {math.degrees(turn_radpm):.4f} deg/m'
        is_ok = distance <= TOLERANCE and turn_radpm <= TOLERANCE_RADPM
        judge(name, f'at {_speeds(drives)} m/s truth and wheels differ by {value}', is_ok, slips)
    for name, drives in (('turn, left', left), ('turn, right', right)):
        angle = max(_ratio(each.true_turn_rad - each.wheel_turn_rad, each.wheel_turn_rad) for each in drives)
        value = f'{100 * angle:.4f} % of the angle'
        judge(name, f'at {_speeds(drives)} rad/s truth and wheels differ by {value}', angle <= TOLERANCE, slips)

    weight_n, on_wheels = mass.mass_kg * GRAVITY_MPS2, [loads.get(joint, 0.0) for joint in robot.joints]
    sides = zip(('left', 'right'), on_wheels)
    value = ', '.join(f'{side} {load * weight_n:.3g} N ({100 * load:.0f} %)' for side, load in sides)
    advice = 'the rest is on casters: a centre of mass (of the <inertial> tags) nearer to the axle'
    is_ok = min(on_wheels) >= LEAST_WHEEL_LOAD
    judge('weight on the driven wheels', f'{value} of {weight_n:.3g} N', is_ok, advice)

    pitches_deg = [math.degrees(pitch_rad) for drive in straight for pitch_rad in drive.pitches_rad]
    at_rest, low, high = (f'{round(deg, 2) + 0.0:.2f}' for deg in (rest_deg, min(pitches_deg), max(pitches_deg)))
    value = f'at rest {at_rest} degrees, {low} to {high} while speeding up and braking'
    is_ok = abs(rest_deg) <= LARGEST_PITCH_AT_REST_DEG and max(map(abs, pitches_deg)) <= LARGEST_PITCH_DEG
    advice = 'a lower centre of mass, nearer to the axle, or a lower simulator.drive.max_linear_acceleration'
    judge('pitch', value, is_ok, f'it tips over: {advice}')

    # The motors must follow the ramps of their controller.
    radius_m, reached = max(wheels[:2]), min(drive.reached for drive in (*straight, *left, *right))
    straight_nm = 0.5 * mass.mass_kg * limits.max_linear_acceleration * radius_m
    turning_nm = mass.inertia_kgm2[2, 2] * limits.max_angular_acceleration * radius_m / wheels.separation_m
    needed = f'{max(straight_nm, turning_nm):.3g} of {limits.wheel_torque:.3g} N m for the body alone'
    value = f'{100 * reached:.0f} % of the speed at the end of the ramp; {needed}'
    advice = 'a higher simulator.drive.wheel_torque, or lower accelerations'
    judge('torque', value, reached >= LEAST_REACHED, advice)
    return [*checks, laser]


def _speeds(drives: List[FlatDrive]) -> str:
    return ' and '.join(f'{abs(drive.speed):.3g}' for drive in drives)


def _ratio(difference: float, way: float) -> float:
    """Return the size of a difference over that of a way; infinite for a robot that did not move."""
    return abs(difference / way) if abs(way) > STANDSTILL else math.inf


def check_laser(description: RobotDescription, physics: BulletPhysics, lidar: LidarParams) -> Check:
    """Check the scanner of a robot that stands at rest in the world's origin."""
    laser = description.laser
    if laser is None:
        advice = f'closed-loop trials need one, which is added by {proposed_laser_line(description)}'
        return Check('laser', 'none', True, advice)
    (x_m, y_m, yaw_rad), z_m = laser.pose_in_base, float(laser.pose_in_root[2, 3])
    height_m = z_m + physics.base_pose()[0][2]
    place = f'{laser.link} at x {x_m:.3f}, y {y_m:.3f}, {height_m:.3f} m above the floor, '
    place += f'turned by {math.degrees(yaw_rad):.0f} degrees, ' if abs(yaw_rad) > 1e-3 else ''
    if height_m <= 0.0:
        return Check('laser', f'{place}below the floor', False, f'give {laser.link} a place above the floor')
    bearings_rad = lidar.angle_min + lidar.angle_span * np.arange(_RAYS) / _RAYS
    directions = np.stack([np.cos(bearings_rad + yaw_rad), np.sin(bearings_rad + yaw_rad), np.zeros(_RAYS)], axis=1)
    begin_m, end_m = ([x_m, y_m, height_m] + way_m * directions for way_m in (lidar.range_min, _FAR_M))
    # Rays do not see a shape that they begin in.
    begin_in_root_m = begin_m - [0.0, 0.0, height_m - z_m]
    is_inside = all(any(shape.holds(point_m) for shape in description.hull) for point_m in begin_in_root_m)
    links = description.tree.links
    # A case around the scanner, a shape of its own link: real rays begin outside of that.
    cases = [shape for shape in links[laser.link].collisions if not isinstance(shape.geometry, Mesh)]
    if is_inside and not any(case.holds(np.zeros(3)) for case in cases):
        # The shape may stand in for a mesh with a recess.
        may_be_free = any(isinstance(shape.geometry, Mesh) for link in links.values() for shape in link.collisions)
        hulls = 'meshes are replaced by their hulls; nothing of the robot hides the world here'
        advice = hulls if may_be_free else 'move the link, or make the shape smaller'
        return Check('laser', f'{place}inside a collision shape of the robot', may_be_free, advice)
    hidden = physics.is_seen(begin_m, end_m)
    fraction, seen_deg = float(hidden.mean()), np.degrees(bearings_rad[hidden])
    if fraction < _LEAST_HIDDEN:
        return Check('laser', f'{place}sees nothing of the robot', True, '')
    value = f'{place}sees the robot itself in {100 * fraction:.0f} % of its rays'
    value = f'{value}, from {seen_deg.min():.0f} to {seen_deg.max():.0f} degrees'
    free = 'limit simulator.lidar.angle_min and angle_span to what is free'
    return Check('laser', value, fraction <= _MOST_HIDDEN, f'the simulated scanner sees through the robot: {free}')
