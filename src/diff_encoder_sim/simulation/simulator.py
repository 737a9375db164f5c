"""The simulated robot: commands in, joint states and true pose out, on its own clock."""

from __future__ import annotations

import logging
import math
from pathlib import Path
from typing import Any, Dict, Optional, Sequence, Tuple, Union

from pydantic import Field, field_validator
from typing_extensions import Annotated

from diff_encoder_sim.base import bounds
from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.imu import ImuParams, ImuSample
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.params import Params, param
from diff_encoder_sim.base.per_wheel import WheelDiameterOrZero_m
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.robots.description import RobotChoices, RobotSource
from diff_encoder_sim.robots.robot_file import proposed_laser_line
from diff_encoder_sim.robots.simulated_robot import load_simulated_robot
from diff_encoder_sim.simulation.imu import Imu
from diff_encoder_sim.simulation.lidar import Lidar, LidarParams
from diff_encoder_sim.simulation.physics import GRAVITY_MPS2, BulletPhysics, PhysicsParams
from diff_encoder_sim.simulation.slip import Floor, FloorArea, SlippingWheels, WheelErrorParams
from diff_encoder_sim.simulation.state import TICK_NS, TICK_S, JointStates
from diff_encoder_sim.simulation.world import load_world

log = logging.getLogger(__name__)

ABOVE_LIMIT = 1.0 + 1e-9  # of a limit; less is rounding


class DriveParams(Params):
    """Limits of the motors and their controller."""

    max_linear_speed: bounds.PositiveSpeed_mps = param(1.0, 'commands are cut to it [m/s]')
    max_angular_speed: bounds.PositiveTurnRate_radps = param(2.0, 'commands are cut to it [rad/s]')
    max_linear_acceleration: bounds.PositiveAcceleration_mps2 = param(1.5, 'slope of the velocity ramp [m/s^2]')
    max_angular_acceleration: bounds.PositiveTurnAcceleration_radps2 = param(
        6.0, 'slope of the turning-rate ramp [rad/s^2]'
    )
    wheel_torque: Annotated[float, Between(1e-6, 1e6, 'N m')] = param(20.0, 'of each motor [N m]')
    command_timeout: bounds.PositiveDuration_s = param(0.5, 'the robot stops after this time without a command [s]')


class DriveController:
    """Ramps the body velocity towards the newest command and splits it onto the wheels."""

    def __init__(self, params: DriveParams, radii_m: Tuple[float, float], wheel_separation_m: float) -> None:
        self.params = params
        self._radii_m, self._wheel_separation_m = radii_m, wheel_separation_m
        self.reset()

    def reset(self) -> None:
        """Stand still with no command."""
        self._command, self._command_time_ns = (0.0, 0.0), 0
        self._velocity = (0.0, 0.0)  # linear [m/s] and angular [rad/s], on the ramp
        self._wheel_speeds_radps = (0.0, 0.0)

    def command(self, now_ns: int, linear_mps: float, angular_radps: float) -> None:
        """Take a command, cut to the limits with a warning; InputFault if it is not finite: then the last one stays."""
        if not (math.isfinite(linear_mps) and math.isfinite(angular_radps)):
            raise InputFault(f'linear.x {linear_mps} m/s, angular.z {angular_radps} rad/s; expected finite numbers')
        most_mps, most_radps = self.params.max_linear_speed, self.params.max_angular_speed
        if max(abs(linear_mps) / most_mps, abs(angular_radps) / most_radps) > ABOVE_LIMIT:
            log.warning(
                'velocity command of %.3f m/s, %.3f rad/s exceeds the limits of %.3f m/s, %.3f rad/s: limited to them',
                linear_mps, angular_radps, most_mps, most_radps,
            )  # fmt: skip
        self._command, self._command_time_ns = (clamp(linear_mps, most_mps), clamp(angular_radps, most_radps)), now_ns

    def wheel_speeds_radps(self, now_ns: int, interval_s: float) -> Tuple[float, float]:
        """Return the speeds of the left and the right wheel [rad/s] for the next interval."""
        age_s = (now_ns - self._command_time_ns) / NANOSECONDS_PER_SECOND
        wanted = self._command if age_s <= self.params.command_timeout else (0.0, 0.0)
        if wanted != self._velocity:
            linear_mps, angular_radps = self._velocity
            linear_mps += clamp(wanted[0] - linear_mps, self.params.max_linear_acceleration * interval_s)
            angular_radps += clamp(wanted[1] - angular_radps, self.params.max_angular_acceleration * interval_s)
            self._velocity = linear_mps, angular_radps
            swing_mps, (left_m, right_m) = 0.5 * self._wheel_separation_m * angular_radps, self._radii_m
            self._wheel_speeds_radps = (linear_mps - swing_mps) / left_m, (linear_mps + swing_mps) / right_m
        return self._wheel_speeds_radps


