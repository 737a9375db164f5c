"""Whether a robot drives as its wheels turn, stands on them, has the torque, and where its scanner is."""

from __future__ import annotations

import math
from typing import Callable, Dict, Iterator, List, NamedTuple, Sequence, Tuple

import numpy as np
from tabulate import tabulate

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, wrap_angle, yaw_from_quat_xyzw
from diff_encoder_sim.robots.description import Mesh, RobotDescription, RobotLaser
from diff_encoder_sim.robots.robot_setup import proposed_laser_line
from diff_encoder_sim.robots.simulated_robot import SimulatedRobot
from diff_encoder_sim.robots.solids import holds_point, reach_m
from diff_encoder_sim.simulation.lidar import LidarParams
from diff_encoder_sim.simulation.physics import GRAVITY_MPS2, BulletPhysics, PhysicsParams
from diff_encoder_sim.simulation.simulator import DriveController, DriveParams, SimulatorParams
from diff_encoder_sim.simulation.state import STATES_PERIOD_S, TICK_NS, TICK_S
from diff_encoder_sim.simulation.world import Model, Plane, Solid, World


class Check(NamedTuple):
    """One thing that was checked."""

    name: str
    value: str
    is_ok: bool
    advice: str  # what to do; '' where there is nothing


def checks_table(checks: Sequence[Check]) -> str:
    """Format checks as a table, and below it what to do."""
    rows = [[check.name, check.value, 'ok' if check.is_ok else 'NOT OK'] for check in checks]
    table = tabulate(rows, ['check', 'value', ''], disable_numparse=True)
    advice = [f'{check.name}: {check.advice}' for check in checks if check.advice]
    return '\n'.join([table, *([''] if advice else []), *advice])


_FLOOR = World('floor', [Model('floor', np.eye(4), [Solid('floor', Plane(), np.eye(4))])])
_WAY_M, _LONGEST_CRUISE_S = 2.0, 20.0  # of a wheel at constant speed
_SETTLING_S = 0.5
_LONGEST_RAMP_S = 2.0  # a robot that accelerates slowly is tried at a lower speed
# Half a turn in a second: no navigator turns faster, and where the centre of mass is off the axle robots slip then.
_FASTEST_TURN_RADPS = 3.0
_MOTOR_LAG_S = 0.05


