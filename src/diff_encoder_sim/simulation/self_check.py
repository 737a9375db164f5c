"""Whether a robot drives as its wheels turn, stands on them, has the torque, and where its scanner is."""

from __future__ import annotations

import math
from typing import Callable, Dict, List, NamedTuple, Sequence, Tuple

import numpy as np
from tabulate import tabulate

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, yaw_from_quat_xyzw
from diff_encoder_sim.robots.description import RobotDescription
from diff_encoder_sim.robots.robot_setup import proposed_laser_line
from diff_encoder_sim.robots.simulated_robot import SimulatedRobot
from diff_encoder_sim.robots.solids import Mesh, holds_point, reach_m
from diff_encoder_sim.simulation.lidar import LidarParams
from diff_encoder_sim.simulation.physics import GRAVITY_MPS2, BulletPhysics, PhysicsParams
from diff_encoder_sim.simulation.simulator import DriveController, DriveParams, SimulatorParams
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
_SIX_WAYS = np.vstack([np.eye(3), -np.eye(3)])
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
        self._half_separation_m, self._radius_m = (
            0.5 * length_m for length_m in (description.wheel_separation_m, description.wheel_diameter_m)
        )
        self._controller = DriveController(drive, self._radius_m, description.wheel_separation_m)
        self.physics = BulletPhysics(_FLOOR, robot, IDENTITY, drive.wheel_torque, physics)
        self._now_ns = 0

    def close(self) -> None:
        """Free the physics; the object cannot be used afterwards."""
        self.physics.close()

    def rest(self) -> Dict[str, float]:
        """Stand still, and return the fraction of the weight on each of PyBullet's links that touches the floor."""
        for _ in range(round(_SETTLING_S / TICK_S)):
            self._tick()
        return self.physics.floor_loads()

    def pitch_rad(self) -> float:
        """Return the pitch of the body; positive is nose down."""
        x, y, z, w = self.physics.base_pose()[1]
        return math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))

    def straight(self, speed_mps: float) -> FlatDrive:
        """Drive straight at a speed, or as fast as the limits allow."""
        limit_mps = min(self._drive.max_linear_speed, _LONGEST_RAMP_S * self._drive.max_linear_acceleration)
        return self._there_and_stop(math.copysign(min(abs(speed_mps), limit_mps), speed_mps), 0.0)

    def turn(self, speed_mps: float) -> FlatDrive:
        """Turn in place, counter-clockwise if positive, with wheels at a speed, or as fast as the limits allow."""
        ramp_radps = _LONGEST_RAMP_S * self._drive.max_angular_acceleration
        limit_radps = min(self._drive.max_angular_speed, ramp_radps, _FASTEST_TURN_RADPS)
        return self._there_and_stop(
            0.0, math.copysign(min(abs(speed_mps) / self._half_separation_m, limit_radps), speed_mps)
        )

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
        wanted_radps = np.array([linear_mps - swing_mps, linear_mps + swing_mps]) / self._radius_m
        reached = float((self.physics.wheels().speeds_radps / wanted_radps).min())
        drive(linear_mps, angular_radps, min(_WAY_M / abs(linear_mps + swing_mps), _LONGEST_CRUISE_S))
        drive(0.0, 0.0, ramp_s + _SETTLING_S)
        left_m, right_m = ((self.physics.wheels().angles_rad - before_rad) * self._wheels[:2]).tolist()
        x_m, y_m, yaw_rad = np.array(poses).T
        yaw_rad = np.unwrap(yaw_rad)
        middle_rad = 0.5 * (yaw_rad[1:] + yaw_rad[:-1])
        return FlatDrive(
            0.5 * (left_m + right_m),
            float((np.cos(middle_rad) * np.diff(x_m) + np.sin(middle_rad) * np.diff(y_m)).sum()),
            (right_m - left_m) / self._wheels.separation_m,
            float(yaw_rad[-1] - yaw_rad[0]),
            (min(pitches_rad), max(pitches_rad)),
            linear_mps or angular_radps,
            reached,
        )

    def _tick(self) -> None:
        self.physics.tick(*self._controller.wheel_speeds_radps(self._now_ns, TICK_S))
        self._now_ns += TICK_NS

    def _axle_pose(self) -> Pose2D:
        (x_m, y_m, _), quat_xyzw = self.physics.base_pose()
        return Pose2D(x_m, y_m, yaw_from_quat_xyzw(*quat_xyzw)).compose(self._axle)


