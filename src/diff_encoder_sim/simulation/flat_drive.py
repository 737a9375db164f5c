"""Drives on a flat floor without end, in which truth is compared with what the wheels say."""

from __future__ import annotations

import math
from typing import Callable, Dict, List, NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, wrap_angle, yaw_from_quat_xyzw
from diff_encoder_sim.robots.simulated_robot import SimulatedRobot
from diff_encoder_sim.simulation.drive import DriveController, DriveParams
from diff_encoder_sim.simulation.periods import STATES_PERIOD_S, TICK_NS, TICK_S
from diff_encoder_sim.simulation.physics import BulletPhysics, PhysicsParams
from diff_encoder_sim.simulation.world import Model, Plane, Solid, World

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