def clamp(value: float, limit: float) -> float:
    """Return a value cut to a limit of its size."""
    return max(-limit, min(limit, value))


class SimulatorParams(Params):
    """Parameters of the simulated robot."""

    left_joint: str = Field('left_wheel_joint', min_length=1, description='joint of the left wheel in the robot file')
    right_joint: str = Field(
        'right_wheel_joint', min_length=1, description='joint of the right wheel in the robot file'
    )
    laser_link: str = Field(
        'laser', min_length=1, description='link of the LiDAR in the robot file, and frame of its scans'
    )
    wheel_diameter: WheelDiameterOrZero_m = param(
        0.0, 'nominal one of the robot, which its controller knows [m]; 0: as in the robot file'
    )
    wheel_separation: bounds.LengthOrZero_m = param(
        0.0, 'between the contact points, nominal one of the robot [m]; 0: as in the robot file'
    )
    drive: DriveParams = param(DriveParams(), 'motors and their controller')
    lidar: LidarParams = param(LidarParams(), 'LiDAR')
    imu: Optional[ImuParams] = param(None, 'inertial measurement unit; without it, none is simulated')
    physics: PhysicsParams = param(PhysicsParams(), 'settings of PyBullet')
    wheel_errors: WheelErrorParams = param(WheelErrorParams(), 'errors of the wheels')

    def choices(self) -> RobotChoices:
        """Return what these parameters say about the robot."""
        choices: Dict[str, Any] = {key: getattr(self, key) or None for key in RobotChoices.model_fields}
        return RobotChoices(**choices)

    @field_validator('lidar', 'imu')
    @classmethod
    def _check_period(cls, sensor: Union[LidarParams, ImuParams, None]) -> Union[LidarParams, ImuParams, None]:
        if sensor is not None and sensor.period_ns % TICK_NS:
            raise ValueError(f'a rate whose period is whole {TICK_NS // 1_000_000} ms')
        return sensor