def self_check(robot: SimulatedRobot, params: SimulatorParams) -> List[Check]:
    """Drive a robot on a flat floor of its own, within its own limits, and return the checks; it takes a second."""
    floor = FlatFloor(robot, params.drive, params.physics)
    try:
        loads, rest_pitch_deg = floor.rest(), math.degrees(floor.pitch_rad())
        laser = check_laser(robot.description, floor.physics, params.lidar)
        ahead, back = ([floor.straight(sign * speed) for speed in SPEEDS_MPS] for sign in (1.0, -1.0))
        left, right = ([floor.turn(sign * speed) for speed in SPEEDS_MPS] for sign in (1.0, -1.0))
    finally:
        floor.close()
    straight = [*ahead, *back]
    return [
        _straight('straight, forward', ahead),
        _straight('straight, backward', back),
        _turns('turn, left', left),
        _turns('turn, right', right),
        _weight(robot, loads),
        _pitch(rest_pitch_deg, straight),
        _torque(robot, params.drive, [*straight, *left, *right]),
        laser,
    ]


def _straight(name: str, drives: List[FlatDrive]) -> Check:
    distance = max(_ratio(drive.true_distance_m - drive.wheel_distance_m, drive.wheel_distance_m) for drive in drives)
    turn_radpm = max(_ratio(drive.true_turn_rad - drive.wheel_turn_rad, drive.wheel_distance_m) for drive in drives)
    value = f'{100 * distance:.4f} % of the distance, {math.degrees(turn_radpm):.4f} deg/m'
    return _against_wheels(name, drives, 'm/s', value, distance <= TOLERANCE and turn_radpm <= TOLERANCE_RADPM)


def _turns(name: str, drives: List[FlatDrive]) -> Check:
    angle = max(_ratio(drive.true_turn_rad - drive.wheel_turn_rad, drive.wheel_turn_rad) for drive in drives)
    return _against_wheels(name, drives, 'rad/s', f'{100 * angle:.4f} % of the angle', angle <= TOLERANCE)


def _against_wheels(name: str, drives: List[FlatDrive], unit: str, difference: str, is_ok: bool) -> Check:
    speeds = ' and '.join(f'{abs(drive.speed):.3g}' for drive in drives)
    advice = 'the robot slips or tips: see weight, pitch and torque; lower accelerations in simulator.drive'
    return _judged(name, f'at {speeds} {unit} truth and wheels differ by {difference}', is_ok, advice)


def _weight(robot: SimulatedRobot, loads: Dict[str, float]) -> Check:
    weight_n = robot.description.mass.mass_kg * GRAVITY_MPS2
    left, right = (loads.get(joint, 0.0) for joint in robot.joints)
    value = f'left {left * weight_n:.3g} N ({100 * left:.0f} %), right {right * weight_n:.3g} N ({100 * right:.0f} %)'
    advice = 'the rest is on casters: a centre of mass (of the <inertial> tags) nearer to the axle'
    is_ok = min(left, right) >= LEAST_WHEEL_LOAD
    return _judged('weight on the driven wheels', f'{value} of {weight_n:.3g} N', is_ok, advice)


def _pitch(at_rest_deg: float, drives: List[FlatDrive]) -> Check:
    lowest_deg = math.degrees(min(drive.pitches_rad[0] for drive in drives))
    highest_deg = math.degrees(max(drive.pitches_rad[1] for drive in drives))
    at_rest, lowest, highest = (f'{round(pitch, 2) + 0.0:.2f}' for pitch in (at_rest_deg, lowest_deg, highest_deg))
    value = f'at rest {at_rest} degrees, {lowest} to {highest} while speeding up and braking'
    is_ok = abs(at_rest_deg) <= LARGEST_PITCH_AT_REST_DEG and max(-lowest_deg, highest_deg) <= LARGEST_PITCH_DEG
    advice = 'a lower centre of mass, nearer to the axle, or a lower simulator.drive.max_linear_acceleration'
    return _judged('pitch', value, is_ok, f'it tips over: {advice}')