class FlatDrive(NamedTuple):
    """A drive from rest to rest: what the wheels say, and the truth of the axle's middle."""

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
        self._wheels, self._axle = robot.wheels, Pose2D(description.axle_x_m, 0.0, 0.0)
        self._drive = drive
        self._half_separation_m = 0.5 * description.wheel_separation_m
        self._radius_m = 0.5 * description.wheel_diameter_m
        self._controller = DriveController(drive, self._radius_m, description.wheel_separation_m)
        self.physics = BulletPhysics(_FLOOR, robot, IDENTITY, drive.wheel_torque, physics)
        self._now_ns = 0

    def close(self) -> None:
        """Free the physics; the object cannot be used afterwards."""
        self.physics.close()

    def straight(self, speed_mps: float) -> FlatDrive:
        """Drive straight at a speed, or as fast as the limits allow."""
        limit_mps = min(self._drive.max_linear_speed, _LONGEST_RAMP_S * self._drive.max_linear_acceleration)
        linear_mps = math.copysign(min(abs(speed_mps), limit_mps), speed_mps)
        return self.drive(linear_mps, 0.0, min(_WAY_M / abs(linear_mps), _LONGEST_CRUISE_S))

    def turn(self, speed_mps: float) -> FlatDrive:
        """Turn in place, counter-clockwise if positive, with wheels at a speed, or as fast as the limits allow."""
        ramp_radps = _LONGEST_RAMP_S * self._drive.max_angular_acceleration
        limit_radps = min(self._drive.max_angular_speed, ramp_radps, _FASTEST_TURN_RADPS)
        angular_radps = math.copysign(min(abs(speed_mps) / self._half_separation_m, limit_radps), speed_mps)
        cruise_s = _WAY_M / (abs(angular_radps) * self._half_separation_m)
        return self.drive(0.0, angular_radps, min(cruise_s, _LONGEST_CRUISE_S))

    def follow(self, command_at: Callable[[float], Tuple[float, float]], duration_s: float) -> RolledDrive:
        """Drive by commands, linear [m/s] and angular [rad/s], of the time since the start [s].

        Each holds for STATES_PERIOD_S, in which the true pose of a trial is sampled.
        """
        start, start_rad = self._axle_pose(), np.array(self.physics.wheels().angles_rad)
        angles_rad: List[Tuple[float, float]] = [self.physics.wheels().angles_rad]
        ticks = round(STATES_PERIOD_S / TICK_S)
        for index in range(math.ceil(duration_s / TICK_S)):
            if index % ticks == 0:
                self._controller.command(self._now_ns, *command_at(index * TICK_S))
            self._tick()
            angles_rad.append(self.physics.wheels().angles_rad)
        ways_m = (np.array(angles_rad) - start_rad) * self._wheels[:2]
        end = self._axle_pose().relative_to(start)
        return RolledDrive(TICK_S * np.arange(len(ways_m)), ways_m, self._wheels.separation_m, end)

    def rest(self) -> Dict[str, float]:
        """Stand still, and return the fraction of the weight on each of PyBullet's links that touches the floor."""
        for _ in range(round(_SETTLING_S / TICK_S)):
            self._tick()
        return self.physics.floor_loads()

    def pitch_rad(self) -> float:
        """Return the pitch of the body; positive is nose down."""
        x, y, z, w = self.physics.base_pose()[1]
        return math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))

    def drive(self, linear_mps: float, angular_radps: float, cruise_s: float) -> FlatDrive:
        """Drive from rest to a velocity, keep it for a time, and stop; within the robot's limits."""
        ramp_s = max(
            abs(linear_mps) / self._drive.max_linear_acceleration,
            abs(angular_radps) / self._drive.max_angular_acceleration,
        )
        before_rad, self._truth = self.physics.wheels().angles_rad, _Truth(self._axle_pose())
        self._pitches_rad = [self.pitch_rad()]
        self._command(linear_mps, angular_radps, ramp_s + _MOTOR_LAG_S)
        reached = self._reached(linear_mps, angular_radps)
        self._command(linear_mps, angular_radps, cruise_s)
        self._command(0.0, 0.0, ramp_s + _SETTLING_S)
        left_m, right_m = (
            radius_m * (after_rad - angle_rad)
            for radius_m, after_rad, angle_rad in zip(self._wheels, self.physics.wheels().angles_rad, before_rad)
        )
        return FlatDrive(
            0.5 * (left_m + right_m),
            self._truth.distance_m,
            (right_m - left_m) / self._wheels.separation_m,
            self._truth.turn_rad,
            (min(self._pitches_rad), max(self._pitches_rad)),
            linear_mps or angular_radps,
            reached,
        )

    def _command(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        for _ in range(math.ceil(duration_s / TICK_S)):
            self._controller.command(self._now_ns, linear_mps, angular_radps)
            self._tick()
            self._truth.take(self._axle_pose())
            self._pitches_rad.append(self.pitch_rad())

    def _tick(self) -> None:
        self.physics.tick(*self._controller.wheel_speeds_radps(self._now_ns, TICK_S))
        self._now_ns += TICK_NS

    def _reached(self, linear_mps: float, angular_radps: float) -> float:
        """Return the smaller of both wheels' fractions of the commanded speed."""
        swing_mps = self._half_separation_m * angular_radps
        wanted_mps = linear_mps - swing_mps, linear_mps + swing_mps
        speeds_radps = self.physics.wheels().speeds_radps
        return min(self._radius_m * speed / wanted for speed, wanted in zip(speeds_radps, wanted_mps))

    def _axle_pose(self) -> Pose2D:
        (x_m, y_m, _), quat_xyzw = self.physics.base_pose()
        return Pose2D(x_m, y_m, yaw_from_quat_xyzw(*quat_xyzw)).compose(self._axle)


class _Truth:
    """Adds up a motion, whole turns counted."""

    def __init__(self, pose: Pose2D) -> None:
        self._pose = pose
        self.distance_m = self.turn_rad = 0.0

    def take(self, pose: Pose2D) -> None:
        """Add the motion to a pose."""
        turn_rad = wrap_angle(pose.yaw_rad - self._pose.yaw_rad)
        yaw_rad = self._pose.yaw_rad + 0.5 * turn_rad
        self.distance_m += math.cos(yaw_rad) * (pose.x_m - self._pose.x_m) + math.sin(yaw_rad) * (
            pose.y_m - self._pose.y_m
        )
        self.turn_rad += turn_rad
        self._pose = pose


_RAYS = 360
_SIX_WAYS = np.vstack([np.eye(3), -np.eye(3)])
_FAR_M = 5.0  # beyond any part of a robot
_MOST_HIDDEN = 0.1  # of the rays: posts and cables
_LEAST_HIDDEN = 0.01  # PyBullet hits a cylinder from inside by single rays along its axes


def check_laser(description: RobotDescription, physics: BulletPhysics, lidar: LidarParams) -> Check:
    """Check the scanner of a robot that stands at rest in the world's origin."""
    mount = description.laser
    if mount is None:
        return Check(
            'laser', 'none', True, f'closed-loop trials need one, which is added by {proposed_laser_line(description)}'
        )
    (x_m, y_m, z_m), yaw_rad = _place(mount)
    height_m = z_m + physics.base_pose()[0][2]
    place = f'{mount.link} at x {x_m:.3f}, y {y_m:.3f}, {height_m:.3f} m above the floor, '
    place += f'turned by {math.degrees(yaw_rad):.0f} degrees, ' if abs(yaw_rad) > 1e-3 else ''
    if height_m <= 0.0:
        return Check('laser', f'{place}below the floor', False, f'give {mount.link} a place above the floor')
    bearings_rad = lidar.angle_min + lidar.angle_span * np.arange(_RAYS) / _RAYS
    directions = np.stack([np.cos(bearings_rad + yaw_rad), np.sin(bearings_rad + yaw_rad), np.zeros(_RAYS)], axis=1)
    begin_m, end_m = (np.array([x_m, y_m, height_m]) + reach_m * directions for reach_m in (lidar.range_min, _FAR_M))
    hidden = physics.is_seen(begin_m, end_m)
    # Rays do not see a shape that they begin in.
    begin_in_root_m = begin_m - [0.0, 0.0, height_m - z_m]
    is_inside = all(any(holds_point(shape, point_m) for shape in description.hull) for point_m in begin_in_root_m)
    if is_inside and not _is_in_its_case(description, mount.link):
        return _inside(description, f'{place}inside a collision shape of the robot')
    return _hidden(place, bearings_rad, hidden)


def _place(mount: RobotLaser) -> Tuple[List[float], float]:
    pose = mount.pose_in_root
    return pose[:3, 3].tolist(), math.atan2(pose[1, 0], pose[0, 0])


def _is_in_its_case(description: RobotDescription, link: str) -> bool:
    """Return whether the scanner is in a shape of its own link: real rays begin outside of that."""
    shapes = description.tree.links[link].collisions
    cases = [shape for shape in shapes if not isinstance(shape.geometry, Mesh)]
    return any(all(reach_m([case], way) > 0.0 for way in _SIX_WAYS) for case in cases)


def _inside(description: RobotDescription, value: str) -> Check:
    """Judge a scanner within a shape: that may be because the shape stands in for a mesh with a recess."""
    shapes = (shape for link in description.tree.links.values() for shape in link.collisions)
    if any(isinstance(shape.geometry, Mesh) for shape in shapes):
        return Check(
            'laser', value, True, 'meshes are replaced by their hulls; nothing of the robot hides the world here'
        )
    return Check('laser', value, False, 'move the link, or make the shape smaller')


def _hidden(place: str, bearings_rad: np.ndarray, hidden: np.ndarray) -> Check:
    if hidden.mean() < _LEAST_HIDDEN:
        return Check('laser', f'{place}sees nothing of the robot', True, '')
    seen_deg = np.degrees(bearings_rad[hidden])
    value = (
        f'{place}sees the robot itself in {100 * hidden.mean():.0f} % of its rays, '
        f'from {seen_deg.min():.0f} to {seen_deg.max():.0f} degrees'
    )
    advice = (
        'the simulated scanner sees through the robot: limit simulator.lidar.angle_min and angle_span to what is free'
    )
    return Check('laser', value, bool(hidden.mean() <= _MOST_HIDDEN), advice)


SPEEDS_MPS = (0.1, 1.0)  # or the robot's limit
TOLERANCE = 1e-3  # truth against wheels, relative
# A robot that drives straight may turn by so much unnoticed by its wheels: 0.1 % of the way to the side.
TOLERANCE_RADPM = 2e-3
LEAST_WHEEL_LOAD = 0.1  # of the weight, on each wheel
LARGEST_PITCH_AT_REST_DEG, LARGEST_PITCH_DEG = 1.0, 5.0
LEAST_REACHED = 0.98  # of the commanded speed, when the ramp is over

STANDSTILL = 1e-3  # m or rad: a drive that is none

_SLIP_ADVICE = 'the robot slips or tips: see weight, pitch and torque; lower accelerations in simulator.drive'


class _Drives(NamedTuple):
    """Drives both ways at each speed."""

    straight: List[FlatDrive]
    turning: List[FlatDrive]


def self_check(robot: SimulatedRobot, params: SimulatorParams) -> List[Check]:
    """Drive a robot on a flat floor of its own, within its own limits, and return what was found; it takes a second."""
    floor = FlatFloor(robot, params.drive, params.physics)
    try:
        loads = floor.rest()
        rest_pitch_deg = math.degrees(floor.pitch_rad())
        laser = check_laser(robot.description, floor.physics, params.lidar)
        drives = _Drives(
            [floor.straight(sign * speed) for speed in SPEEDS_MPS for sign in (1.0, -1.0)],
            [floor.turn(sign * speed) for speed in SPEEDS_MPS for sign in (1.0, -1.0)],
        )
    finally:
        floor.close()
    checks = [*_straight(drives.straight), *_turns(drives.turning), _weight(robot, loads)]
    return [*checks, _pitch(rest_pitch_deg, drives.straight), _torque(robot, params.drive, drives), laser]


def _straight(drives: List[FlatDrive]) -> Iterator[Check]:
    """Compare truth and wheels straight ahead and back."""
    for name, same_way in (('straight, forward', drives[0::2]), ('straight, backward', drives[1::2])):
        distance = max(_relative(drive.true_distance_m, drive.wheel_distance_m) for drive in same_way)
        turn_radpm = max(
            _ratio(drive.true_turn_rad - drive.wheel_turn_rad, drive.wheel_distance_m) for drive in same_way
        )
        value = (
            f'at {_speeds(same_way)} m/s truth and wheels differ by {100 * distance:.4f} % of the distance, '
            f'{math.degrees(turn_radpm):.4f} deg/m'
        )
        yield _judged(name, value, distance <= TOLERANCE and turn_radpm <= TOLERANCE_RADPM, _SLIP_ADVICE)


def _turns(drives: List[FlatDrive]) -> Iterator[Check]:
    """Compare truth and wheels in turns in place."""
    for name, same_way in (('turn, left', drives[0::2]), ('turn, right', drives[1::2])):
        angle = max(_relative(drive.true_turn_rad, drive.wheel_turn_rad) for drive in same_way)
        value = f'at {_speeds(same_way)} rad/s truth and wheels differ by {100 * angle:.4f} % of the angle'
        yield _judged(name, value, angle <= TOLERANCE, _SLIP_ADVICE)


def _weight(robot: SimulatedRobot, loads: Dict[str, float]) -> Check:
    """Check that the driven wheels carry what they need to drive."""
    weight_n = robot.description.mass.mass_kg * GRAVITY_MPS2
    left, right = (loads.get(joint, 0.0) for joint in robot.joints)
    value = f'left {left * weight_n:.3g} N ({100 * left:.0f} %), right {right * weight_n:.3g} N ({100 * right:.0f} %)'
    value += f' of {weight_n:.3g} N'
    advice = 'the rest is on casters: a centre of mass (of the <inertial> tags) nearer to the axle'
    return _judged('weight on the driven wheels', value, min(left, right) >= LEAST_WHEEL_LOAD, advice)


def _pitch(at_rest_deg: float, drives: List[FlatDrive]) -> Check:
    lowest_deg = math.degrees(min(drive.pitches_rad[0] for drive in drives))
    highest_deg = math.degrees(max(drive.pitches_rad[1] for drive in drives))
    at_rest, lowest, highest = (f'{round(pitch, 2) + 0.0:.2f}' for pitch in (at_rest_deg, lowest_deg, highest_deg))
    value = f'at rest {at_rest} degrees, {lowest} to {highest} while speeding up and braking'
    is_ok = abs(at_rest_deg) <= LARGEST_PITCH_AT_REST_DEG and max(-lowest_deg, highest_deg) <= LARGEST_PITCH_DEG
    advice = (
        'it tips over: a lower centre of mass, nearer to the axle, or a lower simulator.drive.max_linear_acceleration'
    )
    return _judged('pitch', value, is_ok, advice)


def _torque(robot: SimulatedRobot, params: DriveParams, drives: _Drives) -> Check:
    """Check that the motors follow the ramps of their controller."""
    mass, wheels = robot.description.mass, robot.wheels
    radius_m = max(wheels.left_radius_m, wheels.right_radius_m)
    straight_nm = 0.5 * mass.mass_kg * params.max_linear_acceleration * radius_m
    turning_nm = mass.inertia_kgm2[2, 2] * params.max_angular_acceleration * radius_m / wheels.separation_m
    reached = min(drive.reached for drive in drives.straight + drives.turning)
    value = (
        f'{100 * reached:.0f} % of the speed at the end of the ramp; '
        f'{max(straight_nm, turning_nm):.3g} of {params.wheel_torque:.3g} N m for the body alone'
    )
    advice = 'a higher simulator.drive.wheel_torque, or lower accelerations'
    return _judged('torque', value, reached >= LEAST_REACHED, advice)


def _speeds(drives: List[FlatDrive]) -> str:
    return ' and '.join(f'{abs(drive.speed):.3g}' for drive in drives)


def _judged(name: str, value: str, is_ok: bool, advice: str) -> Check:
    return Check(name, value, is_ok, '' if is_ok else advice)


def _relative(true: float, by_wheels: float) -> float:
    return _ratio(true - by_wheels, by_wheels)


def _ratio(difference: float, way: float) -> float:
    """Return the size of a difference over that of a way; infinite for a robot that did not move."""
    return abs(difference / way) if abs(way) > STANDSTILL else math.inf