class Simulator:
    """One robot in one world, advanced tick by tick (10 ms). Same seed, same numbers.

    `physics`, which `reset` replaces, has the true state of the robot, and puts it at another pose: time, wheel angles
    and the command continue, and the encoder does not measure it (the kidnapped robot problem).
    """

    def __init__(
        self,
        world_file: Union[str, Path],
        robot: RobotSource,
        params: SimulatorParams,
        start_pose: Pose2D,
        seed: int,
        floor: Sequence[FloorArea] = (),
    ) -> None:
        """Load both files and put the robot, at rest, at `start_pose` of the world, whose floor has other areas.

        The wheels' initial angles are drawn from the seed: without this, every trial would repeat the same quantisation
        error. ConfigError if a file is missing or malformed.
        """
        self.params, self.world = params, load_world(world_file)
        self._floor = Floor(self.world.floor_friction, floor)
        geometry = params.wheel_errors.geometry(generator(seed, 'wheel_geometry'))
        self._robot = load_simulated_robot(robot, params.choices(), geometry)
        self._joints, self._forward_signs = self._robot.joints, self._robot.forward_signs
        description, self._start_pose, self._seed = self._robot.description, start_pose, seed
        if description.laser is None:
            allowed = f'simulator.laser_link, a link of the file, or {proposed_laser_line(description)}'
            raise ConfigError(f'{description.tree.where}: no laser is found; allowed: {allowed}')
        self.laser_pose_in_base = description.laser.pose_in_base
        self._laser_above_base_m = float(description.laser.pose_in_root[2, 3])
        self._controller = DriveController(params.drive, description.radii_m, description.wheel_separation_m)
        self._begin()

    @property
    def robot_name(self) -> str:
        """The robot's name in its URDF."""
        return self._robot.description.tree.name

    @property
    def imu_frames(self) -> Optional[Tuple[str, str]]:
        """The frames of base_link and of the IMU at it; None without an IMU, or if the IMU's is a link of the robot."""
        imu, tree = self.params.imu, self._robot.description.tree
        return None if imu is None or imu.frame in tree.links else (tree.root, imu.frame)

    def close(self) -> None:
        """Free the physics; the object cannot be used afterwards."""
        self.physics.close()

    def reset(self) -> None:
        """Restore the state of the beginning, time and wheel angles included."""
        self.close()
        self._controller.reset()
        self._begin()

    def _begin(self) -> None:
        """Set time to 0, and draw what differs from trial to trial from the seed."""
        params, self.time_ns = self.params, 0
        self.physics = BulletPhysics(
            self.world, self._robot, self._start_pose, params.drive.wheel_torque, params.physics
        )
        self._phases_rad = generator(self._seed, 'wheel_phase').uniform(0.0, 2.0 * math.pi, 2).tolist()
        # base_link may be at the floor, where ALTO's is, or at the axle.
        self._scan_height_m = self.physics.base_pose()[0][2] + self._laser_above_base_m
        self._lidar = Lidar(self.world, self._scan_height_m, params.lidar, generator(self._seed, 'lidar_noise'))
        rngs = generator(self._seed, 'wheel_slip'), generator(self._seed, 'wheel_spin_and_bumps')
        self._wheels = SlippingWheels(params.wheel_errors, self._robot.wheels, *rngs)
        self._imu: Optional[Imu] = None
        if params.imu is not None:
            pose_in_body, rng = self.physics.base_in_inertial, generator(self._seed, 'imu')
            self._imu = Imu(params.imu, GRAVITY_MPS2, rng, pose_in_body)
        self._read_wheels()

    def reset_world(self) -> None:
        """Put the robot back at its start; time and wheel angles continue."""
        self._controller.reset()
        self.physics.place(self._start_pose)

    def command(self, linear_mps: float, angular_radps: float) -> None:
        """Command a velocity of base_link; InputFault if the command is not finite."""
        self._controller.command(self.time_ns, linear_mps, angular_radps)

    def tick(self) -> None:
        """Advance by 10 ms."""
        speeds = self._controller.wheel_speeds_radps(self.time_ns, TICK_S)
        self.physics.tick(*self._wheels.rolling_speeds(*speeds, self._slip_factors()))
        self.time_ns += TICK_NS
        self._read_wheels()

    def joint_states(self) -> JointStates:
        """Return the wheels' angles (phase included) and speeds, as ideal sensors of the robot's joints."""
        left, right = self._forward_signs
        (left_rad, right_rad), (left_radps, right_radps) = self._angles_rad, self._speeds_radps
        return JointStates(
            self.time_ns, self._joints, (left * left_rad, right * right_rad), (left * left_radps, right * right_radps)
        )

    def scan(self) -> Scan:
        """Take a scan from the LiDAR's true pose."""
        laser_pose_in_world = self.physics.base_pose_in_plane().compose(self.laser_pose_in_base)
        return self._lidar.scan(self.time_ns, laser_pose_in_world)

    def imu(self) -> Optional[ImuSample]:
        """Return the sample of the IMU whose message is due at this tick, after its latency; None if there is none.

        Call it once in each tick.
        """
        return None if self._imu is None else self._imu.step(self.time_ns, self.physics.inertial_motion)

    def _slip_factors(self) -> Tuple[float, float]:
        """Return the factors on slip of the floor below the left and the right wheel."""
        if not self._floor.areas:
            return (1.0 / self._floor.mu,) * 2
        base, axle_x_m = self.physics.base_pose_in_plane(), self._robot.description.axle_x_m
        half_m = 0.5 * self._robot.wheels.separation_m
        left, right = (base.compose(Pose2D(axle_x_m, side * half_m, 0.0)) for side in (1.0, -1.0))
        return self._floor.slip_factor(left.x_m, left.y_m), self._floor.slip_factor(right.x_m, right.y_m)

    def _read_wheels(self) -> None:
        rolled = self.physics.wheels()
        turned_rad = self._wheels.turned(rolled.angles_rad)
        self._angles_rad = self._phases_rad[0] + turned_rad[0], self._phases_rad[1] + turned_rad[1]
        self._speeds_radps = self._wheels.turning_speeds(*rolled.speeds_radps)