def _torque(robot: SimulatedRobot, params: DriveParams, drives: List[FlatDrive]) -> Check:
    """Check that the motors follow the ramps of their controller."""
    mass, wheels = robot.description.mass, robot.wheels
    radius_m = max(wheels.left_radius_m, wheels.right_radius_m)
    straight_nm = 0.5 * mass.mass_kg * params.max_linear_acceleration * radius_m
    turning_nm = mass.inertia_kgm2[2, 2] * params.max_angular_acceleration * radius_m / wheels.separation_m
    reached = min(drive.reached for drive in drives)
    needed = f'{max(straight_nm, turning_nm):.3g} of {params.wheel_torque:.3g} N m for the body alone'
    value = f'{100 * reached:.0f} % of the speed at the end of the ramp; {needed}'
    advice = 'a higher simulator.drive.wheel_torque, or lower accelerations'
    return _judged('torque', value, reached >= LEAST_REACHED, advice)


def _judged(name: str, value: str, is_ok: bool, advice: str) -> Check:
    return Check(name, value, is_ok, '' if is_ok else advice)


def _ratio(difference: float, way: float) -> float:
    """Return the size of a difference over that of a way; infinite for a robot that did not move."""
    return abs(difference / way) if abs(way) > STANDSTILL else math.inf


def check_laser(description: RobotDescription, physics: BulletPhysics, lidar: LidarParams) -> Check:
    """Check the scanner of a robot that stands at rest in the world's origin."""
    mount = description.laser
    if mount is None:
        advice = f'closed-loop trials need one, which is added by {proposed_laser_line(description)}'
        return Check('laser', 'none', True, advice)
    pose = mount.pose_in_root
    x_m, y_m, z_m = pose[:3, 3].tolist()
    yaw_rad = math.atan2(pose[1, 0], pose[0, 0])
    height_m = z_m + physics.base_pose()[0][2]
    place = f'{mount.link} at x {x_m:.3f}, y {y_m:.3f}, {height_m:.3f} m above the floor, '
    place += f'turned by {math.degrees(yaw_rad):.0f} degrees, ' if abs(yaw_rad) > 1e-3 else ''
    if height_m <= 0.0:
        return Check('laser', f'{place}below the floor', False, f'give {mount.link} a place above the floor')
    bearings_rad = lidar.angle_min + lidar.angle_span * np.arange(_RAYS) / _RAYS
    directions = np.stack([np.cos(bearings_rad + yaw_rad), np.sin(bearings_rad + yaw_rad), np.zeros(_RAYS)], axis=1)
    begin_m, end_m = ([x_m, y_m, height_m] + way_m * directions for way_m in (lidar.range_min, _FAR_M))
    # Rays do not see a shape that they begin in.
    begin_in_root_m = begin_m - [0.0, 0.0, height_m - z_m]
    is_inside = all(any(holds_point(shape, point_m) for shape in description.hull) for point_m in begin_in_root_m)
    links = description.tree.links
    # A case around the scanner, a shape of its own link: real rays begin outside of that.
    cases = [shape for shape in links[mount.link].collisions if not isinstance(shape.geometry, Mesh)]
    if is_inside and not any(all(reach_m([case], way) > 0.0 for way in _SIX_WAYS) for case in cases):
        value = f'{place}inside a collision shape of the robot'
        # The shape may stand in for a mesh with a recess.
        if any(isinstance(shape.geometry, Mesh) for link in links.values() for shape in link.collisions):
            advice = 'meshes are replaced by their hulls; nothing of the robot hides the world here'
            return Check('laser', value, True, advice)
        return Check('laser', value, False, 'move the link, or make the shape smaller')
    hidden = physics.is_seen(begin_m, end_m)
    if hidden.mean() < _LEAST_HIDDEN:
        return Check('laser', f'{place}sees nothing of the robot', True, '')
    seen_deg = np.degrees(bearings_rad[hidden])
    value = f'sees the robot itself in {100 * hidden.mean():.0f} % of its rays'
    value = f'{place}{value}, from {seen_deg.min():.0f} to {seen_deg.max():.0f} degrees'
    free = 'limit simulator.lidar.angle_min and angle_span to what is free'
    return Check(
        'laser', value, bool(hidden.mean() <= _MOST_HIDDEN), f'the simulated scanner sees through the robot: {free}'
    )
